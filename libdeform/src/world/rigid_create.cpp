// Adds a set of rigid bodies to a world: checks defs, passes them to the host, makes each an obstacle too.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "state/bounds.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/rigid/rigid.h"
#include "world/create.h"

namespace dfm {
namespace {

bool zero(const double *p) { return p[0] == 0 && p[1] == 0 && p[2] == 0; }

// Shape, pose and material are checked when the obstacle is created.
void check_body(dfm_rigid_def &d, const Named &whose) {
  if (d.shape != DFM_SHAPE_SPHERE && d.shape != DFM_SHAPE_BOX && d.shape != DFM_SHAPE_CAPSULE &&
      d.shape != DFM_SHAPE_NONE)
    refuse(whose,
           ": shape %u; it can be a sphere, a box or a capsule, or DFM_SHAPE_NONE with any shapes added by "
           "dfm_rigid_add_shape",
           d.shape);
  if (d.shape == DFM_SHAPE_NONE && !d.fixed && zero(d.inertia))
    refuse(whose, " has no shape to take its inertia from; give all three moments");
  if (!all_finite(d.pose.position, 3) || !all_finite(d.pose.rotation, 4) || !all_finite(d.velocity, 3) ||
      !all_finite(d.spin, 3))
    refuse(whose, ": pose, velocity and spin must be finite");
  if (!all_finite(d.half_size, 3) || !all_finite(&d.radius, 1) || !all_finite(&d.half_length, 1))
    refuse(whose, ": half_size, radius and half_length must be finite");
  check_velocity(whose, load3(d.velocity), load3(d.spin), 1);
  if (d.fixed) {
    if (!zero(d.velocity) || !zero(d.spin))
      refuse(whose, " is fixed and has a velocity; drop one (an obstacle's motion is prescribed)");
    d.mass = 0;
    d.inertia[0] = d.inertia[1] = d.inertia[2] = 0;
    return;
  }
  if (!(d.mass > 0 && std::isfinite(d.mass)))
    refuse(whose, ": mass %g kg; it must be positive and finite, or the body fixed", d.mass);
  if (zero(d.inertia)) solid_inertia(d, d.inertia);
  const double *const i = d.inertia, slack = 1e-9 * (i[0] + i[1] + i[2]);
  for (int k = 0; k < 3; ++k)
    if (!(i[k] > 0 && std::isfinite(i[k])))
      refuse(whose, ": moment of inertia %g kg m2; all three must be positive and finite", i[k]);
  for (int k = 0; k < 3; ++k)
    if (i[k] > i[(k + 1) % 3] + i[(k + 2) % 3] + slack)
      refuse(whose, ": moments of inertia %g, %g, %g kg m2; no body has one above the sum of the other two",
             i[0], i[1], i[2]);
}

void check_joint(const dfm_joint_def &j, uint32_t number, const std::vector<dfm_rigid_def> &bodies) {
  if (j.type > DFM_JOINT_FIXED)
    fail(DFM_E_ARG, "joint %u: type %u is unknown; use DFM_JOINT_HINGE, SLIDER, BALL or FIXED", number,
         j.type);
  const uint32_t n = static_cast<uint32_t>(bodies.size());
  if (j.body >= n || (j.with >= n && j.with != DFM_RIGID_WORLD))
    fail(DFM_E_ARG, "joint %u names body %u; the set has %u", number, j.body >= n ? j.body : j.with, n);
  const char *const name = bodies[j.body].name;
  if (j.body == j.with) fail(DFM_E_ARG, "joint %u ties rigid body '%s' to itself", number, name);
  if (bodies[j.body].fixed && (j.with == DFM_RIGID_WORLD || bodies[j.with].fixed))
    fail(DFM_E_ARG, "joint %u of rigid body '%s' ties two things that never move", number, name);
  if (!all_finite(j.anchor, 3) || !all_finite(j.axis, 3))
    fail(DFM_E_ARG, "joint %u of rigid body '%s': anchor and axis must be finite", number, name);
  const bool drives = j.type == DFM_JOINT_HINGE || j.type == DFM_JOINT_SLIDER;
  if (drives && zero(j.axis)) fail(DFM_E_ARG, "joint %u of rigid body '%s': its axis is zero", number, name);
  if (!std::isfinite(j.velocity) || !(j.max >= 0 && std::isfinite(j.max)))
    fail(DFM_E_ARG,
         "joint %u of rigid body '%s': motor velocity %g and max %g must be finite, max not negative", number,
         name, j.velocity, j.max);
  if (!j.motor) return;
  if (!drives)
    fail(DFM_E_ARG, "joint %u of rigid body '%s': only hinges and sliders have motors", number, name);
}

std::unique_ptr<Obstacle> make_part(World &w, const dfm_rigid_def &d) {
  dfm_obstacle_def o{};
  o.size = sizeof o;
  o.shape = d.shape;
  o.name = d.name;
  o.pose = d.pose;
  copy_shape(o, d);
  return make_obstacle(w, o, true);
}

void query_host(RigidSet &set, const std::vector<dfm_joint_def> &joints, void *data) {
  const uint32_t n = static_cast<uint32_t>(set.defs.size());
  set.group.assign(n, DFM_RIGID_STILL);
  const dfm_rigid_set_def def = {sizeof def, n, set.njoint, 0, set.defs.data(), joints.data(), data};
  uint32_t nextra = 0;
  const char *const host = set.host_name.c_str();
  const uint64_t said = sentences();
  void *made = nullptr;
  const dfm_status status = set.host.create(set.host.user, &def, &made, set.group.data(), &nextra);
  if (status == DFM_OK) set.self = made;  // of a call that fails nothing is left to destroy
  need_memory(status);
  if (status != DFM_OK) {
    const std::string why = sentences() != said ? last_error()
                                                : "it gives no reason; look for huge positions and speeds, "
                                                  "and for masses, inertias and joints that it cannot take";
    fail(DFM_E_FATAL, "rigid host '%s' refuses the set of rigid body '%s' (bodies: %u, joints: %u): %s", host,
         set.defs[0].name, n, set.njoint, why.c_str());
  }
  std::vector<uint32_t> members;
  for (const uint32_t g : set.group) {
    if (g == DFM_RIGID_STILL) {
      set.place.push_back(0);
      continue;
    }
    if (g >= n)
      fail(DFM_E_FATAL, "rigid host '%s' names group %u; groups are numbered from 0 to at most %u", host, g,
           n - 1);
    if (g >= members.size()) members.resize(g + 1);
    set.place.push_back(members[g]++);
  }
  set.ngroup = static_cast<uint32_t>(members.size());
  if (std::find(members.begin(), members.end(), 0u) != members.end())
    fail(DFM_E_FATAL, "rigid host '%s' leaves out a group number", host);
  set.extra.assign(nextra, 0.0);
  set.next_extra.assign(nextra, 0.0);
  set.motors.resize(set.njoint);
  for (uint32_t k = 0; k < set.njoint; ++k)
    if (joints[k].motor) set_rigid_motor(set, k, joints[k].velocity, joints[k].max);
}

}  // namespace

void destroy_rigids(RigidSet &set) {
  World &w = *set.world;
  const uint64_t said = sentences();
  if (const dfm_status status = set.host.may_destroy ? set.host.may_destroy(set.self) : dfm_status{DFM_OK};
      status != DFM_OK) {
    const std::string why = sentences() != said
                                ? last_error()
                                : format("rigid host '%s' keeps '%s'; remove it where it was made",
                                         set.host_name.c_str(), set.defs[0].name);
    fail(status < 0 ? status : DFM_E_STATE, "%s", why.c_str());
  }
  std::vector<uint64_t> ids;  // including additional shapes
  for (auto &o : w.obstacles)
    if (o->rigid == &set) ids.push_back(o->id);
  for (const uint64_t id : ids) end_contacts(w, id, true);  // may lack memory, so for all before any is gone
  for (const uint64_t id : ids) destroy_obstacle(rigid_obstacle(w, id));
  std::erase_if(w.rigid_sets, [&](auto &s) { return s.get() == &set; });
  w.changed = true;
}

std::unique_ptr<Obstacle> make_rigid_shape(World &w, const std::string &body, const dfm_obstacle_def &def) {
  const char *const name = def.name ? def.name : "(unnamed)";
  if (def.shape == DFM_SHAPE_PLANE || def.shape == DFM_SHAPE_NONE)
    fail(DFM_E_ARG, "shape '%s' of rigid body '%s' is %s; add a sphere, a box, a capsule, a mesh or voxels",
         name, body.c_str(), def.shape == DFM_SHAPE_PLANE ? "a plane, which has no inside" : "none");
  if (def.nkey || def.sine.frequency != 0 || def.sine.phase != 0 || norm2(load3(def.sine.amplitude)) > 0)
    fail(DFM_E_ARG, "shape '%s' of rigid body '%s' has a motion of its own; it moves with its body", name,
         body.c_str());
  if (norm2(load3(def.velocity_surface)) > 0)
    fail(DFM_E_ARG, "shape '%s' of rigid body '%s' has a velocity_surface; a rigid body has no belt", name,
         body.c_str());
  return make_obstacle(w, def, true);
}

Obstacle &join_rigid_shape(Obstacle &body, std::unique_ptr<Obstacle> shape) {
  RigidSet &set = *body.rigid;
  const uint32_t number = body.rigid_body;
  Obstacle &o = add_obstacle(*body.world, std::move(shape));
  o.rigid = &set;
  o.rigid_body = number;
  o.added = true;
  o.local = o.pose;
  o.pose = load_pose(set.state[number]) * o.local;
  return o;
}

Obstacle &add_rigid_shape(Obstacle &body, const dfm_obstacle_def &def) {
  return join_rigid_shape(body, make_rigid_shape(*body.world, body.name, def));
}

namespace {

bool is_given(const dfm_rigid_set_def &def, const std::string &name) {
  return std::any_of(def.bodies, def.bodies + def.nbody,
                     [&](const dfm_rigid_def &d) { return d.name && name == d.name; });
}

}  // namespace

void create_rigids(World &w, const char *host, const dfm_rigid_set_def &def, uint64_t *out) {
  if (!def.nbody || !def.bodies) fail(DFM_E_ARG, "a set of rigid bodies needs at least one body");
  if (def.njoint && !def.joints) fail(DFM_E_ARG, "%u joints are announced, but joints is NULL", def.njoint);
  auto owned = std::make_unique<RigidSet>(w, w.memory(), host ? host : "builtin");
  RigidSet &set = *owned;
  std::vector<std::string> names;
  uint64_t number = w.next_id;
  for (uint32_t i = 0; i < def.nbody; ++i) {
    dfm_rigid_def d = def.bodies[i];
    names.push_back(name_of(w, d.name, "rigid", number));
    while (!d.name && is_given(def, names.back())) names.back() = name_of(w, nullptr, "rigid", number);
    check_body(d, {"rigid body", names.back().c_str()});
    store_quat(d.pose.rotation, unit_quat(d.pose.rotation));
    set.defs.push_back(d);
  }
  for (uint32_t i = 0; i < def.nbody; ++i) set.defs[i].name = names[i].c_str();
  const std::vector<dfm_joint_def> joints(def.joints, def.joints + def.njoint);
  set.njoint = def.njoint;
  set.joints = joints;
  set.elsewhere = def.data != nullptr;
  for (uint32_t k = 0; k < set.njoint; ++k) check_joint(joints[k], k, set.defs);
  query_host(set, joints, def.data);

  const size_t n = set.defs.size();
  set.state.resize(n);
  set.next.resize(n);
  set.velocity.assign(6 * n, 0.0);
  set.impulse.assign(6 * n, 0.0);
  set.revised.assign(6 * n, 0.0);
  set.total.assign(3 * n, 0.0);
  set.wrench.assign(6 * n, 0.0);
  w.rigid_sets.reserve(w.rigid_sets.size() + 1);
  std::vector<std::unique_ptr<Obstacle>> parts;
  for (uint32_t i = 0; i < n; ++i) {
    parts.push_back(make_part(w, set.defs[i]));
    if (std::find(names.begin(), names.begin() + i, names[i]) != names.begin() + i)
      fail(DFM_E_ARG, "rigid body '%s': the name is taken in this set; names are unique", names[i].c_str());
  }
  std::vector<uint64_t> handles;
  try {
    for (uint32_t i = 0; i < n; ++i) {
      dfm_rigid_def &d = set.defs[i];
      Obstacle &o = add_obstacle(w, std::move(parts[i]));
      set.obstacle.push_back(o.id);
      handles.push_back(o.handle);
      o.rigid = &set;
      o.rigid_body = i;
      d.name = o.name.c_str();
      dfm_rigid_state &s = set.state[i];
      store_pose(s, load_pose(d.pose));
      std::copy(d.velocity, d.velocity + 3, s.velocity);
      std::copy(d.spin, d.spin + 3, s.spin);
    }
  } catch (...) {
    for (const uint64_t id : set.obstacle) destroy_obstacle(rigid_obstacle(w, id));
    throw;
  }
  std::copy(handles.begin(), handles.end(), out);
  w.rigid_sets.push_back(std::move(owned));
}

}  // namespace dfm
