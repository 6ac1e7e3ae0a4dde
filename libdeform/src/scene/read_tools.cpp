// "tools": what hands and devices move.
#include <algorithm>

#include "scene/read.h"

namespace dfm::scene {
namespace {

constexpr double kRadian = 0.017453292519943295;  // of a degree
constexpr Range kOpening{0, 170, false, false};   // degrees
constexpr Range kLate{0, 0.1, false, false};      // s

struct Shape {
  const char *name;
  uint32_t number;
  std::vector<std::string> keys, optional;
};
const std::vector<Shape> &shapes() {
  static const std::vector<Shape> list = {
      {"sphere", DFM_TOOL_SPHERE, {"radius"}, {}},
      {"capsule", DFM_TOOL_CAPSULE, {"radius", "half_length"}, {}},
      {"box", DFM_TOOL_BOX, {"half_size"}, {}},
      {"mesh", DFM_TOOL_MESH, {"mesh"}, {}},
      {"grasper", DFM_TOOL_GRASPER, {"half_size"}, {"radius", "half_length", "opening_deg"}},
      {"scissors", DFM_TOOL_SCISSORS, {"half_size"}, {"radius", "half_length", "opening_deg"}},
      {"ellipsoid", DFM_TOOL_ELLIPSOID, {"half_size"}, {}},
      {"blade", DFM_TOOL_BLADE, {"half_size"}, {}}};
  return list;
}

const Shape &read_shape(const Node &node) {
  const std::string word = node.at("shape").word("tool_shape");
  const Shape &shape =
      *std::find_if(shapes().begin(), shapes().end(), [&](auto &s) { return s.name == word; });
  for (const char *key : {"radius", "half_size", "half_length", "mesh", "opening_deg"}) {
    const auto listed = [&](const std::vector<std::string> &keys) {
      return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    if (node.has(key) && !listed(shape.keys) && !listed(shape.optional))
      node.member(key).fail("a tool of the shape %s has no \"%s\"", shape.name, key);
  }
  return shape;
}

void read_sizes(const Node &node, const Shape &shape, Tool &t) {
  dfm_tool_def &d = t.def;
  const auto wanted = [&](const char *key) {
    return std::find(shape.keys.begin(), shape.keys.end(), key) != shape.keys.end();
  };
  d.radius = d.half_length = 0;
  if (wanted("radius") || node.has("radius")) d.radius = node.at("radius").number(kPositive);
  if (wanted("half_length") || node.has("half_length"))
    d.half_length = node.at("half_length").number(kNotNegative);
  if (wanted("mesh")) t.solid.mesh = node.at("mesh").text();
  if (!wanted("half_size")) return;
  const Node half = node.at("half_size");
  half.vector(d.half_size);
  for (const double size : d.half_size)
    if (!(size > 0)) half.fail("half sizes are above 0, found %g", size);
}

void read_opening(const Node &opening, Tool &t) {
  if (opening.value().is_number()) {
    t.def.opening = kRadian * opening.number(kOpening);
    return;
  }
  opening.object("opening");
  const std::vector<Node> keys = opening.at("keyframes").items();
  if (keys.empty()) opening.at("keyframes").fail("expected at least one keyframe");
  for (size_t i = 0; i < keys.size(); ++i) {
    keys[i].object("opening_key");
    const dfm_scale_key key = {keys[i].at("t").number(), kRadian * keys[i].at("value").number(kOpening)};
    check_rising(keys[i], i, i ? t.opening_keys.back().t : 0, key.t);
    t.opening_keys.push_back(key);
  }
}

void read_coupling(const Node &coupling, dfm_tool_def &d) {
  coupling.object("coupling");
  d.stiffness = coupling.at("stiffness").number(kPositive);
  d.damping = coupling.number("damping", 0.0, kNotNegative);
  d.turn_stiffness = coupling.at("turn_stiffness").number(kPositive);
  d.turn_damping = coupling.number("turn_damping", 0.0, kNotNegative);
  d.mass = coupling.number("mass", d.mass, kPositive);
  d.inertia = coupling.number("inertia", d.inertia, kPositive);
  d.late = coupling.number("late", 0.0, kLate);
  if (coupling.boolean("passive", false)) d.flags |= DFM_TOOL_PASSIVE;
}

// A list of bodies, or an object with the list, how and how much.
void read_cuts(const Node &cuts, const ReadContext &context, Tool &t) {
  const bool edge = t.def.shape == DFM_TOOL_BLADE || t.def.shape == DFM_TOOL_SCISSORS;
  t.cuts.how = edge ? DFM_CUT_SPLIT : DFM_CUT_REMOVE;
  t.cuts.pointer = cuts.pointer();
  const bool list = cuts.value().is_array();
  if (!list) {
    cuts.object("tool_cuts");
    if (cuts.word("mode", edge ? "split" : "remove", "cut_mode") == "remove") t.cuts.how = DFM_CUT_REMOVE;
    else t.cuts.how = DFM_CUT_SPLIT;
    if (cuts.has("most")) t.cuts.most = read_count(cuts.member("most"), 0, UINT32_MAX);
  }
  const Node bodies = list ? cuts : cuts.at("bodies");
  for (const Node &name : bodies.items()) t.cuts.bodies.push_back(known(name, context.bodies, "body"));
  if (t.cuts.bodies.empty()) bodies.fail("expected at least one body");
}

Tool read_tool(const Node &node, ReadContext &context) {
  Tool t;
  t.def = dfm_tool_def_default();
  node.object("tool");
  t.solid.pointer = node.pointer();
  t.solid.name = node.at("name").name();
  t.solid.id = read_id(node);
  const Shape &shape = read_shape(node);
  t.def.shape = shape.number;
  std::vector<std::string> names = {t.solid.name};
  const bool jaws = shape.number == DFM_TOOL_GRASPER || shape.number == DFM_TOOL_SCISSORS;
  for (const char *part : {".left", ".right"})
    if (jaws) names.push_back(t.solid.name + part);
  if (jaws && node.has("radius")) names.push_back(t.solid.name + ".shaft");
  if (shape.number == DFM_TOOL_MESH || shape.number == DFM_TOOL_ELLIPSOID)
    names.push_back(t.solid.name + ".shape");
  for (const std::string &name : names) {
    check_fresh(node.at("name"), name, context.sides, "body, obstacle or tool");
    context.sides.push_back(name);
  }
  read_sizes(node, shape, t);
  const bool of_triangles = shape.number == DFM_TOOL_MESH;
  if (!of_triangles && node.has("pose") && node.member("pose").has("scale"))
    node.member("pose").at("scale").fail("a %s has its own size; \"scale\" is for the shape mesh",
                                         shape.name);
  t.def.pose = read_pose(node, "obstacle_pose", of_triangles ? &t.solid.scale : nullptr);
  if (node.has("motion")) {
    const Node motion = node.member("motion");
    motion.object("tool_motion");
    if (motion.has("file") == motion.has("keyframes"))
      motion.fail("expected one of \"keyframes\" and \"file\"");
    if (motion.has("file")) t.hand = motion.member("file").text();
    else t.keys = read_keys(motion, t.def.pose);
    if (t.hand.empty() && t.keys.empty()) motion.at("keyframes").fail("expected at least one keyframe");
  }
  if (node.has("opening_deg") && !t.hand.empty() && !node.member("opening_deg").value().is_number())
    node.member("opening_deg")
        .fail("the file of the motion already gives the opening of the jaws; remove one");
  if (node.has("opening_deg")) read_opening(node.member("opening_deg"), t);
  if (node.has("coupling")) read_coupling(node.member("coupling"), t.def);
  if (node.has("cuts")) read_cuts(node.member("cuts"), context, t);
  if (node.has("material")) t.solid.material = known(node.member("material"), context.materials, "material");
  return t;
}

}  // namespace

std::vector<Tool> read_tools(const Node &scene, ReadContext &context) {
  std::vector<Tool> out;
  for (const Node &node : scene.items("tools")) out.push_back(read_tool(node, context));
  return out;
}

}  // namespace dfm::scene
