// The host that comes with the library: free bodies exactly as far as momentum goes, joints as rows solved together per articulated group.
//
//   predict   v = v0 + h g, w = mean spin of constant angular momentum (turn.h); then joints and motors: v += M^-1 J^T x, J v = 0 (motor: its speed,
//             |x| <= h max)
//   respond   M^-1 - M^-1 J^T (J M^-1 J^T)^-1 J M^-1 over a group: joints carry contact, motors do not
//   commit    the same map on the contact impulses; positions by the mean velocity; then positions are put back on the joints
//
// State beyond pose and velocity: per joint the motor's speed, its limit and what it did last.
#include <algorithm>

#include "core/error.h"
#include "rigid/host.h"
#include "rigid/joints.h"
#include "rigid/turn.h"

namespace dfm {
namespace {

constexpr double kDrift = 1e-10;       // m and rad: what a joint may be off by at the end of a sub-step
constexpr uint32_t kMostCorrections = 12;
constexpr size_t kMotor = 3;           // values of extra per joint: speed, limit, effort of the last sub-step

Quat rotation_of(const dfm_rigid_state &s) { return {s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]}; }

struct Group {
  std::vector<uint32_t> parts, joints;
  std::vector<JointRow> rows;          // of this sub-step
  JointSystem system;
};

class Builtin {
 public:
  explicit Builtin(const dfm_rigid_set_def &set, uint32_t *group);
  size_t extra() const { return kMotor * joints_.size(); }
  void predict(const dfm_rigid_step &step, double *velocity);
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix);
  void commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state, double *extra);
  const RigidJoint *joint(uint32_t i) const { return i < joints_.size() && joints_[i].can_drive() ? &joints_[i] : nullptr; }

 private:
  std::vector<RigidPart> parts_;
  std::vector<RigidJoint> joints_;
  std::vector<uint32_t> group_;
  std::vector<Group> groups_;
  // Of this sub-step.
  std::vector<double> free_, mean_, end_;                // [n,6] velocities: without joints, with them, with contact too
  std::vector<double> x_, motor_, column_;                // one per row; [njoint] N s, N m s; [n,6] scratch
  std::vector<Vec3> momentum_;                    // angular, at the start
  std::vector<JointRow> scratch_rows_;             // scratch
  std::vector<uint32_t> active_;
  JointSystem scratch_;

  void free_motion(const dfm_rigid_step &step, const Group &g);
  void hold(const dfm_rigid_step &step, const Group &g, std::span<double> velocity);
  void drive(const dfm_rigid_step &step, const Group &g);
  void correct(const Group &g, std::span<dfm_rigid_state> state);
  std::span<const dfm_rigid_state> states(const dfm_rigid_step &step) const { return {step.state, parts_.size()}; }
};

Builtin::Builtin(const dfm_rigid_set_def &set, uint32_t *group) {
  const uint32_t n = set.nbody;
  const std::span<const dfm_rigid_def> bodies(set.bodies, n);
  parts_.resize(n), momentum_.resize(n), free_.resize(6 * size_t{n}), mean_.resize(6 * size_t{n}), motor_.resize(set.njoint);
  for (uint32_t i = 0; i < n; ++i) {
    RigidPart &p = parts_[i];
    if (bodies[i].fixed) continue;
    p.inverse_mass = 1 / bodies[i].mass;
    p.moments = load3(bodies[i].inertia);
    for (int k = 0; k < 3; ++k) p.inverse_moments[k] = 1 / p.moments[k];
  }
  for (uint32_t i = 0; i < set.njoint; ++i) joints_.push_back(make_joint(set.joints[i], bodies));
  // Bodies that joints tie together, still ones apart: what hangs on a wall on both of its sides is two groups. The lowest number stands for a group.
  std::vector<uint32_t> root(n);
  for (uint32_t i = 0; i < n; ++i) root[i] = i;
  auto find = [&](uint32_t i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (const RigidJoint &j : joints_)
    if (j.b != DFM_RIGID_WORLD && !bodies[j.a].fixed && !bodies[j.b].fixed) {
      const uint32_t a = find(j.a), b = find(j.b);
      root[std::max(a, b)] = std::min(a, b);
    }
  group_.assign(n, DFM_RIGID_STILL);
  for (uint32_t i = 0; i < n; ++i) {
    if (bodies[i].fixed) continue;
    const uint32_t r = find(i);
    if (r == i) group_[i] = static_cast<uint32_t>(groups_.size()), groups_.emplace_back();
    else group_[i] = group_[r];
    groups_[group_[i]].parts.push_back(i);
  }
  for (uint32_t i = 0; i < joints_.size(); ++i) {
    const uint32_t a = group_[joints_[i].a], b = joints_[i].b == DFM_RIGID_WORLD ? DFM_RIGID_STILL : group_[joints_[i].b];
    if (a != DFM_RIGID_STILL) groups_[a].joints.push_back(i);
    else if (b != DFM_RIGID_STILL) groups_[b].joints.push_back(i);
  }
  std::copy(group_.begin(), group_.end(), group);
}

void Builtin::free_motion(const dfm_rigid_step &step, const Group &g) {
  for (const uint32_t i : g.parts) {
    const dfm_rigid_state &s = step.state[i];
    const Quat q = rotation_of(s);
    momentum_[i] = in_axes(q, parts_[i].moments, load3(s.spin));
    store3(&free_[6 * size_t{i}], load3(s.velocity) + step.h * load3(step.gravity));
    store3(&free_[6 * size_t{i} + 3], mean_spin(q, parts_[i].inverse_moments, momentum_[i], step.h));
  }
}

// Takes out of a velocity what the joints do not allow.
void Builtin::hold(const dfm_rigid_step &step, const Group &g, std::span<double> velocity) {
  if (g.rows.empty()) return;
  x_.resize(g.rows.size());
  for (size_t k = 0; k < g.rows.size(); ++k) x_[k] = -row_rate(g.rows[k], velocity);
  g.system.solve(x_);
  JointSystem::push(g.rows, x_, parts_, states(step), velocity);
}

// Motors that would need more than their limit give the limit; the others reach their speed.
void Builtin::drive(const dfm_rigid_step &step, const Group &g) {
  active_.clear();
  for (const uint32_t j : g.joints) {
    motor_[j] = 0;
    if (joints_[j].can_drive() && step.extra[kMotor * j + 1] > 0) active_.push_back(j);
  }
  while (!active_.empty()) {
    scratch_rows_ = g.rows;
    for (const uint32_t j : active_) scratch_rows_.push_back(drive_row(joints_[j], states(step)));
    scratch_.build(scratch_rows_, parts_, states(step));
    x_.resize(scratch_rows_.size());
    for (size_t k = 0; k < scratch_rows_.size(); ++k)
      x_[k] = (k < g.rows.size() ? 0 : step.extra[kMotor * active_[k - g.rows.size()]]) - row_rate(scratch_rows_[k], mean_);
    scratch_.solve(x_);
    bool clamped = false;
    for (size_t k = active_.size(); k-- > 0;) {
      const uint32_t j = active_[k];
      const size_t at = g.rows.size() + k;
      const double most = step.h * step.extra[kMotor * j + 1];
      if (!(std::fabs(x_[at]) > most)) continue;
      motor_[j] = x_[at] > 0 ? most : -most;
      JointSystem::push({&scratch_rows_[at], 1}, {&motor_[j], 1}, parts_, states(step), mean_);
      active_.erase(active_.begin() + std::ptrdiff_t(k)), clamped = true;
    }
    if (clamped) continue;
    for (size_t k = 0; k < active_.size(); ++k) motor_[active_[k]] = x_[g.rows.size() + k];
    JointSystem::push(scratch_rows_, x_, parts_, states(step), mean_);
    return;
  }
}

void Builtin::predict(const dfm_rigid_step &step, double *velocity) {
  std::fill(free_.begin(), free_.end(), 0.0);
  for (Group &g : groups_) free_motion(step, g);
  mean_ = free_;
  for (Group &g : groups_) {
    if (g.joints.empty()) continue;
    g.rows.clear();
    for (const uint32_t j : g.joints) hold_rows(joints_[j], states(step), g.rows);
    g.system.build(g.rows, parts_, states(step));
    drive(step, g);
    hold(step, g, mean_);
  }
  std::copy(mean_.begin(), mean_.end(), velocity);
}

void Builtin::respond(const dfm_rigid_step &step, uint32_t group, double *matrix) {
  const Group &g = groups_[group];
  const size_t width = 6 * g.parts.size();
  std::vector<double> &v = column_;
  v.resize(6 * parts_.size());
  for (size_t c = 0; c < width; ++c) {
    for (const uint32_t i : g.parts) std::fill_n(&v[6 * size_t{i}], 6, 0.0);
    const uint32_t part = g.parts[c / 6];
    const int k = int(c % 3);
    Vec3 e;
    e[k] = 1;
    double *const own = &v[6 * size_t{part}];
    if (c % 6 < 3) store3(own, parts_[part].inverse_mass * e);
    else store3(own + 3, in_axes(rotation_of(step.state[part]), parts_[part].inverse_moments, e));
    hold(step, g, v);
    for (size_t r = 0; r < width; ++r) matrix[r * width + c] = v[6 * size_t{g.parts[r / 6]} + r % 6];
  }
  for (size_t r = 0; r < width; ++r)      // symmetric to the last bit
    for (size_t c = 0; c < r; ++c) matrix[r * width + c] = matrix[c * width + r] = 0.5 * (matrix[r * width + c] + matrix[c * width + r]);
}

// Positions back onto the joints: Newton steps on their errors, shared by mass.
void Builtin::correct(const Group &g, std::span<dfm_rigid_state> state) {
  std::vector<double> &shift = column_;
  shift.resize(6 * parts_.size());
  for (uint32_t k = 0; k < kMostCorrections; ++k) {
    scratch_rows_.clear();
    for (const uint32_t j : g.joints) hold_rows(joints_[j], state, scratch_rows_);
    double worst = 0;
    x_.resize(scratch_rows_.size());
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = -scratch_rows_[i].error, worst = std::max(worst, std::fabs(x_[i]));
    if (!(worst > kDrift)) return;
    scratch_.build(scratch_rows_, parts_, state);
    scratch_.solve(x_);
    for (const uint32_t i : g.parts) std::fill_n(&shift[6 * size_t{i}], 6, 0.0);
    JointSystem::push(scratch_rows_, x_, parts_, state, shift);
    for (const uint32_t i : g.parts) {
      dfm_rigid_state &s = state[i];
      store3(s.position, load3(s.position) + load3(&shift[6 * size_t{i}]));
      const Quat q = turned(rotation_of(s), load3(&shift[6 * size_t{i} + 3]));
      s.rotation[0] = q.x, s.rotation[1] = q.y, s.rotation[2] = q.z, s.rotation[3] = q.w;
    }
  }
}

// From the prediction alone, so that it may be asked again with other impulses.
void Builtin::commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state, double *extra) {
  std::copy(step.state, step.state + parts_.size(), state);
  end_ = mean_;
  for (const Group &g : groups_) {
    for (const uint32_t i : g.parts) {
      double *const v = &end_[6 * size_t{i}];
      const double *const p = impulse + 6 * size_t{i};
      store3(v, load3(v) + parts_[i].inverse_mass * load3(p));
      store3(v + 3, load3(v + 3) + in_axes(rotation_of(step.state[i]), parts_[i].inverse_moments, load3(p + 3)));
    }
    if (!g.joints.empty()) hold(step, g, end_);
    for (const uint32_t i : g.parts) {
      dfm_rigid_state &s = state[i];
      const Quat q = rotation_of(step.state[i]);
      const Vec3 v = load3(&end_[6 * size_t{i}]);
      Vec3 w = load3(&end_[6 * size_t{i} + 3]), L = momentum_[i];
      if (g.joints.empty()) {
        L += load3(impulse + 6 * size_t{i} + 3);
        w = mean_spin(q, parts_[i].inverse_moments, L, step.h);
      } else {
        L += in_axes(q, parts_[i].moments, w - load3(&free_[6 * size_t{i} + 3]));
      }
      const Quat end = turned(q, step.h * w);
      store3(s.position, load3(s.position) + step.h * v), store3(s.velocity, v);
      s.rotation[0] = end.x, s.rotation[1] = end.y, s.rotation[2] = end.z, s.rotation[3] = end.w;
      store3(s.spin, in_axes(end, parts_[i].inverse_moments, L));
    }
    if (!g.joints.empty()) correct(g, {state, parts_.size()});
  }
  std::copy(step.extra, step.extra + this->extra(), extra);
  for (size_t j = 0; j < joints_.size(); ++j) extra[kMotor * j + 2] = motor_[j] / step.h;
}

// ---- the table --------------------------------------------------------------------------------------------------

template <class F>
dfm_status shielded(F &&f) noexcept {
  try {
    f();
    return DFM_OK;
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (...) {
    return DFM_E_FATAL;
  }
}

Builtin &self_of(void *self) { return *static_cast<Builtin *>(self); }

dfm_status create(void *, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  return shielded([&] {
    auto *const b = new Builtin(*set, group);
    *self = b, *nextra = static_cast<uint32_t>(b->extra());
  });
}
void destroy(void *self) { delete static_cast<Builtin *>(self); }
dfm_status predict(void *self, const dfm_rigid_step *step, double *velocity) {
  return shielded([&] { self_of(self).predict(*step, velocity); });
}
dfm_status respond(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix) {
  return shielded([&] { self_of(self).respond(*step, group, matrix); });
}
dfm_status commit(void *self, const dfm_rigid_step *step, const double *impulse, dfm_rigid_state *state, double *extra) {
  return shielded([&] { self_of(self).commit(*step, impulse, state, extra); });
}
dfm_status set_motor(void *self, uint32_t joint, double velocity, double max, double *extra) {
  if (!self_of(self).joint(joint)) return DFM_E_ARG;
  extra[kMotor * joint] = velocity, extra[kMotor * joint + 1] = max;
  return DFM_OK;
}
dfm_status joint(void *self, const dfm_rigid_state *state, const double *extra, uint32_t number, double *position, double *rate, double *effort) {
  const RigidJoint *const j = self_of(self).joint(number);
  if (!j) return DFM_E_ARG;
  const size_t last = std::max(j->a, j->b == DFM_RIGID_WORLD ? 0 : j->b);
  return shielded([&] {
    const JointRow row = drive_row(*j, {state, last + 1});
    std::vector<double> velocity(6 * (last + 1));
    for (size_t i = 0; i <= last; ++i) store3(&velocity[6 * i], load3(state[i].velocity)), store3(&velocity[6 * i + 3], load3(state[i].spin));
    *position = row.error, *rate = row_rate(row, velocity), *effort = extra[kMotor * number + 2];
  });
}

}  // namespace

const dfm_rigid_host &builtin_host() {
  static const dfm_rigid_host table = {sizeof(dfm_rigid_host), 0, nullptr, create, destroy, predict, respond, commit, set_motor, joint, nullptr};
  return table;
}

}  // namespace dfm
