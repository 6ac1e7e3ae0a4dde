#include "engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace dfm_ode_detail {
namespace {

void carry(dBodyID b, Vec force, Vec torque) {
  dBodySetForce(b, force.x, force.y, force.z);
  dBodySetTorque(b, torque.x, torque.y, torque.z);
}
// ODE normalizes every quaternion that it is given. Rounding can make that a cycle: a quaternion slightly too
// short becomes one slightly too long, and back. This leaves the body with a quaternion near it that
// normalizing does not change. One unit in the last place, added to the largest part of the short one, ends
// the cycle (2e6 random quaternions: 6 rounds at most).
void normalize_rotation(dBodyID b) {
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

// ODE's rule, with one sample: only bodies with joints (contacts are joints, too) fall asleep. A sleeping
// body keeps its counters. share: of a step that the sub-step h is. True: idle for long enough.
bool tire(dBodyID b, double h, double share, const OdeEngine::Idle &idle, OdeEngine::Idle &next) {
  next = idle;
  if (!dBodyIsEnabled(b)) return false;
  next = {};
  if (!dBodyGetAutoDisableFlag(b) || dBodyGetNumJoints(b) == 0 ||
      dBodyGetAutoDisableAverageSamplesCount(b) == 0)
    return false;
  if (norm(load(dBodyGetLinearVel(b))) > dBodyGetAutoDisableLinearThreshold(b)) return false;
  if (norm(load(dBodyGetAngularVel(b))) > dBodyGetAutoDisableAngularThreshold(b)) return false;
  next = {idle[0] + share, idle[1] + h};
  constexpr double kRounding = 1e-6;  // of a sum of shares
  return next[0] >= dBodyGetAutoDisableSteps(b) - kRounding && next[1] >= dBodyGetAutoDisableTime(b);
}

}  // namespace

Inertia inertia_of(dBodyID body) {
  dMass m;
  dBodyGetMass(body, &m);
  double tensor[3][3];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) tensor[r][c] = m.I[4 * r + c];
  return dfm_rigid_detail::inertia_of(m.mass, tensor);
}

dfm_rigid_state OdeMember::state() const {
  return state_of(load(dBodyGetPosition(body)), unit(from_ode(dBodyGetQuaternion(body)) * inertia.axes),
                  load(dBodyGetLinearVel(body)), load(dBodyGetAngularVel(body)));
}

std::array<dReal, 13> OdeMember::now() const {
  std::array<dReal, 13> out;
  std::copy_n(dBodyGetPosition(body), 3, out.begin());
  std::copy_n(dBodyGetQuaternion(body), 4, out.begin() + 3);
  std::copy_n(dBodyGetLinearVel(body), 3, out.begin() + 7);
  std::copy_n(dBodyGetAngularVel(body), 3, out.begin() + 10);
  return out;
}

const dfm_rigid_state &OdeMember::end() {
  if (!std::exchange(has_ended, true)) ended = state();
  return ended;
}

void OdeMember::mark() { marked_ = now(); }

bool OdeMember::stays() const {
  const std::array<dReal, 13> here = now();
  return std::memcmp(here.data(), marked_.data(), sizeof here) == 0;
}

void OdeMember::put(const dfm_rigid_state &s) {
  dQuaternion q;
  to_ode(unit(rotation_of(s) * conjugate(inertia.axes)), q);
  dBodySetPosition(body, s.position[0], s.position[1], s.position[2]);
  dBodySetQuaternion(body, q);
  dBodySetLinearVel(body, s.velocity[0], s.velocity[1], s.velocity[2]);
  dBodySetAngularVel(body, s.spin[0], s.spin[1], s.spin[2]);
}

Facts OdeMember::facts() const {
  Facts f;
  const OdeEngine &of = *static_cast<OdeEngine *>(engine);
  f.enabled = dBodyIsEnabled(body);
  f.kinematic = dBodyIsKinematic(body);
  f.plain = dBodyGetNumJoints(body) == 0 && !damped(body);
  f.turns = dBodyGetGyroscopicMode(body) && !finite_turn(body);
  f.force = of.carried(*this).force;
  f.torque = of.carried(*this).torque;
  dVector3 g;
  dWorldGetGravity(of.world, g);
  if (dBodyGetGravityMode(body)) f.gravity = load(g);
  return f;
}

void OdeEngine::gather(const std::vector<dBodyID> &others) {
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
  for (size_t i = 0; i < members.size(); ++i) {
    member(i).saved = i;
    add(member(i).body);
  }
  for (const dBodyID b : others) {
    add(b);
    saved_.back().next_idle = idle(b);
  }
  idle_.clear();
  find_ties();
}

OdeEngine::Idle OdeEngine::idle(dBodyID body) const {
  const auto known = idle_.find(body);
  return known == idle_.end() ? Idle{} : known->second;
}

void OdeEngine::find_ties() {
  ties_.clear();
  bool numbered = number_.size() == saved_.size() && bodies_.size() == saved_.size();
  for (size_t i = 0; numbered && i < saved_.size(); ++i) numbered = bodies_[i] == saved_[i].body;
  if (!numbered) {
    number_.clear();
    bodies_.clear();
    for (size_t i = 0; i < saved_.size(); ++i) {
      number_[saved_[i].body] = i;
      bodies_.push_back(saved_[i].body);
    }
  }
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

void OdeEngine::restore_forces() {
  for (const Saved &s : saved_) carry(s.body, s.force, s.torque);
}

// The last sub-step has been committed or undone.
void OdeEngine::close() {
  if (friction && stepped()) friction->finish_step(step_length());
  else if (friction) friction->drop();
  if (contacts) dJointGroupEmpty(contacts);
}

// The world does not keep bodies without geoms: restore() and dfm_ode_restore() set their quaternions again.
void OdeEngine::ended() {
  for (size_t i = members.size(); i < saved_.size(); ++i) {
    idle_[saved_[i].body] = saved_[i].next_idle;
    normalize_rotation(saved_[i].body);
  }
}

void OdeEngine::restore(bool given) {
  for (Saved &s : saved_) {
    if (given) {
      s.enabled = s.given;
      s.next_idle = s.idle;
    }
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
void OdeEngine::flood(std::vector<size_t> open, F &&reach) {
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

// Bodies connected to an awake one are awake, as in dWorldStep.
void OdeEngine::pull_awake() {
  for (Member *m : members) m->pulled = false;
  if (std::all_of(saved_.begin(), saved_.end(), [](const Saved &s) { return s.enabled; })) return;
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

// A body falls asleep when all bodies connected to it have been idle for long enough.
void OdeEngine::rest(double h) {
  std::vector<uint8_t> still(saved_.size(), 0);
  bool any = false;
  for (size_t i = 0; i < saved_.size(); ++i) {
    Saved &s = saved_[i];
    Member *const m = i < members.size() ? members[i] : nullptr;
    any |= still[i] = tire(s.body, h, share_of_step(h), m ? m->idle : s.idle, m ? m->next_idle : s.next_idle);
  }
  if (!any) return;
  std::vector<size_t> awake;
  for (size_t i = 0; i < saved_.size(); ++i)
    if (!still[i] && dBodyIsEnabled(saved_[i].body)) awake.push_back(i);
  flood(std::move(awake), [&](size_t i) { return std::exchange(still[i], 0) != 0; });
  for (size_t i = 0; i < saved_.size(); ++i) {
    if (!still[i]) continue;
    dBodyDisable(saved_[i].body);
    dBodySetLinearVel(saved_[i].body, 0, 0, 0);
    dBodySetAngularVel(saved_[i].body, 0, 0, 0);
    if (i < members.size()) member(i).has_ended = false;
  }
}

void OdeEngine::prepare(const dfm_rigid_step &step) {
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
  collided();
  pull_awake();
}

void OdeEngine::take(Member &any, const dfm_rigid_state &given, const double *extra) {
  OdeMember &m = static_cast<OdeMember &>(any);
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
  m.start = m.state();
}

// During an ODE step, also if it ends by an exception, joints report their forces to the engine, ODE's
// gyroscopic terms are off, and ODE corrects by the share of the caller's step that this one is.
class OdeEngine::Lent {
 public:
  Lent(OdeEngine &engine, double h) : engine_(engine), correction_(dWorldGetERP(engine.world)) {
    dWorldSetERP(engine.world, correction_ * engine.share_of_step(h));
    for (Tie &t : engine.ties_) {
      t.callers = dJointGetFeedback(t.joint);
      dJointSetFeedback(t.joint, &t.own);
    }
    for (const Saved &s : engine.saved_) dBodySetGyroscopicMode(s.body, 0);
  }
  ~Lent() {
    dWorldSetERP(engine_.world, correction_);
    for (const Saved &s : engine_.saved_) dBodySetGyroscopicMode(s.body, s.gyroscopic);
    for (const Tie &t : engine_.ties_) {
      dJointSetFeedback(t.joint, t.callers);
      if (t.callers) *t.callers = t.own;
    }
  }
  Lent(const Lent &) = delete;
  Lent &operator=(const Lent &) = delete;

 private:
  OdeEngine &engine_;
  dReal correction_;
};

void OdeEngine::put_forces(double h) {
  restore_forces();
  for (size_t i = 0; i < members.size(); ++i) {
    const OdeMember &m = member(i);
    if (m.wakes) dBodyEnable(m.body);
    if (m.kind == Member::still) continue;
    const Vec f = (1 / h) * m.impulse.v, t = (1 / h) * m.impulse.w;
    dBodyAddForce(m.body, f.x, f.y, f.z);
    dBodyAddTorque(m.body, t.x, t.y, t.z);
  }
  for (const Saved &s : saved_)
    // resets its counters: tire() counts
    if (dBodyIsEnabled(s.body) && dBodyGetAutoDisableFlag(s.body)) dBodyEnable(s.body);
}

void OdeEngine::run(double h) {
  {
    const Lent lent(*this, h);
    (quick ? dWorldQuickStep : dWorldStep)(world, h);
  }
  for (size_t i = 0; i < members.size(); ++i) member(i).has_ended = false;
  turn_jointed(h);
}

void OdeEngine::turned(Member &any, Quat to, Vec w) {
  OdeMember &m = static_cast<OdeMember &>(any);
  dQuaternion q;
  to_ode(unit(to * conjugate(m.inertia.axes)), q);
  dBodySetQuaternion(m.body, q);
  dBodySetAngularVel(m.body, w.x, w.y, w.z);
  m.has_ended = false;
}

void OdeEngine::turn_jointed(double h) {
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

}  // namespace dfm_ode_detail
