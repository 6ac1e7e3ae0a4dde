// Contact of bodies that joints connect. Their group answers impulses with a dense matrix that contains the
// joints and the motors that hold (dynamics/rigid/builtin.cpp), so contact never violates joints.
//
//   near     the matrix is computed for groups that something is near, because it costs more than a free body
//   motors   decided again in each pass, by the impulses of soft bodies and of the rows
#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "contact/solve_settings.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr double kHeld = 1e-9;       // of the answer without joints: less is rounding, joints allow no motion
constexpr double kMaxStrong = 1e-6;  // of the answer without joints: no place gives less
constexpr double kDriven = 0.01;     // sine: a motor moves a place along a direction

bool is_moved(const RigidSet &set, uint32_t body) { return set.group[body] != DFM_RIGID_STILL; }

bool is_simple(const ObstacleView &v) {
  return v.shape == Shape::sphere || v.shape == Shape::capsule || v.shape == Shape::box;
}

// Whether a joint to the world has its anchor in this obstacle, as both were created: a door in its post. The
// anchor of a slider may be anywhere.
bool hangs_on(const World &w, const Obstacle &body, const Obstacle &obstacle) {
  ObstacleView v = w.steps->obstacle_views[obstacle.slot];
  if (!is_simple(v)) return false;
  const Pose start = obstacle.pose_at_time(0);
  v.position = start.position;
  v.rotation = start.rotation;
  const ToolShape shape(v, nullptr);
  return std::any_of(body.rigid->joints.begin(), body.rigid->joints.end(), [&](const dfm_joint_def &j) {
    ObstaclePoint o;
    return j.body == body.rigid_body && j.with == DFM_RIGID_WORLD && j.type != DFM_JOINT_SLIDER &&
           shape.closest(load3(j.anchor), HUGE_VAL, o) && o.distance < w.offset;
  });
}

}  // namespace

// Bodies of one set that are no contact partners: those that a joint connects, and those that their joints
// let overlap as created, such as the ends of a chain of short thick links.
bool ToolTouch::belong_together(const World &w, const Obstacle &a, const Obstacle &b) {
  if (a.rigid && !b.rigid) return hangs_on(w, a, b);
  if (b.rigid && !a.rigid) return hangs_on(w, b, a);
  if (!a.rigid || a.rigid != b.rigid || a.rigid->of_tool) return false;
  const RigidSet &set = *a.rigid;
  const auto names = [&](const dfm_joint_def &j, uint32_t body) { return j.body == body || j.with == body; };
  const auto is_joined = [&](uint32_t body) {
    return std::any_of(set.joints.begin(), set.joints.end(), [&](const auto &j) { return names(j, body); });
  };
  const uint32_t i = a.rigid_body, k = b.rigid_body;
  if (std::any_of(set.joints.begin(), set.joints.end(),
                  [&](const auto &j) { return names(j, i) && names(j, k); }))
    return true;
  const bool one_group = set.group[i] == set.group[k] && is_moved(set, i);
  const bool at_still = is_moved(set, i) ? is_joined(i) && !is_moved(set, k) : is_joined(k);
  if (!one_group && !at_still) return false;
  const auto created = [&](const Obstacle &o) {
    ObstacleView v = w.steps->obstacle_views[o.slot];
    const Pose body = to_pose(set.defs[o.rigid_body].pose), own = o.added ? body * o.local : body;
    v.position = own.position;
    v.rotation = own.rotation;
    return v;
  };
  const ObstacleView va = created(a), vb = created(b);
  if (!is_simple(va) || !is_simple(vb)) return false;
  ToolShape shape_a(va, nullptr), shape_b(vb, nullptr);
  return depth(shape_a, shape_b, true) > 0;
}

// Which of its groups have joints, and whether motors.
void ToolTouch::list_joints(Moved &m) {
  const RigidSet &set = *m.set;
  m.jointed.assign(set.ngroup, 0);
  for (const RigidMotor &motor : set.motors) m.drives = m.drives || motor.max > 0;
  for (const dfm_joint_def &j : set.joints) {
    for (const uint32_t body : {j.body, j.with})
      if (body != DFM_RIGID_WORLD && is_moved(set, body)) m.jointed[set.group[body]] = 1;
  }
}

void ToolTouch::request_response(Moved &m, uint32_t g) {
  RigidSet &set = *m.set;
  const size_t at = m.first[g] != kNone ? m.first[g] : m.response.size();
  if (m.first[g] == kNone) m.response.resize(at + m.wide[g] * m.wide[g], 0.0);
  m.first[g] = kNone;
  const HostFault fault = set.respond(g, static_cast<uint32_t>(m.wide[g] / 6), &m.response[at]);
  need_memory(fault.status);
  if (fault) return;
  m.first[g] = at;
}

// Takes the response of the group of this side, if it has joints and its response has not been needed yet.
void ToolTouch::take_response(const Side &side) {
  Moved &m = sides_[side.tool];
  if (!m.set) return;
  const uint32_t g = m.set->group[side.part];
  if (g != DFM_RIGID_STILL && m.jointed[g] && m.first[g] == kNone) request_response(m, g);
}

// 1/kg, how the place would yield without joints; 0: a tool, or it does not.
double ToolTouch::response_without_joints(const Side &side, Vec3 along) const {
  const Moved &m = sides_[side.tool];
  if (!m.set || m.set->of_tool || !is_moved(*m.set, side.part)) return 0;
  const dfm_rigid_def &d = m.set->defs[side.part];
  const Vec3 turn = cross(side.arm, along), inverse{1 / d.inertia[0], 1 / d.inertia[1], 1 / d.inertia[2]};
  return 1 / d.mass + dot(turn, in_axes(load_quat(m.set->state[side.part].rotation), inverse, turn));
}

bool ToolTouch::jointed(const Side &side) const {
  const Moved &m = sides_[side.tool];
  return m.set && is_moved(*m.set, side.part) && m.jointed[m.set->group[side.part]];
}

// 1/kg, below which an answer along this direction is rounding; 0: no side has joints.
double ToolTouch::rounding_of(const Row &row, Vec3 along) const {
  if (!jointed(row.a) && !jointed(row.b)) return 0;
  return kHeld * (response_without_joints(row.a, along) + response_without_joints(row.b, along));
}

// A place that does not yield because a motor holds has a row nevertheless. It gives at first as a free body
// would, then less and less (press_harder), until its impulse takes the motor to its limit. 1/kg, so much; 0:
// no motor holds.
double ToolTouch::softness_of_motor(const Row &row) const {
  const bool holds = is_driven(row.a, row.normal) || is_driven(row.b, row.normal);
  return holds ? strong_ / kHeld * rounding_of(row, row.normal) : 0;
}

// Whether a motor of its group moves the place along this direction. If none does, joints hold it as well,
// such as a door that lies in a post beside its hinge, and no impulse takes a motor to its limit.
bool ToolTouch::is_driven(const Side &side, Vec3 along) const {
  if (!jointed(side) || !sides_[side.tool].drives) return false;
  const RigidSet &set = *sides_[side.tool].set;
  const Vec3 at = center(side) + side.arm;
  return std::any_of(set.joints.begin(), set.joints.end(), [&](const dfm_joint_def &j) {
    const uint32_t body = is_moved(set, j.body) || j.with == DFM_RIGID_WORLD ? j.body : j.with;
    if (!(set.motors[size_t(&j - set.joints.data())].max > 0) || set.group[body] != set.group[side.part])
      return false;
    const dfm_pose &was = set.defs[body].pose;
    const dfm_rigid_state &s = set.state[body];
    const Quat turn = load_quat(s.rotation) * conjugate(unit_quat(was.rotation));
    const Vec3 axis = rotate(turn, normalized(load3(j.axis)));
    if (j.type == DFM_JOINT_SLIDER) return std::fabs(dot(axis, along)) > kDriven;
    const Vec3 arm = at - load3(s.position) - rotate(turn, load3(j.anchor) - load3(was.position));
    return std::fabs(dot(axis, cross(arm, along))) > kDriven * norm(arm);
  });
}

void ToolTouch::request_again(Moved &m) {
  for (uint32_t g = 0; g < m.set->ngroup; ++g)
    if (m.jointed[g] && m.first[g] != kNone) request_response(m, g);
}

void ToolTouch::renew(const RigidSet &set) {
  Moved *const m = known(set);
  if (!m) return;
  m->free.assign(set.velocity.begin(), set.velocity.end());
  request_again(*m);
  begin_passes();
}

// Where motors hold against rows: their places give less.
bool ToolTouch::press_harder() {
  if (strong_ < kMaxStrong ||
      std::none_of(
          rows_.begin(), rows_.end(),
          [](const Row &row) { return !row.pair->jaw && row.soft > 0 && row.impulse > 0; }))
    return false;
  strong_ /= SolveSettings::penalty;
  begin_passes();
  return true;
}

}  // namespace dfm
