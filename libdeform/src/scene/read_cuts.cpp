// "cuts": what is cut without a tool.
#include <algorithm>

#include "scene/read.h"

namespace dfm::scene {
namespace {

struct Shape {
  const char *name;
  uint32_t number;
  std::vector<std::string> keys;
};
const std::vector<Shape> &shapes() {
  static const std::vector<Shape> list = {{"plane", DFM_CUT_PLANE, {"point", "normal"}},
                                          {"blade", DFM_CUT_BLADE, {"corners"}},
                                          {"sphere", DFM_CUT_ELLIPSOID, {"radius", "pose"}},
                                          {"box", DFM_CUT_BOX, {"half_size", "pose"}},
                                          {"ellipsoid", DFM_CUT_ELLIPSOID, {"half_size", "pose"}}};
  return list;
}

const Shape &read_shape(const Node &node) {
  const std::string word = node.at("shape").word("cut_shape");
  const Shape &shape =
      *std::find_if(shapes().begin(), shapes().end(), [&](auto &s) { return s.name == word; });
  for (const char *key : {"point", "normal", "corners", "radius", "half_size", "pose"})
    if (node.has(key) && std::find(shape.keys.begin(), shape.keys.end(), key) == shape.keys.end())
      node.member(key).fail("a cut of the shape %s has no \"%s\"", shape.name, key);
  return shape;
}

void read_sizes(const Node &node, const Shape &shape, dfm_cut_def &d) {
  const auto has = [&](const char *key) {
    return std::find(shape.keys.begin(), shape.keys.end(), key) != shape.keys.end();
  };
  if (has("normal")) {
    node.at("point").vector(d.blade);
    node.at("normal").vector(d.blade + 3);
    if (d.blade[3] == 0 && d.blade[4] == 0 && d.blade[5] == 0)
      node.at("normal").fail("the normal of a plane cannot be zero");
  }
  if (has("corners")) {
    const std::vector<Node> corners = node.at("corners").items();
    if (corners.size() != 4)
      node.at("corners").fail("expected four points, in order around the blade; found %zu", corners.size());
    for (size_t k = 0; k < 4; ++k) corners[k].vector(d.blade + 3 * k);
  }
  if (has("radius")) std::fill_n(d.half_size, 3, node.at("radius").number(kPositive));
  if (has("half_size")) {
    const Node half = node.at("half_size");
    half.vector(d.half_size);
    for (const double size : d.half_size)
      if (!(size > 0)) half.fail("half sizes are above 0, found %g", size);
  }
  if (has("pose")) d.pose = read_pose(node, "cut_pose", nullptr);
}

Cut read_cut(const Node &node, const ReadContext &context, double start) {
  Cut out;
  node.object("cut");
  out.pointer = node.pointer();
  out.body = known(node.at("body"), context.bodies, "body");
  out.t = node.at("t").number(kNotNegative);
  if (out.t < start)
    node.at("t").fail("%g s is before the start of the scene, %g s (/time/start); give a later time", out.t,
                      start);
  const Shape &shape = read_shape(node);
  out.def.shape = shape.number;
  read_sizes(node, shape, out.def);
  const bool flat = shape.number == DFM_CUT_PLANE || shape.number == DFM_CUT_BLADE;
  const bool split = node.word("mode", flat ? "split" : "remove", "cut_mode") == "split";
  if (split && !flat)
    node.member("mode").fail("a %s has no edge to split along; use \"remove\", or the shape plane or blade",
                             shape.name);
  out.def.how = split ? DFM_CUT_SPLIT : DFM_CUT_REMOVE;
  if (node.has("most")) out.def.most = read_count(node.member("most"), 0, UINT32_MAX);
  return out;
}

}  // namespace

std::vector<Cut> read_cuts(const Node &scene, const ReadContext &context, const Definition &def) {
  std::vector<Cut> out;
  for (const Node &node : scene.items("cuts")) out.push_back(read_cut(node, context, def.begin));
  if (def.equilibrium && !out.empty())
    scene.member("cuts").fail(
        "cuts are made in steps, and /time/mode \"static\" takes none; remove one of the two");
  return out;
}

}  // namespace dfm::scene
