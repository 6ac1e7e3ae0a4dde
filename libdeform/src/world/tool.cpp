#include "world/tool.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/handle.h"
#include "geometry/ellipsoid.h"
#include "plugin/context.h"
#include "state/bounds.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/rigid/rigid.h"
#include "step/solve/cut_drag.h"
#include "step/stages.h"
#include "world/attach.h"
#include "world/create.h"
#include "world/find.h"
#include "world/queries.h"

namespace dfm {
namespace {

constexpr double kWidest = 3;         // rad, of an opening
constexpr double kLatest = 0.1;       // s, of a device
constexpr uint32_t kRefinements = 2;  // of an ellipsoid: 320 triangles

void check_opening(double angle, const Tool &t) {
  if (!(angle >= 0 && angle <= kWidest)) refuse(t, ": an opening of %g rad; give 0 to %g", angle, kWidest);
}

void check_coupling(const dfm_tool_def &d, const Tool &t) {
  const double values[] = {d.stiffness, d.damping, d.turn_stiffness, d.turn_damping, d.mass, d.inertia};
  for (const double x : values)
    if (!(x >= 0 && std::isfinite(x)))
      refuse(t,
             ": stiffness, damping, turn_stiffness, turn_damping, mass and inertia must be finite and not "
             "negative, found %g",
             x);
  if (!(d.late >= 0 && d.late <= kLatest))
    refuse(t, ": a device that is %g s late; give 0 to %g s", d.late, kLatest);
  if (!(d.stiffness > 0)) {
    if (d.late > 0) refuse(t, ": late applies to coupled tools only; give a stiffness, or leave it 0");
    if (d.flags & DFM_TOOL_PASSIVE) refuse(t, ": DFM_TOOL_PASSIVE is for a coupled tool; give a stiffness");
    if (d.damping > 0 || d.turn_stiffness > 0 || d.turn_damping > 0)
      refuse(t,
             " has parameters of a coupling, but its stiffness is 0, which means no coupling; give a "
             "stiffness, or leave damping, turn_stiffness and turn_damping 0");
    return;
  }
  if (!(d.turn_stiffness > 0))
    refuse(t, " is coupled with %g N/m but has no turn_stiffness; give one in N m/rad", d.stiffness);
  if (!(d.mass > 0 && d.inertia > 0))
    refuse(t, " is coupled, so it needs a mass and an inertia above 0; found %g kg, %g kg m2", d.mass,
           d.inertia);
}

void check_sizes(const dfm_tool_def &d, const Tool &t) {
  const bool boxes =
      has_jaws(d) || d.shape == DFM_TOOL_BOX || d.shape == DFM_TOOL_BLADE || d.shape == DFM_TOOL_ELLIPSOID;
  for (const double s : d.half_size)
    if (boxes && !(s > 0 && std::isfinite(s)))
      refuse(t, ": half_size %g m; all three must be positive and finite", s);
  if ((d.shape == DFM_TOOL_SPHERE || d.shape == DFM_TOOL_CAPSULE) &&
      !(d.radius > 0 && std::isfinite(d.radius)))
    refuse(t, ": radius %g m; it must be positive and finite", d.radius);
  if (!(d.radius >= 0 && std::isfinite(d.radius)) || !(d.half_length >= 0 && std::isfinite(d.half_length)))
    refuse(t, ": radius %g m and half_length %g m must be finite and not negative", d.radius, d.half_length);
}

void check_def(const dfm_tool_def &d, const Tool &t) {
  if (d.shape > DFM_TOOL_BLADE)
    refuse(t,
           ": shape %u is unknown; use DFM_TOOL_SPHERE, CAPSULE, BOX, MESH, GRASPER, SCISSORS, ELLIPSOID or "
           "BLADE",
           d.shape);
  if (!all_finite(d.pose.position, 3) || !all_finite(d.pose.rotation, 4))
    refuse(t, ": its pose must be finite");
  check_sizes(d, t);
  check_coupling(d, t);
  check_opening(d.opening, t);
  if (!has_jaws(d) && (d.opening != 0 || d.nopening))
    refuse(t, " has no jaws to open; only a grasper and scissors have");
  if ((d.nkey && !d.keys) || (d.nopening && !d.opening_keys))
    refuse(t, ": keys are announced, but they are NULL");
}

// Its frame first, then the jaws; the frame has the shape of the tool if a rigid body can have it.
std::vector<dfm_rigid_def> parts_of(const dfm_tool_def &d, const std::string &name, ToolMotion &motion,
                                    std::vector<std::string> &names) {
  dfm_rigid_def frame = dfm_rigid_def{};
  frame.size = sizeof frame;
  frame.shape = d.shape == DFM_TOOL_SPHERE                             ? DFM_SHAPE_SPHERE
                : d.shape == DFM_TOOL_CAPSULE                          ? DFM_SHAPE_CAPSULE
                : d.shape == DFM_TOOL_BOX || d.shape == DFM_TOOL_BLADE ? DFM_SHAPE_BOX
                                                                       : DFM_SHAPE_NONE;
  copy_shape(frame, d);
  // without effect: only its host moves it
  frame.mass = 1;
  std::fill(frame.inertia, frame.inertia + 3, 1.0);
  motion.parts.push_back({{}, 0});
  names.push_back(name);
  std::vector<dfm_rigid_def> out{frame};
  const Vec3 half = load3(d.half_size);
  for (const double side : {1.0, -1.0}) {
    if (!has_jaws(d)) break;
    const Vec3 beside = d.shape == DFM_TOOL_GRASPER ? Vec3{side * half.x, 0, 0} : Vec3{0, side * half.y, 0};
    motion.parts.push_back({{beside - Vec3{0, 0, half.z}, {}}, -0.5 * side});
    names.push_back(name + (side > 0 ? ".left" : ".right"));
    out.push_back(frame);
    out.back().shape = DFM_SHAPE_BOX;
  }
  const Pose at = to_pose(d.pose);
  for (size_t i = 0; i < out.size(); ++i) {
    store_pose(out[i].pose, part_place(motion.parts[i], at, d.opening));
    out[i].name = names[i].c_str();
  }
  return out;
}

// Shapes that the rigid body itself cannot have: a shaft, the triangles of a mesh or an ellipsoid.
std::vector<std::unique_ptr<Obstacle>> make_shapes(World &w, const dfm_tool_def &d, const std::string &name) {
  std::vector<std::unique_ptr<Obstacle>> out;
  dfm_obstacle_def shape{};
  shape.size = sizeof shape;
  copy_shape(shape, d);
  if (has_jaws(d) && d.radius > 0) {
    const std::string shaft = name + ".shaft";
    shape.name = shaft.c_str();
    shape.shape = DFM_SHAPE_CAPSULE;
    shape.pose.position[2] = d.half_length;
    out.push_back(make_rigid_shape(w, name, shape));
  }
  if (d.shape != DFM_TOOL_MESH && d.shape != DFM_TOOL_ELLIPSOID) return out;
  const std::string skin = name + ".shape";
  shape.name = skin.c_str();
  shape.shape = DFM_SHAPE_MESH;
  shape.npoint = d.npoint;
  shape.ntriangle = d.ntriangle;
  shape.points = d.points;
  shape.triangles = d.triangles;
  EllipsoidMesh ball;
  if (d.shape == DFM_TOOL_ELLIPSOID) {
    ball = ellipsoid_mesh(load3(d.half_size), kRefinements);
    shape.npoint = static_cast<uint32_t>(ball.points.size() / 3);
    shape.ntriangle = static_cast<uint32_t>(ball.triangles.size() / 3);
    shape.points = ball.points.data();
    shape.triangles = ball.triangles.data();
  }
  out.push_back(make_rigid_shape(w, name, shape));
  return out;
}

void start_at(Tool &t, const Pose &place) {
  ToolValues v = t.values();
  store_place(v.device, place);
  store_place(v.target, place);
  std::fill(v.target_velocity, v.target_velocity + 6, 0.0);
  v.measured = 0;
  t.store(v);
}

Tool &checked(Tool &t, const dfm_pose &pose) {
  if (!all_finite(pose.position, 3) || !all_finite(pose.rotation, 4))
    refuse(t, ": the given pose is not finite");
  check_place(*t.world, t, largest_coordinate(pose.position, 1, 3));
  return t;
}

}  // namespace

Tool &create_tool(World &w, const dfm_tool_def &def) {
  auto owned = std::make_unique<Tool>();
  Tool &t = *owned;
  t.world = &w;
  t.name = name_of(w, def.name, "tool");
  check_def(def, t);
  t.def = def;
  if (def.nkey) t.keys.assign(def.keys, def.keys + def.nkey);
  if (def.nopening) t.opening_keys.assign(def.opening_keys, def.opening_keys + def.nopening);
  check_keys(t.keys, t.name.c_str());
  check_keys(t.opening_keys, t.name.c_str());
  for (const dfm_scale_key &k : t.opening_keys) check_opening(k.value, t);
  if (!t.keys.empty()) store_pose(t.def.pose, pose_at(t.keys, w.time));
  if (!t.opening_keys.empty()) t.def.opening = scale_at(t.opening_keys, w.time);
  t.motion.stiffness = def.stiffness;
  t.motion.damping = def.damping;
  t.motion.turn_stiffness = def.turn_stiffness;
  t.motion.turn_damping = def.turn_damping;
  t.motion.mass = def.mass;
  t.motion.inertia = def.inertia;
  t.motion.late = def.late;
  std::vector<std::string> names;
  const std::vector<dfm_rigid_def> parts = parts_of(t.def, t.name, t.motion, names);
  const dfm_rigid_set_def set = {sizeof set, static_cast<uint32_t>(parts.size()), 0, 0, parts.data(), nullptr,
                                 &t.motion};
  t.parts.resize(parts.size());
  w.tools.reserve(w.tools.size() + 1);
  std::vector<std::unique_ptr<Obstacle>> shapes = make_shapes(w, t.def, t.name);
  create_rigids(w, kToolHost, set, t.parts.data());
  t.set = w.rigid_sets.back().get();
  t.set->of_tool = true;
  try {
    for (std::unique_ptr<Obstacle> &shape : shapes)
      join_rigid_shape(rigid_obstacle(w, t.set->obstacle[0]), std::move(shape));
    t.handle = handle_create(Kind::tool, &t);
  } catch (...) {
    destroy_rigids(*t.set);
    throw;
  }
  start_at(t, to_pose(t.def.pose));
  ToolValues v = t.values();
  v.opening = v.target_opening = t.def.opening;
  v.keyed = t.keys.empty() ? 0 : 1;
  v.opening_keyed = t.opening_keys.empty() ? 0 : 1;
  t.store(v);
  t.def.name = t.name.c_str();
  t.def.points = nullptr;
  t.def.triangles = nullptr;
  t.def.keys = nullptr;
  t.def.opening_keys = nullptr;
  t.def.npoint = t.def.ntriangle = t.def.nkey = t.def.nopening = 0;
  w.tools.push_back(std::move(owned));
  return t;
}

void destroy_tool(Tool &t) {
  World &w = *t.world;
  t.cuts.bodies.clear();
  forget_dues(w, t);
  destroy_rigids(*t.set);
  handle_destroy(t.handle);
  std::erase_if(w.tools, [&](auto &p) { return p.get() == &t; });
}

void check_target(Tool &t, const dfm_pose &pose, const double *velocity) {
  checked(t, pose);
  if (velocity && !all_finite(velocity, 6)) refuse(t, ": the given velocity is not finite");
}

void set_tool_pose(Tool &t, const dfm_pose &pose, const double *velocity) {
  check_target(t, pose, velocity);
  ToolValues v = t.values();
  store_place(v.target, to_pose(pose));
  v.keyed = 0;
  v.measured = velocity ? kToolMeasuredNext : 0;
  if (velocity) std::copy(velocity, velocity + 6, v.target_velocity);
  t.store(v);
}

void set_tool_opening(Tool &t, double angle) {
  if (!t.has_jaws()) refuse(t, " has no jaws to open");
  check_opening(angle, t);
  ToolValues v = t.values();
  v.target_opening = angle;
  v.opening_keyed = 0;
  t.store(v);
}

namespace {

void need_keys(const Tool &t) {
  if (t.keys.empty() && t.opening_keys.empty()) refuse(t, " has no keys; give it some when it is made");
}

}  // namespace

void follow_keys(Tool &t) {
  need_keys(t);
  if (t.device.read)
    refuse(t, " is moved by a device; remove the device first (dfm_tool_set_device with NULL)");
  ToolValues v = t.values();
  v.keyed = t.keys.empty() ? 0 : 1;
  v.opening_keyed = t.opening_keys.empty() ? 0 : 1;
  if (v.keyed != 0) v.measured = 0;
  t.store(v);
}

void keys_at(const Tool &t, double time, dfm_pose &pose, double &opening) {
  need_keys(t);
  if (!std::isfinite(time)) refuse(t, ": the time at which its keys are asked for is not finite");
  const ToolValues v = t.values();
  store_pose(pose, t.keys.empty() ? load_place(v.target) : pose_at(t.keys, time));
  opening = t.opening_keys.empty() ? v.target_opening : scale_at(t.opening_keys, time);
}

void teleport_tool(Tool &t, const dfm_pose &pose) {
  checked(t, pose);
  World &w = *t.world;
  const Pose place = to_pose(pose);
  start_at(t, place);
  t.cuts.waits = false;
  ToolValues v = t.values();
  v.keyed = 0;
  t.store(v);
  for (size_t i = 0; i < t.motion.parts.size(); ++i) {
    dfm_rigid_state s{};
    store_pose(s, part_place(t.motion.parts[i], place, v.opening));
    set_rigid_state(rigid_obstacle(w, t.set->obstacle[i]), s);
  }
  for (auto &o : w.obstacles)
    if (o->rigid == t.set) w.overlaps.place(o->id);
  wake_all(w);  // it may have been placed where a body sleeps
}

dfm_tool_state tool_state(const Tool &t) {
  const ToolValues v = t.values();
  const dfm_rigid_state &s = t.set->state[0];
  dfm_tool_state out{};
  out.size = sizeof out;
  out.nkeys = v.keyed != 0;
  store_pose(out.pose, load_pose(s));
  std::copy(s.velocity, s.velocity + 3, out.velocity);
  std::copy(s.spin, s.spin + 3, out.spin);
  out.device = out.pose;
  if (t.motion.coupled()) store_pose(out.device, load_place(v.device));
  out.opening = v.opening;
  out.time = v.time;
  out.work = v.work;
  out.port_work = v.port_work;
  return out;
}

void tool_force(const Tool &t, double force[3], double torque[3]) {
  const ToolValues v = t.values();
  const Pose now = load_pose(t.set->state[0]);
  const double per = v.time > 0 ? 1 / v.time : 0;
  const Vec3 p = per * load3(v.contact);
  const Vec3 moment = per * load3(v.contact + 3) - cross(now.position - load3(v.about), p);
  store3(force, rotate_back(now.rotation, p));
  store3(torque, rotate_back(now.rotation, moment));
}

// The device gets the opposite of the coupling's effect on the tool, at its own origin: spring and damper of
// the translation and of the rotation are two separate couplings without lever arm.
void tool_feedback(const Tool &t, double force[3], double torque[3]) {
  const ToolValues v = t.values();
  const Quat frame = t.motion.coupled() ? load_place(v.device).rotation : load_pose(t.set->state[0]).rotation;
  store3(force, rotate_back(frame, load3(v.given)));
  store3(torque, rotate_back(frame, load3(v.given + 3)));
}

// Assigns each surfel to the nearest part, so that none is held twice.
std::vector<uint32_t> grab(Tool &t, Body &b, double reach, double release, uint32_t capacity) {
  World &w = *t.world;
  if (b.world != &w) refuse(t, DFM_E_HANDLE, " and the body that it should grab belong to different worlds");
  if (!(reach >= 0 && std::isfinite(reach))) refuse(t, ": a reach of %g m; give 0 or more", reach);
  prepare(w);  // for d_c
  const double limit = reach > 0 ? reach : 2 * w.offset;
  std::vector<std::vector<uint32_t>> held(t.parts.size());
  for (uint32_t i = 0; i < b.surface.nsurfel; ++i) {
    const Vec3 x = b.surface.sum(i, b.p.x.data());
    double nearest = HUGE_VAL;
    uint32_t part = kNone;
    for (auto &o : w.obstacles) {
      if (o->rigid != t.set || Shape(o->def.shape) == Shape::none) continue;
      const double d = distance_from(*o, x, limit);
      if (d < limit && d < nearest) {
        nearest = d;
        part = o->rigid_body;
      }
    }
    if (part != kNone) held[part].push_back(i);
  }
  const auto holding =
      size_t(std::count_if(held.begin(), held.end(), [](auto &list) { return !list.empty(); }));
  if (holding > capacity)
    refuse(t, " would hold '%s' with %d parts, and there is room for %u attachments", b.name.c_str(),
           int(holding), capacity);
  std::vector<uint32_t> out;
  for (size_t part = 0; part < held.size(); ++part) {
    if (held[part].empty()) continue;
    dfm_attach_def d{};
    d.size = sizeof d;
    d.nsurfel = static_cast<uint32_t>(held[part].size());
    d.surfels = held[part].data();
    d.release = release;
    d.flags = DFM_ATTACH_TOUCH;  // surfels that are not held must not enter the jaws
    out.push_back(attach(b, d, nullptr, &rigid_obstacle(w, t.set->obstacle[part])));
  }
  return out;
}

void set_device(Tool &t, const dfm_device *device) {
  if (device && !device->read) refuse(t, ": the device has no read(); it is needed, write() may be NULL");
  t.device = device ? *device : dfm_device{};
  t.mute = false;
  if (!device) return;
  ToolValues v = t.values();  // it stands until the device moves it
  store_place(v.target, t.motion.coupled() ? load_place(v.device) : load_pose(t.set->state[0]));
  v.keyed = v.measured = 0;
  t.store(v);
}

void read_devices(World &w, double end) {
  std::vector<dfm_device_sample> samples;
  std::vector<bool> fresh;
  for (auto &t : w.tools) {
    if (!t->device.read) continue;
    dfm_device_sample s{};
    s.size = sizeof s;
    const uint64_t said = sentences();
    const dfm_status status = t->device.read(t->device.user, end, &s);
    if (status < 0)
      fail(status, "the device of tool '%s' refuses the step: %s", t->name.c_str(),
           sentences() != said ? last_error() : "it gives no reason");
    fresh.push_back(status == DFM_OK);
    if (status == DFM_OK) {
      checked(*t, s.pose);
      if ((s.flags & DFM_DEVICE_VELOCITY) && !all_finite(s.velocity, 6))
        fail(DFM_E_ARG, "the device of tool '%s' gives a velocity that is not finite", t->name.c_str());
      if (s.flags & DFM_DEVICE_OPENING) check_opening(s.opening, *t);
    }
    samples.push_back(s);
  }
  size_t k = 0;
  for (auto &t : w.tools) {
    if (!t->device.read) continue;
    const dfm_device_sample &s = samples[k];
    if (fresh[k++]) {
      set_tool_pose(*t, s.pose, s.flags & DFM_DEVICE_VELOCITY ? s.velocity : nullptr);
      if ((s.flags & DFM_DEVICE_OPENING) && t->has_jaws()) set_tool_opening(*t, s.opening);
    }
  }
}

void write_devices(World &w) {
  for (auto &t : w.tools) {
    if (!t->device.write || t->mute) continue;
    const ToolValues v = t->values();
    if (t->device.write(t->device.user, w.time, v.given, v.given + 3) >= 0) continue;
    t->mute = true;
    w.context->warn("the device of tool '%s' no longer takes forces", t->name.c_str());
  }
}

}  // namespace dfm
