// Obstacles, rigid bodies and cuts to come as a scene says them.
#include <algorithm>

#include "dynamics/rigid/rigid_set.h"
#include "scene/keys.h"
#include "scene/write.h"
#include "state/obstacle.h"
#include "state/tool.h"

namespace dfm::writing {
namespace {

template <class Def>
void write_size(const Def &d, Written &out) {
  out["shape"] = scene::word_of("shape", d.shape);
  if (d.shape == DFM_SHAPE_BOX) out["half_size"] = vector_of(d.half_size);
  if (d.shape == DFM_SHAPE_SPHERE || d.shape == DFM_SHAPE_CAPSULE) out["radius"] = d.radius;
  if (d.shape == DFM_SHAPE_CAPSULE) out["half_length"] = d.half_length;
}

void write_motion(const Obstacle &o, Written &out) {
  Written motion;
  for (const dfm_pose_key &k : o.keys) motion["keyframes"].push_back(key_of(k));
  if (moves(o.def.sine)) motion["sine"] = sine_of(o.def.sine, false);
  out["motion"] = std::move(motion);
}

}  // namespace

Written write_obstacle(SceneWriter &to, const Obstacle &o) {
  to.check_name("obstacle", o.name);
  Written out;
  out["name"] = o.name;
  out["id"] = o.id;
  write_size(o.def, out);
  if (!o.points.empty()) out["mesh"] = to.triangles(o.name, o);
  if (!o.points.empty() && o.def.shape == DFM_SHAPE_VOXELS && o.def.cells) out["cells"] = o.def.cells;
  put(out, "pose", pose_of(o.def.pose));
  if (o.moves()) {
    write_motion(o, out);
  } else if (const Pose made = to_pose(o.def.pose); !same_bits(&made, &o.pose, sizeof made)) {
    dfm_pose now{};
    store_pose(now, o.pose);
    out["start"] = {{"position", vector_of(now.position)}, {"rotation", rotation_of(now.rotation)}};
  }
  if (o.has_target) to.note(o, ": the pose that it is to reach in the next step is left out");
  const double *const belt = o.def.velocity_surface;
  if (belt[0] != 0 || belt[1] != 0 || belt[2] != 0) out["velocity_surface"] = vector_of(belt);
  to.put_material(out, o);
  if (o.sensor) out["sensor"] = true;
  return out;
}

// ---- rigid bodies -----------------------------------------------------------------------------------------

namespace {

// The one added shape of a body without a shape of its own that a scene could say instead; null: none.
const Obstacle *only_shape(const World &w, const RigidSet &set, uint32_t body) {
  const Obstacle *found = nullptr;
  const Pose none;
  for (const auto &o : w.obstacles) {
    if (o->rigid != &set || o->rigid_body != body || !o->added) continue;
    const bool simple = o->def.shape == DFM_SHAPE_SPHERE || o->def.shape == DFM_SHAPE_BOX ||
                        o->def.shape == DFM_SHAPE_CAPSULE;
    if (found || !simple || !same_bits(&o->local, &none, sizeof none)) return nullptr;
    found = o.get();
  }
  return found;
}

bool has_added(const World &w, const RigidSet &set, uint32_t body) {
  return std::any_of(w.obstacles.begin(), w.obstacles.end(),
                     [&](const auto &o) { return o->rigid == &set && o->rigid_body == body && o->added; });
}

bool is_of_tool(const World &w, const Obstacle &o) {
  return std::any_of(w.tools.begin(), w.tools.end(), [&](const auto &t) { return t->has_shape(o); });
}

void write_rigid_start(const RigidSet &set, uint32_t i, Written &out) {
  const dfm_rigid_def &d = set.defs[i];
  const dfm_rigid_state &s = set.state[i];
  if (d.fixed ||
      (same_bits(d.pose.position, s.position, sizeof s.position) &&
       same_bits(d.pose.rotation, s.rotation, sizeof s.rotation) &&
       same_bits(d.velocity, s.velocity, sizeof s.velocity) && same_bits(d.spin, s.spin, sizeof s.spin)))
    return;
  out["start"] = {{"position", vector_of(s.position)},
                  {"rotation", rotation_of(s.rotation)},
                  {"velocity", vector_of(s.velocity)},
                  {"spin", vector_of(s.spin)}};
}

Written joint_of(const RigidSet &set, size_t number) {
  const dfm_joint_def &j = set.joints[number];
  const RigidMotor &motor = set.motors[number];
  Written out;
  out["type"] = scene::word_of("joint_type", j.type);
  if (j.with != DFM_RIGID_WORLD) out["with"] = set.defs[j.with].name;
  out["anchor"] = vector_of(j.anchor);
  if (j.type == DFM_JOINT_HINGE || j.type == DFM_JOINT_SLIDER) out["axis"] = vector_of(j.axis);
  if (motor.max > 0) out["motor"] = {{"velocity", motor.velocity}, {"max", motor.max}};
  return out;
}

Written rigid_body_of(SceneWriter &to, const RigidSet &set, uint32_t i) {
  const dfm_rigid_def &d = set.defs[i];
  const Obstacle &o = *to.w.obstacle(set.obstacle[i]);
  to.check_name("rigid body", o.name);
  const Obstacle *const other = d.shape == DFM_SHAPE_NONE ? only_shape(to.w, set, i) : nullptr;
  if (d.shape == DFM_SHAPE_NONE && !other) {
    to.note(
        "rigid body '%s' is left out: in a scene it is one sphere, box or capsule about its center of mass",
        o.name.c_str());
    return nullptr;
  }
  if (!other && has_added(to.w, set, i))
    to.note("rigid body '%s': the shapes that were added to it are left out; in a scene it has one",
            o.name.c_str());
  Written out;
  out["name"] = o.name;
  out["id"] = o.id;
  if (other) write_size(other->def, out);
  else write_size(d, out);
  if (d.fixed) out["fixed"] = true;
  else out["mass"] = d.mass;
  if (!d.fixed) out["inertia"] = vector_of(d.inertia);
  put(out, "pose", pose_of(d.pose));
  if (!d.fixed) {
    out["velocity"] = vector_of(d.velocity);
    out["spin"] = vector_of(d.spin);
  }
  write_rigid_start(set, i, out);
  to.put_material(out, other ? *other : o);
  if (o.sensor) out["sensor"] = true;
  return out;
}

// Bodies of the same host, of which a scene has one set.
std::string host_of(SceneWriter &to, const std::vector<const RigidSet *> &sets) {
  size_t bodies = 0;
  for (const RigidSet *set : sets)
    if (set->elsewhere) bodies += set->defs.size();
  const std::string &name = sets[0]->host_name;
  const bool one =
      std::all_of(sets.begin(), sets.end(), [&](const RigidSet *set) { return set->host_name == name; });
  if (bodies > 0) {
    to.note(
        "%zu rigid bodies live in a world of the host '%s', of which a scene has no more than their "
        "shapes, masses and motion: they are written for the host builtin, without the contacts and joints "
        "that they have among each other",
        bodies, name.c_str());
    return "builtin";
  }
  if (!one)
    to.note(
        "the rigid bodies belong to several hosts, and in a scene to one: they are written for the host "
        "builtin");
  else if (sets.size() > 1)
    to.note("the rigid bodies were made as %zu sets and are one in a scene; they move alike to rounding",
            sets.size());
  return one ? name : "builtin";
}

}  // namespace

const Obstacle *shape_in_scene(const World &w, const Obstacle &o) {
  if (o.added) return is_of_tool(w, o) ? &o : nullptr;
  const bool other = o.rigid && !o.rigid->of_tool && o.def.shape == DFM_SHAPE_NONE;
  return other ? only_shape(w, *o.rigid, o.rigid_body) : &o;
}

Written write_rigid(SceneWriter &to) {
  std::vector<const RigidSet *> sets;
  for (const auto &set : to.w.rigid_sets)
    if (!set->of_tool) sets.push_back(set.get());
  if (sets.empty()) return nullptr;
  Written out;
  out["host"] = host_of(to, sets);
  Written &bodies = out["bodies"] = Written::array();
  for (const RigidSet *set : sets) {
    std::vector<Written> rows;
    for (uint32_t i = 0; i < set->defs.size(); ++i) rows.push_back(rigid_body_of(to, *set, i));
    for (size_t k = 0; k < set->njoint; ++k) {
      const dfm_joint_def &j = set->joints[k];
      Written &body = rows[j.body];
      const bool gone = j.with != DFM_RIGID_WORLD && rows[j.with].is_null();
      if (!body.is_null() && !gone) body["joints"].push_back(joint_of(*set, k));
    }
    for (Written &row : rows)
      if (!row.is_null()) bodies.push_back(std::move(row));
  }
  // those behind the first have ids that follow its own; ids of several sets would not
  for (size_t i = sets.size() > 1 ? 0 : 1; i < bodies.size(); ++i) bodies[i].erase("id");
  return out;
}

// ---- cuts to come -----------------------------------------------------------------------------------------

void write_cuts(SceneWriter &to, const Body &b, Written &out) {
  for (const PlannedCut &c : b.planned_cuts) {
    const CutShape &s = c.shape;
    static const char *const words[] = {"ellipsoid", "box", "blade", "plane"};
    Written entry;
    entry["body"] = b.name;
    entry["t"] = std::max(c.t, to.w.time);
    entry["shape"] = words[size_t(s.kind)];
    switch (s.kind) {
      case CutKind::plane:
        entry["point"] = vector_of(s.corner[0]);
        entry["normal"] = vector_of(s.corner[1]);
        break;
      case CutKind::blade:
        for (const Vec3 &x : s.corner) entry["corners"].push_back(vector_of(x));
        break;
      case CutKind::ellipsoid:
      case CutKind::box:
        entry["half_size"] = vector_of(s.half_size);
        put(entry, "pose", pose_of(Pose{s.position, s.rotation}));
    }
    if (s.kind != CutKind::plane && s.kind != CutKind::blade && norm2(s.way) > 0)
      to.note(b, ": the shape of its cut at %g s has a motion; in the scene it stands where that begins",
              c.t);
    entry["mode"] = scene::word_of("cut_mode", c.how);
    if (c.most > 0) entry["most"] = c.most;
    out.push_back(std::move(entry));
  }
}

}  // namespace dfm::writing
