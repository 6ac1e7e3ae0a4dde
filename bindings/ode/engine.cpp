#include "engine.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

namespace dfm_ode_detail {
namespace {

constexpr double kForget = 0.05;  // s
// share of a jointed body's change by contact that may be missing before contact is solved again
constexpr double kResidual = 0.01;
// m/s: of a body that contact changes by less, what is missing counts against this (then 1e-6 m/s,
// as in the solve)
constexpr double kSlow = 1e-4;
constexpr double kDrifts = 1, kFellAsleep = 2;  // extra[12]
constexpr int kMostCorrections = 3;  // per sub-step; more than one only where joints or motors jump

Quat rotation_of(const dfm_rigid_state &s) {
  return {s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]};
}

Vec inverse(Vec a) { return {1 / a.x, 1 / a.y, 1 / a.z}; }

// Principal axes of a symmetric matrix by Jacobi's rotations.
void principal(double a[3][3], Vec &moments, Quat &axes) {
  double e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 30; ++sweep) {
    if (a[0][1] == 0 && a[0][2] == 0 && a[1][2] == 0) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (std::fabs(a[p][q]) <= 1e-18 * std::sqrt(std::fabs(a[p][p] * a[q][q]))) {
          a[p][q] = a[q][p] = 0;
          continue;
        }
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1);
        const double s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y;
          a[k][q] = s * x + c * y;
        }
        for (int k = 0; k < 3; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y;
          a[q][k] = s * x + c * y;
        }
        for (int k = 0; k < 3; ++k) {
          const double x = e[k][p], y = e[k][q];
          e[k][p] = c * x - s * y;
          e[k][q] = s * x + c * y;
        }
      }
  }
  moments = {a[0][0], a[1][1], a[2][2]};
  // Columns of e, made right-handed, as a quaternion by the largest of its four parts.
  const Vec x{e[0][0], e[1][0], e[2][0]}, y{e[0][1], e[1][1], e[2][1]};
  Vec z{e[0][2], e[1][2], e[2][2]};
  if (dot(cross(x, y), z) < 0) z = -1.0 * z;
  const double w = 1 + x.x + y.y + z.z;
  const double i = 1 + x.x - y.y - z.z;
  const double j = 1 - x.x + y.y - z.z;
  const double k = 1 - x.x - y.y + z.z;
  if (w >= i && w >= j && w >= k) axes = unit({y.z - z.y, z.x - x.z, x.y - y.x, w});
  else if (i >= j && i >= k) axes = unit({i, x.y + y.x, z.x + x.z, y.z - z.y});
  else if (j >= k) axes = unit({x.y + y.x, j, y.z + z.y, z.x - x.z});
  else axes = unit({z.x + x.z, y.z + z.y, k, x.y - y.x});
}

void carry(dBodyID b, Vec force, Vec torque) {
  dBodySetForce(b, force.x, force.y, force.z);
  dBodySetTorque(b, torque.x, torque.y, torque.z);
}
// ODE normalizes every quaternion that it is given. Rounding can make that a cycle: a quaternion slightly too
// short becomes one slightly too long, and back. This leaves the body with a quaternion near it that
// normalizing does not change. One unit in the last place, added to the largest part of the short one, ends
// the cycle (2e6 random quaternions: 6 rounds at most).
void settle_rotation(dBodyID b) {
  const auto get = [&] {
    const dReal *const q = dBodyGetQuaternion(b);
    return std::array<dReal, 4>{q[0], q[1], q[2], q[3]};
  };
  for (int round = 0; round < 16; ++round) {
    const auto before = get();
    dBodySetQuaternion(b, before.data());
    auto after = get();
    if (after == before) return;
    if (round == 0 ||
        after[0] * after[0] + after[1] * after[1] + after[2] * after[2] + after[3] * after[3] >= 1)
      continue;
    dReal &largest = *std::max_element(after.begin(), after.end(),
                                       [](dReal x, dReal y) { return std::fabs(x) < std::fabs(y); });
    largest = std::nextafter(largest, std::copysign(dReal(2), largest));
    dBodySetQuaternion(b, after.data());
  }
}
bool finite_turn(dBodyID b) { return dBodyGetFiniteRotationMode(b) != 0; }
bool damped(dBodyID b) {
  return dBodyGetLinearDamping(b) != 0 || dBodyGetAngularDamping(b) != 0 ||
         dBodyGetMaxAngularSpeed(b) < dInfinity;
}

// ODE's rule, with one sample: only bodies with joints (contacts are some) fall asleep. Who sleeps keeps what
// it has counted. True: idle for long enough.
bool tire(dBodyID b, double h, const Engine::Idle &idle, Engine::Idle &next) {
  next = idle;
  if (!dBodyIsEnabled(b)) return false;
  next = {};
  if (!dBodyGetAutoDisableFlag(b) || dBodyGetNumJoints(b) == 0 ||
      dBodyGetAutoDisableAverageSamplesCount(b) == 0)
    return false;
  if (norm(load(dBodyGetLinearVel(b))) > dBodyGetAutoDisableLinearThreshold(b)) return false;
  if (norm(load(dBodyGetAngularVel(b))) > dBodyGetAutoDisableAngularThreshold(b)) return false;
  next = {idle[0] + 1, idle[1] + h};
  return next[0] >= dBodyGetAutoDisableSteps(b) && next[1] >= dBodyGetAutoDisableTime(b);
}

// Mean spin over h with angular momentum L: w = I^-1(q half way) L.
Vec mean_spin(Quat q, Vec inverse_moments, Vec L, double h) {
  Vec w = in_axes(q, inverse_moments, L);
  for (int k = 0; k < 60; ++k) {
    const Vec next = in_axes(turn_by(0.5 * h * w) * q, inverse_moments, L), change = next - w;
    w = next;
    if (dot(change, change) <= 1e-31 * dot(w, w)) break;
  }
  return w;
}

class Timer {
 public:
  explicit Timer(double &to) : to_(to), start_(std::chrono::steady_clock::now()) {}
  ~Timer() { to_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  double &to_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

Inertia inertia_of(dBodyID body) {
  dMass m;
  dBodyGetMass(body, &m);
  Inertia out;
  out.mass = m.mass;
  if (m.I[1] == 0 && m.I[2] == 0 && m.I[6] == 0) {
    out.moments = {m.I[0], m.I[5], m.I[10]};
    return out;
  }
  double a[3][3];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) a[r][c] = 0.5 * (m.I[4 * r + c] + m.I[4 * c + r]);
  principal(a, out.moments, out.axes);
  return out;
}

dfm_rigid_state Member::state() const {
  dfm_rigid_state s{};
  const dReal *const x = dBodyGetPosition(body);
  const dReal *const v = dBodyGetLinearVel(body);
  const dReal *const w = dBodyGetAngularVel(body);
  const Quat q = unit(from_ode(dBodyGetQuaternion(body)) * inertia.axes);
  for (int k = 0; k < 3; ++k) {
    s.position[k] = x[k];
    s.velocity[k] = v[k];
    s.spin[k] = w[k];
  }
  s.rotation[0] = q.x;
  s.rotation[1] = q.y;
  s.rotation[2] = q.z;
  s.rotation[3] = q.w;
  return s;
}

void Member::put(const dfm_rigid_state &s) {
  dQuaternion q;
  to_ode(unit(rotation_of(s) * conjugate(inertia.axes)), q);
  dBodySetPosition(body, s.position[0], s.position[1], s.position[2]);
  dBodySetQuaternion(body, q);
  dBodySetLinearVel(body, s.velocity[0], s.velocity[1], s.velocity[2]);
  dBodySetAngularVel(body, s.spin[0], s.spin[1], s.spin[2]);
}

Motion Member::answer(const Motion &p) const {
  return {(1 / inertia.mass) * p.v, in_axes(rotation_of(start), inverse(inertia.moments), p.w)};
}

void Engine::begin(const std::vector<dBodyID> &others, double time) {
  saved_.clear();
  auto add = [&](dBodyID b) {
    saved_.push_back({b,
                      load(dBodyGetForce(b)),
                      load(dBodyGetTorque(b)),
                      {},
                      {},
                      {},
                      {},
                      false,
                      false,
                      dBodyGetGyroscopicMode(b) != 0,
                      inertia_of(b)});
  };
  for (Member *m : members) {
    m->saved = saved_.size();
    add(m->body);
  }
  for (const dBodyID b : others) {
    add(b);
    saved_.back().next_idle = idle(b);
  }
  idle_.clear();
  find_ties();
  begun_ = time;
  open_ = false;
  in_step = true;
}

Engine::Idle Engine::idle(dBodyID body) const {
  const auto known = idle_.find(body);
  return known == idle_.end() ? Idle{} : known->second;
}

void Engine::find_ties() {
  ties_.clear();
  number_.clear();
  for (size_t i = 0; i < saved_.size(); ++i) number_[saved_[i].body] = i;
  for (size_t i = 0; i < saved_.size(); ++i)
    for (int k = 0; k < dBodyGetNumJoints(saved_[i].body); ++k) {
      const dJointID j = dBodyGetJoint(saved_[i].body, k);
      const dBodyID a = dJointGetBody(j, 0), b = dJointGetBody(j, 1);
      if (a != saved_[i].body || !b || !dJointIsEnabled(j) || dBodyIsKinematic(a) || dBodyIsKinematic(b) ||
          dJointGetType(j) == dJointTypeContact)
        continue;
      ties_.push_back({j, i, number_.at(b), {}, nullptr});
    }
}

void Engine::end(double time) {
  if (open_ && time == t_) {
    for (Saved &s : saved_) {
      s.enabled = s.given;
      s.next_idle = s.idle;
    }
    restore();
    stepped_ = false;  // what friction has seen of it does not count
  }
  if (time == begun_)
    for (const Saved &s : saved_) carry(s.body, s.force, s.torque);
  close();
  // The world does not keep bodies without geoms: restore() and dfm_ode_restore() set their
  // quaternions again.
  for (size_t i = members.size(); i < saved_.size(); ++i) {
    idle_[saved_[i].body] = saved_[i].next_idle;
    settle_rotation(saved_[i].body);
  }
  open_ = in_step = false;
}

// The sub-step before has ended for good, or been taken back.
void Engine::close() {
  if (friction && stepped_) friction->settle(h_);
  else if (friction) friction->drop();
  if (contacts) dJointGroupEmpty(contacts);
  stepped_ = false;
}

void Engine::forget(Member *m) { std::erase(members, m); }

// Bodies as they were at the start of the sub-step.
void Engine::restore() {
  for (const Saved &s : saved_) {
    dQuaternion q;
    to_ode(s.rotation, q);
    dBodySetPosition(s.body, s.position.x, s.position.y, s.position.z);
    dBodySetQuaternion(s.body, q);
    dBodySetLinearVel(s.body, s.v.x, s.v.y, s.v.z);
    dBodySetAngularVel(s.body, s.w.x, s.w.y, s.w.z);
    if (s.enabled != bool(dBodyIsEnabled(s.body))) (s.enabled ? dBodyEnable : dBodyDisable)(s.body);
  }
}

template <class F>
void Engine::flood(std::vector<size_t> open, F &&reach) {
  while (!open.empty()) {
    const dBodyID b = saved_[open.back()].body;
    open.pop_back();
    for (int k = 0; k < dBodyGetNumJoints(b); ++k) {
      const dJointID j = dBodyGetJoint(b, k);
      const dBodyID first = dJointGetBody(j, 0), other = first == b ? dJointGetBody(j, 1) : first;
      if (!other || !dJointIsEnabled(j) || (dBodyIsKinematic(b) && dBodyIsKinematic(other))) continue;
      const auto known = number_.find(other);
      if (known != number_.end() && reach(known->second)) open.push_back(known->second);
    }
  }
}

// Whatever hangs on something awake is awake, as in dWorldStep.
void Engine::pull_awake() {
  for (Member *m : members) m->pulled = false;
  std::vector<size_t> awake;
  for (size_t i = 0; i < saved_.size(); ++i)
    if (saved_[i].enabled && dBodyGetNumJoints(saved_[i].body) > 0) awake.push_back(i);
  if (awake.size() == saved_.size()) return;
  flood(std::move(awake), [&](size_t i) {
    if (saved_[i].enabled) return false;
    dBodyEnable(saved_[i].body);
    if (i < members.size()) members[i]->pulled = true;
    return saved_[i].enabled = true;
  });
}

// A body sleeps when all that it hangs together with has idled for long enough.
void Engine::fall_asleep(double h) {
  std::vector<uint8_t> due(saved_.size(), 0);
  bool any = false;
  for (size_t i = 0; i < saved_.size(); ++i) {
    Saved &s = saved_[i];
    Member *const m = i < members.size() ? members[i] : nullptr;
    any |= due[i] = tire(s.body, h, m ? m->idle : s.idle, m ? m->next_idle : s.next_idle);
  }
  if (!any) return;
  std::vector<size_t> awake;
  for (size_t i = 0; i < saved_.size(); ++i)
    if (!due[i] && dBodyIsEnabled(saved_[i].body)) awake.push_back(i);
  flood(std::move(awake), [&](size_t i) { return std::exchange(due[i], 0) != 0; });
  for (size_t i = 0; i < saved_.size(); ++i) {
    if (!due[i]) continue;
    dBodyDisable(saved_[i].body);
    dBodySetLinearVel(saved_[i].body, 0, 0, 0);
    dBodySetAngularVel(saved_[i].body, 0, 0, 0);
  }
}

void Engine::open(const dfm_rigid_step &step) {
  if (open_ && step.t == t_) {  // tried again, from the same states
    if (stepped_) restore();
  } else {
    Timer timer(ode_seconds);
    for (Saved &s : saved_) {
      s.position = load(dBodyGetPosition(s.body));
      s.rotation = from_ode(dBodyGetQuaternion(s.body));
      s.v = load(dBodyGetLinearVel(s.body));
      s.w = load(dBodyGetAngularVel(s.body));
      s.enabled = s.given = dBodyIsEnabled(s.body);
      s.idle = s.next_idle;
    }
    close();
    if (friction) friction->h = step.h;
    for (const dSpaceID space : spaces) dSpaceCollide(space, near_data, near_callback);
    pull_awake();
  }
  open_ = true;
  stepped_ = dirty_ = again_ = false;
  rounds_ = 0;
  t_ = step.t;
  h_ = step.h;
}

// ODE gets the world's state each time, so that it is a function of that to the last bit, also after a
// restore or where the guard left out a part of the way.
void Engine::take(Member &m, const dfm_rigid_state &given, const double *extra) {
  Saved &s = saved_[m.saved];
  if (m.restored && s.enabled != (extra[12] == 0)) {
    (s.enabled ? dBodyDisable : dBodyEnable)(m.body);
    s.enabled = s.given = !s.enabled;
  }
  m.restored = false;
  m.put(given);
  s.position = load(dBodyGetPosition(m.body));
  s.rotation = from_ode(dBodyGetQuaternion(m.body));
  s.v = load(dBodyGetLinearVel(m.body));
  s.w = load(dBodyGetAngularVel(m.body));
}

void Engine::classify(Member &m, const dfm_rigid_step &step, const double *extra) {
  const dBodyID b = m.body;
  m.start = m.state();
  const bool disabled = !dBodyIsEnabled(b);
  const bool moves = !dBodyIsKinematic(b) && (!disabled || m.wakes);
  const bool plain = dBodyGetNumJoints(b) == 0 && !damped(b);
  m.asleep = disabled && !m.wakes;
  m.kind = !moves ? Member::still : plain ? Member::free : Member::jointed;
  m.turns = m.kind == Member::free && dBodyGetGyroscopicMode(b) && !finite_turn(b);
  // ODE turns it: what it makes of it is in b
  if (m.kind == Member::free && !m.turns) m.kind = Member::jointed;
  m.bias = {load(extra), load(extra + 3)};
  const bool was_asleep = extra[12] != 0;
  // by the caller; who is only pulled goes back to sleep at once when it idles
  const bool woken = was_asleep && !disabled && !m.pulled;
  m.idle = woken ? Idle{} : Idle{extra[13], extra[14]};
  m.impulse = {};
  const Vec v = load(m.start.velocity), w = load(m.start.spin);
  const Saved &forces = saved_[m.saved];
  dVector3 g;
  dWorldGetGravity(world, g);
  const Vec gravity = dBodyGetGravityMode(b) ? load(g) : Vec{};
  const Quat q = rotation_of(m.start);
  m.turn_momentum = in_axes(q, m.inertia.moments, w) + step.h * forces.torque;
  m.plain.v = v + step.h * (gravity + (1 / m.inertia.mass) * forces.force);
  m.plain.w = m.turns ? mean_spin(q, inverse(m.inertia.moments), m.turn_momentum, step.h)
                      : w + step.h * in_axes(q, inverse(m.inertia.moments), forces.torque);
  const Motion kept{load(extra + 6), load(extra + 9)};
  m.drift = {};
  if (!m.asleep) return;
  if (extra[12] == kDrifts) {
    m.drift = kept;
    return;
  }
  const Motion carried = m.answer(kept);  // b is what was in balance with this
  m.bias = {-1.0 * carried.v - (1 / step.h) * (m.plain.v - v),
            -1.0 * carried.w - (1 / step.h) * (m.plain.w - w)};
}

void Engine::predict(Member &m, const dfm_rigid_step &step, uint32_t number, double *velocity) {
  if (!open_ || step.t != t_ || step.h != h_ || (stepped_ && !again_)) open(step);
  if (again_ && stepped_) {
    restore();
    stepped_ = false;
  }
  const double *const extra = step.extra + size_t{Member::kExtra} * number;
  if (!again_) {
    m.wakes = false;
    take(m, step.state[number], extra);
  }
  if (!again_ || (m.wakes && m.asleep)) classify(m, step, extra);
  else if (m.kind == Member::jointed) m.bias = m.next_bias;
  if (m.kind == Member::still)
    m.used = m.asleep ? Motion{} : Motion{load(m.start.velocity), load(m.start.spin)};
  else if (m.kind == Member::free) m.used = m.plain;
  else m.used = {m.plain.v + step.h * m.bias.v, m.plain.w + step.h * m.bias.w};
  store(velocity, m.used.v);
  store(velocity + 3, m.used.w);
}

void Engine::respond(const Member &m, double matrix[36]) const {
  std::fill_n(matrix, 36, 0.0);
  if (m.kind == Member::still) return;
  for (int k = 0; k < 3; ++k) {
    matrix[7 * k] = 1 / m.inertia.mass;
    const Vec column = in_axes(rotation_of(m.start), inverse(m.inertia.moments),
                               {k == 0 ? 1.0 : 0, k == 1 ? 1.0 : 0, k == 2 ? 1.0 : 0});
    matrix[6 * 3 + 3 + k] = column.x;
    matrix[6 * 4 + 3 + k] = column.y;
    matrix[6 * 5 + 3 + k] = column.z;
  }
  for (int r = 3; r < 6; ++r)  // symmetric to the last bit
    for (int c = 3; c < r; ++c)
      matrix[6 * r + c] = matrix[6 * c + r] = 0.5 * (matrix[6 * r + c] + matrix[6 * c + r]);
}

void Engine::push(Member &m, const double *impulse) {
  m.impulse = {load(impulse), load(impulse + 3)};
  dirty_ = true;
}

// For the length of an ODE step, whichever way it ends: joints tell the engine what they do, and ODE keeps
// its gyroscopic terms out.
class Engine::Lent {
 public:
  explicit Lent(Engine &engine) : engine_(engine) {
    for (Tie &t : engine.ties_) {
      t.callers = dJointGetFeedback(t.joint);
      dJointSetFeedback(t.joint, &t.own);
    }
    for (const Saved &s : engine.saved_) dBodySetGyroscopicMode(s.body, 0);
  }
  ~Lent() {
    for (const Saved &s : engine_.saved_) dBodySetGyroscopicMode(s.body, s.gyroscopic);
    for (const Tie &t : engine_.ties_) {
      dJointSetFeedback(t.joint, t.callers);
      if (t.callers) *t.callers = t.own;
    }
  }
  Lent(const Lent &) = delete;
  Lent &operator=(const Lent &) = delete;

 private:
  Engine &engine_;
};

void Engine::advance(double h) {
  Timer timer(ode_seconds);
  if (stepped_) restore();
  for (const Saved &s : saved_) carry(s.body, s.force, s.torque);
  for (Member *m : members) {
    if (m->wakes) dBodyEnable(m->body);
    if (m->kind == Member::still) continue;
    const Vec f = (1 / h) * m->impulse.v, t = (1 / h) * m->impulse.w;
    dBodyAddForce(m->body, f.x, f.y, f.z);
    dBodyAddTorque(m->body, t.x, t.y, t.z);
  }
  for (const Saved &s : saved_)
    // its counters begin anew: tire() counts
    if (dBodyIsEnabled(s.body) && dBodyGetAutoDisableFlag(s.body)) dBodyEnable(s.body);
  const Lent lent(*this);
  stepped_ = true;
  dirty_ = false;
  (quick ? dWorldQuickStep : dWorldStep)(world, h);
  ++steps;
  turn_jointed(h);
  turn_free(h);
}

void Engine::turn_jointed(double h) {
  turn_.assign(saved_.size(), {});
  for (const Tie &t : ties_) {
    const Saved &a = saved_[t.a], &b = saved_[t.b];
    const dJointFeedback &f = t.own;
    const Vec couple =
        cross(a.position, load(f.f1)) + load(f.t1) + cross(b.position, load(f.f2)) + load(f.t2);
    turn_[t.a] = turn_[t.a] - 0.5 * h * couple;
    turn_[t.b] = turn_[t.b] - 0.5 * h * couple;
  }
  for (size_t i = 0; i < saved_.size(); ++i) {
    const Saved &s = saved_[i];
    if (!s.gyroscopic || !dBodyIsEnabled(s.body) || dBodyIsKinematic(s.body)) continue;
    const Quat from = s.rotation * s.inertia.axes, to = from_ode(dBodyGetQuaternion(s.body)) * s.inertia.axes;
    const Vec L = in_axes(from, s.inertia.moments, load(dBodyGetAngularVel(s.body))) + turn_[i];
    const Vec w = in_axes(to, inverse(s.inertia.moments), L);
    dBodySetAngularVel(s.body, w.x, w.y, w.z);
  }
}

void Engine::turn_free(double h) {
  for (Member *m : members) {
    if (!m->turns || !dBodyIsEnabled(m->body)) continue;
    const Vec L = m->turn_momentum + m->impulse.w, inverse_moments = inverse(m->inertia.moments);
    if (dot(L, L) == 0) continue;
    const Quat from = rotation_of(m->start);
    const Quat to = unit(turn_by(h * mean_spin(from, inverse_moments, L, h)) * from);
    const Vec w = in_axes(to, inverse_moments, L);
    dQuaternion q;
    to_ode(unit(to * conjugate(m->inertia.axes)), q);
    dBodySetQuaternion(m->body, q);
    dBodySetAngularVel(m->body, w.x, w.y, w.z);
  }
}

// What constraints added to a jointed body beside its own answer to contact; the share of contact's change
// that was not foreseen, by energy.
double Engine::judge(Member &m, double h) {
  m.next_bias = m.kind == Member::still ? m.bias : Motion{};
  if (m.kind != Member::jointed || !dBodyIsEnabled(m.body)) return 0;
  const dfm_rigid_state end = m.state();
  const Motion got{(1 / h) * (load(end.position) - load(m.start.position)),
                   (1 / h) * turn_of(rotation_of(end) * conjugate(rotation_of(m.start)))};
  const Motion own = m.answer(m.impulse);
  m.next_bias = {(1 / h) * (got.v - m.plain.v - own.v), (1 / h) * (got.w - m.plain.w - own.w)};
  const double contact = dot(m.impulse.v, own.v) + dot(m.impulse.w, own.w);
  if (!(contact > 0)) return 0;
  const double scale = std::max(contact, m.inertia.mass * (kSlow * kSlow));
  const Vec dv = got.v - m.used.v - own.v, dw = got.w - m.used.w - own.w;
  const double missing =
      m.inertia.mass * dot(dv, dv) + dot(dw, in_axes(rotation_of(m.start), m.inertia.moments, dw));
  return std::sqrt(missing / scale);
}

bool Engine::wake_sleepers(double h) {
  bool woken = false;
  for (Member *m : members) {
    if (!m->asleep || dBodyIsKinematic(m->body)) continue;
    const Motion push = m->answer(m->impulse);
    const double left = std::max(0.0, 1 - h / kForget);
    m->drift.v = left * m->drift.v + (m->plain.v - load(m->start.velocity)) + push.v + h * m->bias.v;
    m->drift.w = left * m->drift.w + (m->plain.w - load(m->start.spin)) + push.w + h * m->bias.w;
    m->wakes = norm(m->drift.v) > dBodyGetAutoDisableLinearThreshold(m->body) ||
               norm(m->drift.w) > dBodyGetAutoDisableAngularThreshold(m->body);
    woken |= m->wakes;
  }
  return woken;
}

bool Engine::commit(Member &m, uint32_t number, dfm_rigid_state *state, double *extra, double h) {
  bool again = false;
  if (dirty_ || !stepped_) {
    const bool woken = rounds_ == 0 && wake_sleepers(h);
    advance(h);
    residual = 0;
    for (Member *each : members) residual = std::max(residual, judge(*each, h));
    again_ = again = woken || (residual > kResidual && rounds_ < kMostCorrections);
    if (again) {
      ++corrections;
      ++rounds_;
    } else {
      residual_max = std::max(residual_max, residual);
    }
    if (!again) fall_asleep(h);
  }
  state[number] = m.state();
  double *const keep = extra + size_t{Member::kExtra} * number;
  const bool sleeps = !dBodyIsEnabled(m.body);
  const Motion load_or_drift =
      m.asleep && sleeps ? m.drift : Motion{(1 / h) * m.impulse.v, (1 / h) * m.impulse.w};
  store(keep, m.next_bias.v);
  store(keep + 3, m.next_bias.w);
  store(keep + 6, load_or_drift.v);
  store(keep + 9, load_or_drift.w);
  keep[12] = !sleeps ? 0 : m.asleep ? kDrifts : kFellAsleep;
  keep[13] = m.next_idle[0];
  keep[14] = m.next_idle[1];
  return again;
}

}  // namespace dfm_ode_detail
