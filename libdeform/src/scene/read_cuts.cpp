// "cuts": what is cut without a tool.
#include <algorithm>

#include "scene/keys.h"
#include "scene/read.h"

namespace dfm::scene {
namespace {

void read_shape(const Node &node, const std::string &word, dfm_cut_def &d) {
  static const std::vector<KeyOf> kKeys = {{"point", {"plane"}},
                                           {"normal", {"plane"}},
                                           {"corners", {"blade"}},
                                           {"radius", {"sphere"}},
                                           {"half_size", {"box", "ellipsoid"}},
                                           {"pose", {"sphere", "box", "ellipsoid"}}};
  check_keys_of(node, kKeys, "a cut of the shape", word);
  if (word == "plane") {
    d.shape = DFM_CUT_PLANE;
    node.at("point").vector(d.blade);
    return read_direction(node.at("normal"), "the normal of a plane", d.blade + 3);
  }
  if (word == "blade") {
    d.shape = DFM_CUT_BLADE;
    const std::vector<Node> corners = node.at("corners").items();
    if (corners.size() != 4)
      node.at("corners").fail("expected four points, in order around the blade; found %zu", corners.size());
    for (size_t k = 0; k < 4; ++k) corners[k].vector(d.blade + 3 * k);
    return;
  }
  d.shape = word == "box" ? DFM_CUT_BOX : DFM_CUT_ELLIPSOID;
  if (word == "sphere") std::fill_n(d.half_size, 3, node.at("radius").number(kPositive));
  else read_sizes(node.at("half_size"), "half sizes", d.half_size);
  d.pose = read_pose(node, "cut_pose", nullptr);
}

}  // namespace

Cut read_cut(const Node &node, const ReadContext &context, double start) {
  Cut out;
  node.object("cut");
  out.pointer = node.pointer();
  out.body = known(node.at("body"), context.bodies, "body");
  out.t = node.at("t").number(kNotNegative);
  if (out.t < start)
    node.at("t").fail("%g s is before the start of the scene, %g s (/time/start); give a later time", out.t,
                      start);
  const std::string shape = node.at("shape").word("cut_shape");
  read_shape(node, shape, out.def);
  const bool flat = out.def.shape == DFM_CUT_PLANE || out.def.shape == DFM_CUT_BLADE;
  out.def.how = number_of("cut_mode", node.word("mode", flat ? "split" : "remove", "cut_mode"));
  if (out.def.how == DFM_CUT_SPLIT && !flat)
    node.member("mode").fail("a %s has no edge to split along; use \"remove\", or the shape plane or blade",
                             shape.c_str());
  if (node.has("most")) out.def.most = read_count(node.member("most"), 0, UINT32_MAX);
  return out;
}

}  // namespace dfm::scene
