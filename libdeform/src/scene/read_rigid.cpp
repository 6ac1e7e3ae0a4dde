// "rigid": bodies of a rigid host with their joints.
#include <algorithm>

#include "math/turn.h"
#include "scene/keys.h"
#include "scene/read.h"

namespace dfm::scene {
namespace {

RigidBody read_rigid_body(const Node &node, ReadContext &context) {
  RigidBody b;
  b.def = dfm_rigid_def_default();
  b.def.half_length = 0;
  read_thing(node.object("rigid_body"), context, b);
  const std::string shape = node.at("shape").word("rigid_shape");
  check_shape_keys(node, shape);
  read_solid(node, shape, b.def);
  b.def.pose = read_pose(node, "rigid_pose", nullptr);
  b.def.fixed = node.boolean("fixed", false);
  if (!b.def.fixed || node.has("mass")) b.def.mass = node.at("mass").number(kPositive);
  if (node.has("inertia")) read_sizes(node.member("inertia"), "moments of inertia", b.def.inertia);
  node.vector("velocity", b.def.velocity, 0, 0, 0);
  node.vector("spin", b.def.spin, 0, 0, 0);
  if (!node.has("start")) return b;
  const Node start = node.member("start").object("rigid_start");
  if (b.def.fixed) start.fail("a fixed body stays where it is; remove \"start\" or \"fixed\"");
  const dfm_pose pose = read_placed(start, b.def.pose);
  dfm_rigid_state state{};
  store_pose(state, load_pose(pose));
  start.vector("velocity", state.velocity, b.def.velocity[0], b.def.velocity[1], b.def.velocity[2]);
  start.vector("spin", state.spin, b.def.spin[0], b.def.spin[1], b.def.spin[2]);
  b.start = state;
  return b;
}

Joint read_joint(const Node &node, const RigidBody &body, const std::vector<std::string> &names) {
  Joint j;
  j.def.size = sizeof j.def;
  node.object("joint");
  j.pointer = node.pointer();
  const std::string type = node.at("type").word("joint_type");
  j.def.type = number_of("joint_type", type);
  if (node.has("with") && !node.member("with").value().is_null()) {
    j.with = known(node.member("with"), names, "rigid body");
    if (j.with == body.name) node.member("with").fail("\"%s\" cannot be tied to itself", j.with.c_str());
  }
  const double *const p = body.def.pose.position;
  node.vector("anchor", j.def.anchor, p[0], p[1], p[2]);
  check_keys_of(node, {{"axis", {"hinge", "slider"}}, {"motor", {"hinge", "slider"}}}, "a joint of the type",
                type);
  if (j.def.type == DFM_JOINT_HINGE || j.def.type == DFM_JOINT_SLIDER)
    read_direction(node.at("axis"), "the axis of a joint", j.def.axis);
  if (node.has("motor")) {
    const Node motor = node.member("motor").object("motor");
    j.def.motor = 1;
    j.def.velocity = motor.at("velocity").number();
    j.def.max = motor.at("max").number(kNotNegative);
  }
  return j;
}

}  // namespace

Rigid read_rigid(const Node &scene, ReadContext &context) {
  Rigid out;
  if (!scene.has("rigid")) return out;
  const Node rigid = scene.member("rigid").object("rigid");
  out.pointer = rigid.pointer();
  out.host = rigid.member("host", "builtin").text();
  std::vector<std::string> names;
  const std::vector<Node> nodes = rigid.items("bodies");
  for (const Node &node : nodes) {
    out.bodies.push_back(read_rigid_body(node, context));
    names.push_back(out.bodies.back().name);
  }
  // Joints may name bodies that come later in the list.
  for (size_t i = 0; i < nodes.size(); ++i)
    for (const Node &joint : nodes[i].items("joints"))
      out.bodies[i].joints.push_back(read_joint(joint, out.bodies[i], names));
  return out;
}

}  // namespace dfm::scene
