// The host that comes with the library: free bodies exactly as far as momentum goes, joints and motors as
// rows solved together per articulated group.
//
//   free      v = v0 + h g + p/m, w = mean spin of constant angular momentum (turn.h)
//   joints    impulses x along the joints as they are at the start, such that they are kept at the *end*:
//             c(q0 + h v(x)) = c(q0). That is SHAKE (Ryckaert, Ciccotti, Berendsen 1977), leapfrog on the
//             joints: a body swings on without losing speed. Requiring J v = 0 at the start takes h w^2
//             / 2 of it per second.
//   motors    a motor that can holds its speed: a row more. One that would need more than its limit pushes
//             with the limit
//   respond   M^-1 - M^-1 J^T (J M^-1 J^T)^-1 J M^-1 over a group, J the joints and the motors that hold
//   revise    contact may take a motor to its limit or off it: which ones hold is decided again, and
//             contact solved again
//   commit    the same once more with the contact impulses
//
// State beyond pose and velocity: per joint the motor's speed, its limit and what it did last.
#include <algorithm>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "dynamics/rigid/host.h"
#include "dynamics/rigid/host_table.h"
#include "dynamics/rigid/joints.h"
#include "math/turn.h"

namespace dfm {
namespace {

constexpr double kDrift = 1e-10;  // m and rad: what a joint may be off by at the end of a sub-step
constexpr uint32_t kMaxCorrections = 12;
constexpr uint32_t kMaxSteps = 12;  // toward joints that are kept
constexpr double kMinRate = 1e-11;  // m/s and rad/s: what a joint may move apart at
constexpr double kFar = 0.25;       // rad in a sub-step, of a body without its joints
constexpr size_t kMotor = 3;        // values of extra per joint: speed, limit, effort of the last sub-step

// What a motor does in a sub-step.
enum class Drive : uint8_t { off, holds, pushes, pulls };

struct Group {
  std::vector<uint32_t> parts, joints;
  bool drives = false;  // a motor of it has power
  // In this sub-step: what the joints hold, then one row per motor that holds.
  std::vector<JointRow> rows;
  std::vector<uint32_t> holding;  // those motors' joints
  size_t nhold = 0;
  JointSystem system;
};

class Builtin {
 public:
  explicit Builtin(const dfm_rigid_set_def &set, uint32_t *group);
  size_t extra() const { return kMotor * joints_.size(); }
  void predict(const dfm_rigid_step &step, double *velocity);
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix);
  bool revise(const dfm_rigid_step &step, const double *impulse, double *velocity);
  void commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state, double *extra);
  const RigidJoint *joint(uint32_t i) const {
    return i < joints_.size() && joints_[i].can_drive() ? &joints_[i] : nullptr;
  }

 private:
  std::vector<RigidPart> parts_;
  std::vector<RigidJoint> joints_;
  std::vector<uint32_t> group_;
  std::vector<Group> groups_;
  // In this sub-step.
  std::vector<Drive> drive_;  // [njoint]
  // [n,6] velocities: without joints, with them, with contact too
  std::vector<double> free_, mean_, end_;
  std::vector<double> motor_;                  // [njoint] N s, N m s
  std::vector<Vec3> momentum_, end_momentum_;  // [n] angular, at the start and the end
  // Scratch.
  std::vector<double> x_, best_, target_, column_, base_;
  std::vector<Vec3> base_momentum_;
  std::vector<JointRow> scratch_rows_;
  std::vector<Drive> before_;
  std::vector<dfm_rigid_state> moved_;
  JointSystem scratch_;

  void free_motion(const dfm_rigid_step &step, const Group &g);
  void hold(const dfm_rigid_step &step, const Group &g, std::span<double> velocity);
  void add_impulse(const JointRow &r, double impulse, std::vector<double> &velocity,
                   std::vector<Vec3> &momentum) const;
  void assemble(const dfm_rigid_step &step, Group &g);
  void start_from(const dfm_rigid_step &step, const Group &g, const double *impulse);
  double move_by(const dfm_rigid_step &step, const Group &g, std::span<const double> x);
  bool turns_far(const dfm_rigid_step &step, const Group &g) const;
  void solve(const dfm_rigid_step &step, const Group &g, const double *impulse);
  void decide(const dfm_rigid_step &step, Group &g, const double *impulse);
  void correct(const Group &g, std::span<dfm_rigid_state> state);
  std::span<const dfm_rigid_state> states(const dfm_rigid_step &step) const {
    return {step.state, parts_.size()};
  }
};

Builtin::Builtin(const dfm_rigid_set_def &set, uint32_t *group) {
  const uint32_t n = set.nbody;
  const std::span<const dfm_rigid_def> bodies(set.bodies, n);
  parts_.resize(n);
  moved_.resize(n);
  for (std::vector<double> *v : {&free_, &mean_, &end_, &base_}) v->resize(6 * size_t{n});
  for (std::vector<Vec3> *v : {&momentum_, &end_momentum_, &base_momentum_}) v->resize(n);
  motor_.resize(set.njoint);
  drive_.resize(set.njoint);
  for (uint32_t i = 0; i < n; ++i) {
    RigidPart &p = parts_[i];
    if (bodies[i].fixed) continue;
    p.inverse_mass = 1 / bodies[i].mass;
    p.moments = load3(bodies[i].inertia);
    for (int k = 0; k < 3; ++k) p.inverse_moments[k] = 1 / p.moments[k];
  }
  for (uint32_t i = 0; i < set.njoint; ++i) joints_.push_back(make_joint(set.joints[i], bodies));
  // Bodies that joints tie together, still ones apart: what hangs on a wall on both of its sides is two
  // groups. The lowest number represents a group.
  DisjointSets tied(Memory::standard(), n);
  for (const RigidJoint &j : joints_)
    if (j.b != DFM_RIGID_WORLD && !bodies[j.a].fixed && !bodies[j.b].fixed) tied.join(j.a, j.b);
  group_.assign(n, DFM_RIGID_STILL);
  for (uint32_t i = 0; i < n; ++i) {
    if (bodies[i].fixed) continue;
    const uint32_t r = tied.root(i);
    if (r == i) {
      group_[i] = static_cast<uint32_t>(groups_.size());
      groups_.emplace_back();
    } else {
      group_[i] = group_[r];
    }
    groups_[group_[i]].parts.push_back(i);
  }
  for (uint32_t i = 0; i < joints_.size(); ++i) {
    const uint32_t a = group_[joints_[i].a];
    const uint32_t b = joints_[i].b == DFM_RIGID_WORLD ? DFM_RIGID_STILL : group_[joints_[i].b];
    if (a != DFM_RIGID_STILL) groups_[a].joints.push_back(i);
    else if (b != DFM_RIGID_STILL) groups_[b].joints.push_back(i);
  }
  std::copy(group_.begin(), group_.end(), group);
}

void Builtin::free_motion(const dfm_rigid_step &step, const Group &g) {
  for (const uint32_t i : g.parts) {
    const dfm_rigid_state &s = step.state[i];
    const Quat q = load_quat(s.rotation);
    momentum_[i] = in_axes(q, parts_[i].moments, load3(s.spin));
    store3(&free_[6 * size_t{i}], load3(s.velocity) + step.h * load3(step.gravity));
    store3(&free_[6 * size_t{i} + 3], free_spin(q, parts_[i].inverse_moments, momentum_[i], step.h));
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

// Rows and their system for the motors that hold now.
void Builtin::assemble(const dfm_rigid_step &step, Group &g) {
  g.rows.resize(g.nhold);
  g.holding.clear();
  for (const uint32_t j : g.joints)
    if (drive_[j] == Drive::holds) {
      g.holding.push_back(j);
      g.rows.push_back(drive_row(joints_[j], states(step)));
    }
  g.system.build(g.rows, parts_, states(step));
}

// base_: velocities with everything but what the rows do.
void Builtin::start_from(const dfm_rigid_step &step, const Group &g, const double *impulse) {
  for (const uint32_t i : g.parts) {
    const Vec3 p = impulse ? load3(impulse + 6 * size_t{i}) : Vec3{};
    const Vec3 turn = impulse ? load3(impulse + 6 * size_t{i} + 3) : Vec3{};
    store3(&base_[6 * size_t{i}], load3(&free_[6 * size_t{i}]) + parts_[i].inverse_mass * p);
    base_momentum_[i] = momentum_[i] + turn;
  }
  for (const uint32_t j : g.joints) {
    motor_[j] = 0;
    if (drive_[j] != Drive::pushes && drive_[j] != Drive::pulls) continue;
    motor_[j] = (drive_[j] == Drive::pushes ? step.h : -step.h) * step.extra[kMotor * j + 1];
    add_impulse(drive_row(joints_[j], states(step)), motor_[j], base_, base_momentum_);
  }
  for (const uint32_t i : g.parts)
    store3(&base_[6 * size_t{i} + 3], free_spin(load_quat(step.state[i].rotation), parts_[i].inverse_moments,
                                                base_momentum_[i], step.h));
}

// Adds the impulse of a row to both of its parts, as far as they move.
void Builtin::add_impulse(const JointRow &r, double impulse, std::vector<double> &velocity,
                          std::vector<Vec3> &momentum) const {
  const auto add = [&](uint32_t part, Vec3 l, Vec3 a) {
    if (part == DFM_RIGID_WORLD || group_[part] == DFM_RIGID_STILL) return;
    add3(&velocity[6 * size_t{part}], (parts_[part].inverse_mass * impulse) * l);
    momentum[part] += impulse * a;
  };
  add(r.a, r.la, r.aa);
  add(r.b, r.lb, r.ab);
}

// end_ and end_momentum_ with the rows' impulses x. target_: by how much more their rates must change.
// Returns the worst of that, m/s or rad/s.
double Builtin::move_by(const dfm_rigid_step &step, const Group &g, std::span<const double> x) {
  for (const uint32_t i : g.parts) {
    std::copy_n(&base_[6 * size_t{i}], 6, &end_[6 * size_t{i}]);
    end_momentum_[i] = base_momentum_[i];
  }
  for (size_t k = 0; k < g.rows.size(); ++k) add_impulse(g.rows[k], x[k], end_, end_momentum_);
  for (const uint32_t i : g.parts) {
    const Quat q = load_quat(step.state[i].rotation);
    const Vec3 w = free_spin(q, parts_[i].inverse_moments, end_momentum_[i], step.h);
    store3(&end_[6 * size_t{i} + 3], w);
    dfm_rigid_state &to = moved_[i];
    store3(to.position, load3(step.state[i].position) + step.h * load3(&end_[6 * size_t{i}]));
    store_quat(to.rotation, turned(q, step.h * w));
  }
  scratch_rows_.clear();
  for (const uint32_t j : g.joints) hold_rows(joints_[j], moved_, scratch_rows_);
  double worst = 0;
  target_.resize(g.rows.size());
  for (size_t k = 0; k < g.rows.size(); ++k) {
    target_[k] = k < g.nhold ? (g.rows[k].error - scratch_rows_[k].error) / step.h
                             : step.extra[kMotor * g.holding[k - g.nhold]] - row_rate(g.rows[k], end_);
    worst = std::max(worst, std::fabs(target_[k]));
  }
  return worst;
}

// Whether the impulses without those of its joints would turn a body of the group far.
bool Builtin::turns_far(const dfm_rigid_step &step, const Group &g) const {
  return std::any_of(g.parts.begin(), g.parts.end(), [&](uint32_t i) {
    return step.h * step.h * norm2(load3(&base_[6 * size_t{i} + 3])) > kFar * kFar;
  });
}

// Newton steps with the system of the start: each leaves about h w of the error. Where a joint cannot be kept
// along its impulses (turned by a radian and more in one sub-step) the best step is kept, and correct()
// does the rest.
void Builtin::solve(const dfm_rigid_step &step, const Group &g, const double *impulse) {
  start_from(step, g, impulse);
  if (turns_far(step, g)) {
    // Newton starts from momenta that satisfy the joints to first order: the turn that a body would make
    // without its joints is not linear in them, and ends on joints that are a whole turn off.
    for (const uint32_t i : g.parts)
      store3(&base_[6 * size_t{i} + 3],
             in_axes(load_quat(step.state[i].rotation), parts_[i].inverse_moments, base_momentum_[i]));
  }
  best_.resize(g.rows.size());
  for (size_t k = 0; k < g.rows.size(); ++k)
    best_[k] = (k < g.nhold ? 0 : step.extra[kMotor * g.holding[k - g.nhold]]) - row_rate(g.rows[k], base_);
  g.system.solve(best_);
  double worst = move_by(step, g, best_);
  for (uint32_t n = 0; n < kMaxSteps && worst > kMinRate; ++n) {
    x_ = target_;
    g.system.solve(x_);
    for (size_t k = 0; k < x_.size(); ++k) x_[k] += best_[k];
    const double now = move_by(step, g, x_);
    if (!(now < 0.5 * worst)) {
      if (!(now < worst)) move_by(step, g, best_);
      else best_ = x_;
      break;
    }
    worst = now;
    best_ = x_;
  }
  for (size_t k = 0; k < g.holding.size(); ++k) motor_[g.holding[k]] = best_[g.nhold + k];
}

// Which motors hold under these contact impulses: all that have power, without those that would need more
// than their limit.
void Builtin::decide(const dfm_rigid_step &step, Group &g, const double *impulse) {
  before_ = drive_;
  for (const uint32_t j : g.joints)
    drive_[j] = joints_[j].can_drive() && step.extra[kMotor * j + 1] > 0 ? Drive::holds : Drive::off;
  for (;;) {
    if (std::any_of(g.joints.begin(), g.joints.end(), [&](uint32_t j) { return drive_[j] != before_[j]; }))
      assemble(step, g);
    solve(step, g, impulse);
    bool limited = false;
    before_ = drive_;
    for (const uint32_t j : g.holding) {
      if (!(std::fabs(motor_[j]) > step.h * step.extra[kMotor * j + 1])) continue;
      drive_[j] = motor_[j] > 0 ? Drive::pushes : Drive::pulls;
      limited = true;
    }
    if (!limited) return;
  }
}

// A motor that was at its limit is taken to be there still; revise() and commit() see to it that it is.
void Builtin::predict(const dfm_rigid_step &step, double *velocity) {
  std::fill(free_.begin(), free_.end(), 0.0);
  std::fill(end_.begin(), end_.end(), 0.0);
  std::fill(base_.begin(), base_.end(), 0.0);
  std::copy(step.state, step.state + parts_.size(), moved_.begin());
  for (Group &g : groups_) free_motion(step, g);
  mean_ = free_;
  for (Group &g : groups_) {
    if (g.joints.empty()) continue;
    g.rows.clear();
    g.drives = false;
    for (const uint32_t j : g.joints) {
      hold_rows(joints_[j], states(step), g.rows);
      const double most = step.extra[kMotor * j + 1], effort = step.extra[kMotor * j + 2];
      drive_[j] = !(joints_[j].can_drive() && most > 0)   ? Drive::off
                  : std::fabs(effort) < most * (1 - 1e-9) ? Drive::holds
                  : effort > 0                            ? Drive::pushes
                                                          : Drive::pulls;
      g.drives = g.drives || drive_[j] != Drive::off;
    }
    g.nhold = g.rows.size();
    assemble(step, g);
    solve(step, g, nullptr);
    for (const uint32_t i : g.parts) std::copy_n(&end_[6 * size_t{i}], 6, &mean_[6 * size_t{i}]);
  }
  std::copy(mean_.begin(), mean_.end(), velocity);
}

bool Builtin::revise(const dfm_rigid_step &step, const double *impulse, double *velocity) {
  bool changed = false;
  for (Group &g : groups_) {
    if (!g.drives) continue;
    const std::vector<Drive> assumed = drive_;
    decide(step, g, impulse);
    if (assumed == drive_) continue;
    changed = true;
    solve(step, g, nullptr);
    for (const uint32_t i : g.parts) std::copy_n(&end_[6 * size_t{i}], 6, &mean_[6 * size_t{i}]);
  }
  std::copy(mean_.begin(), mean_.end(), velocity);
  return changed;
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
    else store3(own + 3, in_axes(load_quat(step.state[part].rotation), parts_[part].inverse_moments, e));
    hold(step, g, v);
    for (size_t r = 0; r < width; ++r) matrix[r * width + c] = v[6 * size_t{g.parts[r / 6]} + r % 6];
  }
  for (size_t r = 0; r < width; ++r)  // symmetric to the last bit
    for (size_t c = 0; c < r; ++c)
      matrix[r * width + c] = matrix[c * width + r] = 0.5 * (matrix[r * width + c] + matrix[c * width + r]);
}

// Positions back onto the joints: Newton steps on their errors, shared by mass.
void Builtin::correct(const Group &g, std::span<dfm_rigid_state> state) {
  std::vector<double> &shift = column_;
  shift.resize(6 * parts_.size());
  for (uint32_t k = 0; k < kMaxCorrections; ++k) {
    scratch_rows_.clear();
    for (const uint32_t j : g.joints) hold_rows(joints_[j], state, scratch_rows_);
    double worst = 0;
    x_.resize(scratch_rows_.size());
    for (size_t i = 0; i < x_.size(); ++i) {
      x_[i] = -scratch_rows_[i].error;
      worst = std::max(worst, std::fabs(x_[i]));
    }
    if (!(worst > kDrift)) return;
    scratch_.build(scratch_rows_, parts_, state);
    scratch_.solve(x_);
    for (const uint32_t i : g.parts) std::fill_n(&shift[6 * size_t{i}], 6, 0.0);
    JointSystem::push(scratch_rows_, x_, parts_, state, shift);
    for (const uint32_t i : g.parts) {
      dfm_rigid_state &s = state[i];
      add3(s.position, load3(&shift[6 * size_t{i}]));
      store_quat(s.rotation, turned(load_quat(s.rotation), load3(&shift[6 * size_t{i} + 3])));
    }
  }
}

// From the start of the sub-step, so that it may be called again with other impulses.
void Builtin::commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state,
                     double *extra) {
  std::copy(step.state, step.state + parts_.size(), state);
  for (Group &g : groups_) {
    if (g.joints.empty()) {
      start_from(step, g, impulse);
      move_by(step, g, {});
    } else if (g.drives) decide(step, g, impulse);
    else solve(step, g, impulse);
    for (const uint32_t i : g.parts) {
      dfm_rigid_state &s = state[i];
      s = moved_[i];
      store3(s.velocity, load3(&end_[6 * size_t{i}]));
      store3(s.spin, in_axes(load_quat(s.rotation), parts_[i].inverse_moments, end_momentum_[i]));
    }
    if (!g.joints.empty()) correct(g, {state, parts_.size()});
  }
  std::copy(step.extra, step.extra + this->extra(), extra);
  for (size_t j = 0; j < joints_.size(); ++j) extra[kMotor * j + 2] = motor_[j] / step.h;
}

// ---- the table --------------------------------------------------------------------------------------------

using Table = HostTable<Builtin>;

dfm_status create(void *, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  return shielded([&] {
    auto *const b = new Builtin(*set, group);
    *self = b;
    *nextra = static_cast<uint32_t>(b->extra());
  });
}
dfm_status revise(void *self, const dfm_rigid_step *step, const double *impulse, double *velocity,
                  uint32_t *changed) {
  return shielded([&] { *changed = Table::of(self).revise(*step, impulse, velocity); });
}
dfm_status set_motor(void *self, uint32_t joint, double velocity, double max, double *extra) {
  if (!Table::of(self).joint(joint)) return DFM_E_ARG;
  extra[kMotor * joint] = velocity;
  extra[kMotor * joint + 1] = max;
  return DFM_OK;
}
dfm_status joint(void *self, const dfm_rigid_state *state, const double *extra, uint32_t number,
                 double *position, double *rate, double *effort) {
  const RigidJoint *const j = Table::of(self).joint(number);
  if (!j) return DFM_E_ARG;
  const size_t last = std::max(j->a, j->b == DFM_RIGID_WORLD ? 0 : j->b);
  return shielded([&] {
    const JointRow row = drive_row(*j, {state, last + 1});
    std::vector<double> velocity(6 * (last + 1));
    for (size_t i = 0; i <= last; ++i) {
      store3(&velocity[6 * i], load3(state[i].velocity));
      store3(&velocity[6 * i + 3], load3(state[i].spin));
    }
    *position = row.error;
    *rate = row_rate(row, velocity);
    *effort = extra[kMotor * number + 2];
  });
}

}  // namespace

const dfm_rigid_host &builtin_host() {
  static const dfm_rigid_host table = [] {
    dfm_rigid_host t = Table::make(create);
    t.set_motor = set_motor;
    t.joint = joint;
    t.revise = revise;
    return t;
  }();
  return table;
}

}  // namespace dfm
