// "cuts": what is cut without a tool.
#include <algorithm>

#include "scene/keys.h"
#include "scene/read.h"

namespace dfm::scene {
namespace {

// In the order of the words.
struct Shape {
  uint32_t number;
  std::vector<std::string> keys;
};
const Shape &shape_of(const std::string &word) {
  static const std::vector<Shape> list = {{DFM_CUT_PLANE, {"point", "normal"}},
                                          {DFM_CUT_BLADE, {"corners"}},
                                          {DFM_CUT_ELLIPSOID, {"radius", "pose"}},
                                          {DFM_CUT_BOX, {"half_size", "pose"}},
                                          {DFM_CUT_ELLIPSOID, {"half_size", "pose"}}};
  return list[number_of("cut_shape", word)];
}

void read_shape(const Node &node, const std::string &word, dfm_cut_def &d) {
  const Shape &shape = shape_of(word);
  for (const char *key : {"point", "normal", "corners", "radius", "half_size", "pose"})
    if (node.has(key) && !listed(shape.keys, key))
      node.member(key).fail("a cut of the shape %s has no \"%s\"", word.c_str(), key);
  d.shape = shape.number;
  if (listed(shape.keys, "normal")) {
    node.at("point").vector(d.blade);
    read_direction(node.at("normal"), "the normal of a plane", d.blade + 3);
  }
  if (listed(shape.keys, "corners")) {
    const std::vector<Node> corners = node.at("corners").items();
    if (corners.size() != 4)
      node.at("corners").fail("expected four points, in order around the blade; found %zu", corners.size());
    for (size_t k = 0; k < 4; ++k) corners[k].vector(d.blade + 3 * k);
  }
  if (listed(shape.keys, "radius")) std::fill_n(d.half_size, 3, node.at("radius").number(kPositive));
  if (listed(shape.keys, "half_size")) read_sizes(node.at("half_size"), "half sizes", d.half_size);
  if (listed(shape.keys, "pose")) d.pose = read_pose(node, "cut_pose", nullptr);
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
