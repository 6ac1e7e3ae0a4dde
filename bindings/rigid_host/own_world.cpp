#include "own_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace dfm_rigid_detail {
namespace {

// The pose in `state`; for the world that of the origin.
Pose pose_of(uint32_t number, const dfm_rigid_state *state) {
  if (number == DFM_RIGID_WORLD) return {};
  return {load(state[number].position), rotation_of(state[number])};
}
Motion motion_of(uint32_t number, const dfm_rigid_state *state) {
  if (number == DFM_RIGID_WORLD) return {};
  return {load(state[number].velocity), load(state[number].spin)};
}

// Largest values that an engine gets: a double still resolves a contact (1e-7 m at the bound), and squares
// are far from overflow.
constexpr double kReach = 1e9, kFast = 1e9;  // m; m/s and rad/s

// Overlaps are pushed apart at a speed of share * depth / h. A constant share would throw bodies where the
// guard divides a step into short sub-steps; so below kFullShare the speed is that at kFullShare.
constexpr double kShare = 0.2, kFullShare = 1e-3;  // both engines' default; s

}  // namespace

void OwnWorld::check(const dfm_rigid_state &s, uint32_t number, const char *when) const {
  const Quat q = rotation_of(s);
  const double turn = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  const auto within = [](const double *x, double most) {
    return std::fabs(x[0]) <= most && std::fabs(x[1]) <= most && std::fabs(x[2]) <= most;
  };
  if (within(s.position, kReach) && within(s.velocity, kFast) && within(s.spin, kFast) && turn > 0.5 &&
      turn < 2)
    return;
  throw Refused{failed(
      DFM_E_DIVERGED,
      "host \"%s\": rigid body %u (counted from 0) is %s at (%g, %g, %g) m with (%g, %g, %g) m/s and (%g, "
      "%g, %g) rad/s; %s is given bodies within %g m, %g m/s and %g rad/s, turned by unit quaternions",
      host_, number, when, s.position[0], s.position[1], s.position[2], s.velocity[0], s.velocity[1],
      s.velocity[2], s.spin[0], s.spin[1], s.spin[2], host_, kReach, kFast, kFast)};
}

void OwnWorld::build(const dfm_rigid_set_def &set, uint32_t *group) {
  members_.resize(set.nbody);
  given_.resize(set.nbody);
  for (uint32_t i = 0; i < set.nbody; ++i) {
    const dfm_rigid_def &def = *dfm_rigid_set_body(&set, i);
    given_[i] =
        state_of(load(def.pose.position), load_quat(def.pose.rotation), load(def.velocity), load(def.spin));
    check(given_[i], i, "made");
    members_[i] = make_body(def, i);
    group[i] = members_[i] ? static_cast<uint32_t>(moving_.size()) : DFM_RIGID_STILL;
    if (!members_[i]) continue;
    moving_.push_back(i);
    members_[i]->engine = &engine_;
    members_[i]->put(given_[i]);
    engine_.members.push_back(members_[i]);
  }
  joints_.reserve(set.njoint);
  for (uint32_t k = 0; k < set.njoint; ++k) add_joint(*dfm_rigid_set_joint(&set, k));
}

void OwnWorld::add_joint(const dfm_joint_def &def) {
  Joint &joint = joints_.emplace_back();
  const bool with_moves = def.with != DFM_RIGID_WORLD && members_[def.with];
  joint.type = def.type;
  joint.body = def.body;
  joint.with = def.with;
  joint.swapped = !members_[def.body];
  joint.made = members_[def.body] || with_moves;
  const double length = norm(load(def.axis));
  joint.anchor = load(def.anchor);
  joint.axis = length > 0 ? (1 / length) * load(def.axis) : Vec{0, 0, 1};
  const Pose body = pose_of(def.body, given_.data()), with = pose_of(def.with, given_.data());
  joint.anchor_body = rotate(conjugate(body.rotation), joint.anchor - body.position);
  joint.axis_body = rotate(conjugate(body.rotation), joint.axis);
  joint.anchor_with = rotate(conjugate(with.rotation), joint.anchor - with.position);
  joint.axis_with = rotate(conjugate(with.rotation), joint.axis);
  joint.turn = conjugate(with.rotation) * body.rotation;
  if (joint.made) make_joint(joint, joints_.size() - 1);
}

// The motor's effort: what the joint did along its axis, in which it is free without a motor, in the sub-step
// that began at `state`. For a hinge, the moment about its anchor, about which its holding force has none.
double OwnWorld::effort(size_t number, const dfm_rigid_state *state) const {
  const Joint &j = joints_[number];
  if (!j.made) return 0;
  const Quat q = pose_of(j.first(), state).rotation;
  const Vec axis = rotate(q, j.axis_first()), arm = rotate(q, j.anchor_first());
  const Wrench w = wrench(number);
  return j.sign() * dot(axis, j.type == DFM_JOINT_HINGE ? w.moment - cross(arm, w.force) : w.force);
}

dfm_status OwnWorld::predict(const dfm_rigid_step &step, double *velocity) {
  for (const uint32_t i : moving_) check(step.state[i], i, "now");
  for (int k = 0; k < 3; ++k)
    if (!(std::fabs(step.gravity[k] * step.h) <= kFast))
      throw Refused{
          failed(DFM_E_DIVERGED,
                 "host \"%s\": gravity of %g m/s2 changes speeds by more than %g m/s in a sub-step of %g s",
                 host_, step.gravity[k], kFast, step.h)};
  call([&] { predict_all(step, velocity); });
  return DFM_OK;
}

void OwnWorld::predict_all(const dfm_rigid_step &step, double *velocity) {
  set_gravity(step.gravity);
  set_correction(kShare * std::min(1.0, step.h / kFullShare));
  for (size_t k = 0; k < joints_.size(); ++k) {
    const Joint &j = joints_[k];
    const double *const motor = step.extra + first_joint() + kMotor * k;
    if (j.made && j.type <= DFM_JOINT_SLIDER) drive(k, j.sign() * motor[0], motor[1], step.h);
  }
  // also after a try that has ended before its commit, with what the engine made of corrections
  bool put = std::exchange(predicted_, true) || !remembers(step.extra + first_memory());
  for (const uint32_t i : moving_) put |= !same(given_[i], step.state[i]);
  if (put) engine_.reopen();
  if (!engine_.is_open())
    for (const uint32_t i : moving_) {
      members_[i]->put(step.state[i]);
      given_[i] = step.state[i];
    }
  if (put) recall(step.extra + first_memory());
  for (const uint32_t i : moving_) engine_.predict(*members_[i], step, i, velocity + 6 * size_t{i});
}

void OwnWorld::respond(const dfm_rigid_step &, uint32_t group, double *matrix) {
  engine_.respond(*members_[moving_[group]], matrix);
}

void OwnWorld::push(const dfm_rigid_step &, const double *impulse) {
  for (const uint32_t i : moving_) engine_.push(*members_[i], impulse + 6 * size_t{i});
}

bool OwnWorld::commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) {
  bool again = false;
  std::memcpy(extra, step.extra, sizeof(double) * first_memory());
  std::memcpy(state, step.state, sizeof(dfm_rigid_state) * members_.size());
  call([&] {
    for (const uint32_t i : moving_) again |= engine_.commit(*members_[i], i, state, extra, step.h);
  });
  for (const uint32_t i : moving_) check(state[i], i, "after the step");
  for (size_t k = 0; k < joints_.size(); ++k) extra[first_joint() + kMotor * k + 2] = effort(k, step.state);
  remember(extra + first_memory(), !again);
  predicted_ = false;
  // Asked for another round, the engine goes back by itself; the world then gives the same start
  // state as before.
  if (again) return true;
  // The states of the dfm_world: an engine that has turned a body by itself differs by a rounding, and its
  // next collisions would differ from those after a restore.
  for (const uint32_t i : moving_) {
    given_[i] = state[i];
    members_[i]->put(state[i]);
  }
  return false;
}

dfm_status OwnWorld::set_motor(uint32_t joint, double velocity, double max, double *extra) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  double *const motor = extra + first_joint() + kMotor * joint;
  motor[0] = velocity;
  motor[1] = max;
  return DFM_OK;
}

// From the state of the world: after a restore the engine's joint still has the former one.
dfm_status OwnWorld::joint(const dfm_rigid_state *state, const double *extra, uint32_t joint,
                           double *position, double *rate, double *effort) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  const Joint &j = joints_[joint];
  const Pose a = pose_of(j.body, state), b = pose_of(j.with, state);
  const Motion of_a = motion_of(j.body, state), of_b = motion_of(j.with, state);
  const Vec axis = rotate(b.rotation, j.axis_with);
  if (j.type == DFM_JOINT_HINGE) {
    *position = dot(turn_of(a.rotation * conjugate(b.rotation * j.turn)), axis);
    *rate = dot(of_a.w - of_b.w, axis);
  } else {
    const Vec arm = rotate(a.rotation, j.anchor_body), place = a.position + arm;
    *position = dot(place - b.position - rotate(b.rotation, j.anchor_with), axis);
    *rate = dot(of_a.v + cross(of_a.w, arm) - of_b.v - cross(of_b.w, place - b.position), axis);
  }
  *effort = extra[first_joint() + kMotor * joint + 2];
  return DFM_OK;
}

}  // namespace dfm_rigid_detail
