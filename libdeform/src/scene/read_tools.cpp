// "tools": what hands and devices move.
#include "scene/keys.h"
#include "scene/read.h"
#include "scene/rotation.h"
#include "state/tool.h"

namespace dfm::scene {
namespace {

constexpr Range kOpening{0, kWidest, false, false};
constexpr Range kLate{0, 0.1, false, false};  // s

// Jaws may have a shaft, of a radius and a length.
void read_size(const Node &node, Tool &t) {
  dfm_tool_def &d = t.def;
  const bool capsule = d.shape == DFM_TOOL_CAPSULE, round = capsule || d.shape == DFM_TOOL_SPHERE;
  d.radius = d.half_length = 0;
  if (round || node.has("radius")) d.radius = node.at("radius").number(kPositive);
  if (capsule || node.has("half_length")) d.half_length = node.at("half_length").number(kNotNegative);
  if (d.shape == DFM_TOOL_MESH) t.solid.mesh = node.at("mesh").text();
  else if (!round) read_sizes(node.at("half_size"), "half sizes", d.half_size);
}

void read_opening(const Node &opening, Tool &t) {
  if (opening.value().is_number()) {
    t.def.opening = kRadian * opening.number(kOpening);
    return;
  }
  opening.object("opening").at("keyframes");
  t.opening_keys = read_keyframes<dfm_scale_key>(
      opening, "opening_key",
      [](const Node &node, dfm_scale_key &key) { key.value = kRadian * node.at("value").number(kOpening); });
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
    t.cuts.how = number_of("cut_mode", cuts.word("mode", edge ? "split" : "remove", "cut_mode"));
    if (cuts.has("most")) t.cuts.most = read_count(cuts.member("most"), 0, UINT32_MAX);
  }
  const Node bodies = list ? cuts : cuts.at("bodies");
  for (const Node &name : bodies.items()) t.cuts.bodies.push_back(known(name, context.bodies, "body"));
  if (t.cuts.bodies.empty()) bodies.fail("expected at least one body");
}

}  // namespace

Tool read_tool(const Node &node, ReadContext &context) {
  Tool t;
  t.def = dfm_tool_def_default();
  node.object("tool");
  t.solid.pointer = node.pointer();
  t.solid.name = node.at("name").name();
  t.solid.id = read_id(node);
  const std::string shape = node.at("shape").word("tool_shape");
  t.def.shape = number_of("tool_shape", shape);
  static const std::vector<KeyOf> kKeys = {
      {"radius", {"sphere", "capsule", "grasper", "scissors"}},
      {"half_size", {"box", "grasper", "scissors", "ellipsoid", "blade"}},
      {"half_length", {"capsule", "grasper", "scissors"}},
      {"mesh", {"mesh"}},
      {"opening_deg", {"grasper", "scissors"}}};
  check_keys_of(node, kKeys, "a tool of the shape", shape);
  std::vector<std::string> names = {t.solid.name};
  const bool jaws = has_jaws(t.def), of_triangles = t.def.shape == DFM_TOOL_MESH;
  for (const char *part : {".left", ".right"})
    if (jaws) names.push_back(t.solid.name + part);
  if (jaws && node.has("radius")) names.push_back(t.solid.name + ".shaft");
  if (of_triangles || t.def.shape == DFM_TOOL_ELLIPSOID) names.push_back(t.solid.name + ".shape");
  for (const std::string &name : names) {
    check_fresh(node.at("name"), name, context.sides, "body, obstacle or tool");
    context.sides.push_back(name);
  }
  read_size(node, t);
  if (!of_triangles && node.has("pose") && node.member("pose").has("scale"))
    node.member("pose").at("scale").fail("a %s has its own size; \"scale\" is for the shape mesh",
                                         shape.c_str());
  t.def.pose = read_pose(node, "obstacle_pose", of_triangles ? &t.solid.scale : nullptr);
  if (node.has("motion")) {
    const Node motion = node.member("motion").object("tool_motion");
    if (motion.has("file") == motion.has("keyframes"))
      motion.fail("expected one of \"keyframes\" and \"file\"");
    if (motion.has("file")) t.hand = motion.member("file").text();
    else t.keys = read_keys(motion, t.def.pose);
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

}  // namespace dfm::scene
