#include "engine.h"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_set>

namespace dfm_bullet_detail {
namespace {

constexpr double kIdleSpeed = 0.01, kIdleSpin = 0.05;  // m/s, rad/s
// moment of inertia per kg about an axis without rotation: its inverse is negligible
constexpr double kHuge = 1e12;  // m2
// roundings of btScalar; a motion beside the velocity that is smaller counts as none
constexpr double kRoundings = 8, kEpsilon = std::numeric_limits<btScalar>::epsilon();
constexpr int kGyroscopic = BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT | BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD |
                            BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY;

bool all_ones(const btVector3 &f) { return f.x() == 1 && f.y() == 1 && f.z() == 1; }

bool may_sleep(const btRigidBody *b) {
  const int state = b->getActivationState();
  return state != DISABLE_DEACTIVATION && state != DISABLE_SIMULATION;
}

void put_in(btRigidBody *b, const btTransform &t, const btVector3 &v, const btVector3 &w) {
  b->setLinearVelocity(v);
  b->setAngularVelocity(w);
  b->setCenterOfMassTransform(t);  // also sets its inertia, and the place from which motion states continue
}

// The rest of the motion from a to b in h beside velocities v and w: 0 within rounding.
Motion beside(const btTransform &a, const btTransform &b, const Motion &m, double h) {
  const Pose from = from_bullet(a), to = from_bullet(b);
  Motion out{to.position - from.position - h * m.v,
             turn_of(to.rotation * conjugate(turn_by(h * m.w) * from.rotation))};
  if (norm(out.v) <= kRoundings * kEpsilon * (norm(from.position) + h * norm(m.v))) out.v = {};
  if (norm(out.w) <= kRoundings * kEpsilon * (1 + h * norm(m.w))) out.w = {};
  return out;
}

bool same_bits(const btVector3 &a, const btVector3 &b) {
  return std::memcmp(a.m_floats, b.m_floats, 3 * sizeof(btScalar)) == 0;
}
bool same_place(const btTransform &a, const btTransform &b) {
  return same_bits(a.getOrigin(), b.getOrigin()) && same_bits(a.getBasis()[0], b.getBasis()[0]) &&
         same_bits(a.getBasis()[1], b.getBasis()[1]) && same_bits(a.getBasis()[2], b.getBasis()[2]);
}

// Bullet corrects by the share of the caller's tick that a sub-step is.
class SharedCorrection {
 public:
  SharedCorrection(btContactSolverInfo &info, double share)
      : info_(info), of_joints_(info.m_erp), of_contacts_(info.m_erp2) {
    info_.m_erp *= static_cast<btScalar>(share);
    info_.m_erp2 *= static_cast<btScalar>(share);
  }
  ~SharedCorrection() {
    info_.m_erp = of_joints_;
    info_.m_erp2 = of_contacts_;
  }
  SharedCorrection(const SharedCorrection &) = delete;
  SharedCorrection &operator=(const SharedCorrection &) = delete;

 private:
  btContactSolverInfo &info_;
  btScalar of_joints_, of_contacts_;
};

}  // namespace

void Stand::take(const btRigidBody &body) {
  transform = body.getWorldTransform();
  v = body.getLinearVelocity();
  w = body.getAngularVelocity();
  known = true;
}

bool Stand::holds(const btTransform &t, const btVector3 &v_now, const btVector3 &w_now) const {
  return known && same_bits(v, v_now) && same_bits(w, w_now) && same_place(transform, t);
}

dfm_rigid_state BulletMember::state() const {
  const Pose at = from_bullet(body->getWorldTransform());
  return state_of(at.position, at.rotation, from_bullet(body->getLinearVelocity()),
                  from_bullet(body->getAngularVelocity()));
}

void BulletMember::mark() { marked.take(*body); }

bool BulletMember::stays() const {
  return marked.holds(body->getWorldTransform(), body->getLinearVelocity(), body->getAngularVelocity());
}

void BulletMember::put(const dfm_rigid_state &s) {
  last_put = {to_bullet(Pose{load(s.position), rotation_of(s)}), to_bullet(load(s.velocity)),
              to_bullet(load(s.spin)), true};
  put_in(body, last_put.transform, last_put.v, last_put.w);
  put_state = s;
}

// Bullet's inertia is diagonal in the body's own frame; 0 marks an axis without rotation.
void BulletMember::read() {
  inertia.mass = 1.0 / body->getInvMass();
  const Vec inverse_moments = from_bullet(body->getInvInertiaDiagLocal());
  const auto moment = [&](double inverse) { return inverse > 0 ? 1 / inverse : kHuge * inertia.mass; };
  inertia.moments = {moment(inverse_moments.x), moment(inverse_moments.y), moment(inverse_moments.z)};
  moves_along = from_bullet(body->getLinearFactor());
  turns_about = from_bullet(body->getAngularFactor());
}

Facts BulletMember::facts() const {
  Facts f;
  const BulletEngine &of = *static_cast<BulletEngine *>(engine);
  f.enabled = body->isActive();
  f.plain = !touched && body->getLinearDamping() == 0 && body->getAngularDamping() == 0 &&
            body->getCcdSquareMotionThreshold() == 0 && all_ones(body->getLinearFactor()) &&
            all_ones(body->getAngularFactor());
  f.turns = (body->getFlags() & kGyroscopic) != 0;
  f.torque = from_bullet(body->getTotalTorque());
  if (of.falls) f.gravity = of.gravity;
  else f.force = from_bullet(body->getTotalForce());
  return f;
}

std::array<double, 2> BulletMember::idle_limits() const {
  return {std::min<double>(body->getLinearSleepingThreshold(), kIdleSpeed),
          std::min<double>(body->getAngularSleepingThreshold(), kIdleSpin)};
}

dfm_rigid_state LinkMember::state() const {
  std::vector<btVector3> w(static_cast<size_t>(body->getNumLinks()) + 1), v(w.size());
  body->compTreeLinkVelocities(w.data(), v.data());  // in the links' own frames, the base first
  const Pose p = from_bullet(collider->getWorldTransform());
  const auto at = static_cast<size_t>(link + 1);
  return state_of(p.position, p.rotation, from_bullet(body->localDirToWorld(link, v[at])),
                  from_bullet(body->localDirToWorld(link, w[at])));
}

void LinkMember::read() {
  inertia.mass = link < 0 ? body->getBaseMass() : body->getLinkMass(link);
  inertia.moments = from_bullet(link < 0 ? body->getBaseInertia() : body->getLinkInertia(link));
}

// Weight and forces of the caller act on it through its joints, whose last effect contains all but gravity.
Facts LinkMember::facts() const {
  Facts f;
  f.enabled = body->isAwake();
  f.plain = f.turns = false;
  f.gravity = from_bullet(static_cast<BulletEngine *>(engine)->world->getGravity());
  return f;
}

std::array<double, 2> LinkMember::idle_limits() const { return {kIdleSpeed, kIdleSpin}; }

void LinkMember::push(Vec force, Vec torque) {
  if (link < 0) {
    body->addBaseForce(to_bullet(force));
    body->addBaseTorque(to_bullet(torque));
  } else {
    body->addLinkForce(link, to_bullet(force));
    body->addLinkTorque(link, to_bullet(torque));
  }
}

// Whether the bodies are those of the last call. Compares addresses only: some may have been deleted.
bool BulletEngine::is_gathered() {
  const btAlignedObjectArray<btRigidBody *> &all = world->getNonStaticRigidBodies();
  bool same = gathered_ == members && listed_.size() == size_t(all.size());
  for (size_t i = 0; same && i < bodies_.size(); ++i)
    same = bodies_[i]->saved == i && saved_[i].member == bodies_[i] && saved_[i].body == bodies_[i]->body;
  for (int i = 0; same && i < all.size(); ++i)
    same = listed_[size_t(i)] ==
           std::pair<const btRigidBody *, bool>(all[i], !all[i]->isStaticOrKinematicObject());
  return same;
}

void BulletEngine::gather() {
  if (is_gathered()) return;
  gathered_ = members;
  listed_.clear();
  saved_.clear();
  number_.clear();
  const auto add = [&](btRigidBody *b, BulletMember *m) {
    number_[b] = saved_.size();
    Saved &s = saved_.emplace_back();
    s.body = b;
    s.member = m;
  };
  bodies_.clear();
  links_.clear();
  for (Member *m : members) {
    if (static_cast<AnyMember *>(m)->is_link) links_.push_back(static_cast<LinkMember *>(m));
    else bodies_.push_back(static_cast<BulletMember *>(m));
  }
  for (BulletMember *m : bodies_) {
    m->saved = saved_.size();
    add(m->body, m);
  }
  const btAlignedObjectArray<btRigidBody *> &all = world->getNonStaticRigidBodies();
  for (int i = 0; i < all.size(); ++i) {
    const bool moves = !all[i]->isStaticOrKinematicObject();
    listed_.emplace_back(all[i], moves);
    if (moves && !number_.count(all[i])) add(all[i], nullptr);
  }
}

void BulletEngine::take_damping_back(Saved &s) {
  s.damped_v = s.body->getLinearVelocity();
  s.damped_w = s.body->getAngularVelocity();
  if (same_place(s.body->getWorldTransform(), s.transform)) {
    s.body->setLinearVelocity(s.v);
    s.body->setAngularVelocity(s.w);
  } else {
    put_in(s.body, s.transform, s.v, s.w);
  }
}

void BulletEngine::prepare(const dfm_rigid_step &step) {
  for (Saved &s : saved_) {
    s.transform = s.body->getWorldTransform();
    s.v = s.body->getLinearVelocity();
    s.w = s.body->getAngularVelocity();
    s.activation = s.given = s.body->getActivationState();
    s.idle = s.body->getDeactivationTime();
  }
  multi_.keep(*world);
  const btScalar h = static_cast<btScalar>(step.h);
  btDispatcherInfo &info = world->getDispatchInfo();
  info.m_timeStep = h;
  info.m_stepCount = 0;
  info.m_debugDraw = world->getDebugDrawer();
  (world->*Opened::predict())(h);
  (world->*Opened::find_predictive())(h);
  world->performDiscreteCollisionDetection();
  collided();
  (world->*Opened::find_islands())();
  for (Saved &s : saved_) take_damping_back(s);
  predicted_ = multi_.any() ? 0 : step.h;
  has_islands_ = true;
  multi_.restore();
  find_touched();
  pull_awake();
}

// Finds bodies that have a contact or a constraint, and those that a kinematic body wakes by touch.
void BulletEngine::find_touched() {
  for (Saved &s : saved_) s.touched = false;
  const auto touch = [&](const btCollisionObject *a, const btCollisionObject *b) {
    const auto at = number_.find(a);
    if (at == number_.end()) return;
    Saved &s = saved_[at->second];
    s.touched = true;
    if (b->isKinematicObject() && b->getActivationState() != ISLAND_SLEEPING && b->hasContactResponse())
      s.body->activate();
  };
  btDispatcher *const dispatcher = world->getDispatcher();
  btPersistentManifold **const manifolds = dispatcher->getInternalManifoldPointer();
  for (int i = 0, n = dispatcher->getNumManifolds(); i < n; ++i) {
    const btPersistentManifold *const m = manifolds[i];
    if (m->getNumContacts() == 0) continue;
    touch(m->getBody0(), m->getBody1());
    touch(m->getBody1(), m->getBody0());
  }
  for (int i = 0; i < world->getNumConstraints(); ++i) {
    const btTypedConstraint *const c = world->getConstraint(i);
    if (!c->isEnabled()) continue;
    touch(&c->getRigidBodyA(), &c->getRigidBodyB());
    touch(&c->getRigidBodyB(), &c->getRigidBodyA());
  }
  for (Saved &s : saved_)
    if (s.member) s.member->touched = s.touched;
}

// Wakes all bodies in one island with an awake body, as Bullet does when it builds its islands.
void BulletEngine::pull_awake() {
  bool sleepers = false;
  for (const Saved &s : saved_) {
    sleepers |= s.body->getActivationState() == ISLAND_SLEEPING;
    if (s.member) s.member->pulled = false;
  }
  std::unordered_set<int> awake;
  for (const Saved &s : saved_) {
    const int state = s.body->getActivationState();
    if (sleepers && (state == ACTIVE_TAG || state == DISABLE_DEACTIVATION))
      awake.insert(s.body->getIslandTag());
  }
  if (sleepers)
    for (Saved &s : saved_) {
      if (s.body->getActivationState() != ISLAND_SLEEPING || !awake.count(s.body->getIslandTag())) continue;
      s.body->setActivationState(WANTS_DEACTIVATION);
      s.body->setDeactivationTime(0);
      if (s.member) s.member->pulled = true;
    }
  for (Saved &s : saved_) s.activation = s.body->getActivationState();
}

void BulletEngine::restore(bool given) {
  multi_.restore();
  for (Saved &s : saved_) {
    put_in(s.body, s.transform, s.v, s.w);
    s.body->forceActivationState(given ? s.given : s.activation);
    s.body->setDeactivationTime(s.idle);
  }
}

void BulletEngine::take(Member &any, const dfm_rigid_state &given, const double *extra) {
  any.start = given;
  if (static_cast<AnyMember &>(any).is_link) {
    static_cast<LinkMember &>(any).ended = given;
    any.restored = false;
    return;
  }
  BulletMember &m = static_cast<BulletMember &>(any);
  Saved &s = saved_[m.saved];
  if (m.restored && may_sleep(m.body)) {
    m.body->forceActivationState(extra[12] != 0 ? ISLAND_SLEEPING : ACTIVE_TAG);
    m.body->setDeactivationTime(btScalar(extra[14]));
    s.activation = s.given = m.body->getActivationState();
    s.idle = m.body->getDeactivationTime();
  }
  m.restored = false;
  m.ended = given;
  // prepare() has restored the former pose, so the pose that was put last is still there
  if (same(given, m.put_state) && m.last_put.holds(s.transform, s.v, s.w)) return;
  m.put(given);
  s.transform = m.body->getWorldTransform();
  s.v = m.body->getLinearVelocity();
  s.w = m.body->getAngularVelocity();
  predicted_ = 0;
}

void BulletEngine::put_forces(double) {
  for (BulletMember *m : bodies_)
    if (m->wakes) m->body->activate(true);
  for (LinkMember *m : links_)
    if (m->wakes) m->body->wakeUp();
}

// Constraints read only the velocities that predictUnconstraintMotion computes: integrateTransforms does not
// read the predicted transforms, and every call that places a body sets them again.
void BulletEngine::predict_again(double h) {
  if (predicted_ != h) {
    (world->*Opened::predict())(static_cast<btScalar>(h));
    return;
  }
  for (Saved &s : saved_) {
    s.body->setLinearVelocity(s.damped_v);
    s.body->setAngularVelocity(s.damped_w);
  }
}

void BulletEngine::run(double h) {
  const btScalar step = static_cast<btScalar>(h);
  predict_again(h);
  flags_.clear();
  for (Saved &s : saved_) {
    flags_.push_back(s.body->getFlags());
    s.body->setFlags(flags_.back() & ~kGyroscopic);
    if (!s.member || s.member->kind == Member::still) continue;
    const Motion change = s.member->response(s.member->impulse);
    s.body->setLinearVelocity(s.body->getLinearVelocity() + to_bullet(change.v));
    s.body->setAngularVelocity(s.body->getAngularVelocity() + to_bullet(change.w));
  }
  for (LinkMember *m : links_) m->push((1 / h) * m->impulse.v, (1 / h) * m->impulse.w);
  if (!std::exchange(has_islands_, false)) (world->*Opened::find_islands())();
  {
    const SharedCorrection shared(world->getSolverInfo(), callers_step > h ? h / callers_step : 1);
    world->getSolverInfo().m_timeStep = step;
    world->solveConstraints(world->getSolverInfo());
  }
  (world->*Opened::integrate())(step);
  for (size_t i = 0; i < saved_.size(); ++i) saved_[i].body->setFlags(flags_[i]);
  for (BulletMember *m : bodies_) finish(*m, h);
  for (LinkMember *m : links_) {
    m->push((-1 / h) * m->impulse.v, (-1 / h) * m->impulse.w);
    m->ended = m->state();
  }
}

void BulletEngine::finish(BulletMember &m, double h) {
  m.ended = m.start;
  if (!m.body->isActive()) {
    store(m.ended.velocity, {});
    store(m.ended.spin, {});
    return;
  }
  const Vec x = load(m.start.position);
  if (m.kind == Member::free) {
    const Vec v = m.plain.v + m.response(m.impulse).v;
    store(m.ended.velocity, v);
    store(m.ended.position, x + h * v);
    return;
  }
  const Saved &s = saved_[m.saved];
  const Motion got{from_bullet(m.body->getLinearVelocity()), from_bullet(m.body->getAngularVelocity())};
  const Vec v = load(m.start.velocity) + (got.v - from_bullet(s.v));
  const Vec w = load(m.start.spin) + (got.w - from_bullet(s.w));
  const Motion more = beside(s.transform, m.body->getWorldTransform(), got, h);
  const Quat from = rotation_of(m.start), turn = turn_by(h * w);
  const Quat to = unit((is_none(more.w) ? turn : turn_by(more.w) * turn) * from);
  store(m.ended.velocity, v);
  store(m.ended.position, x + h * v + more.v);
  const Vec L = in_axes(from, m.inertia.moments, w);
  turned(m, to, m.body->getFlags() & kGyroscopic ? in_axes(to, inverse(m.inertia.moments), L) : w);
}

void BulletEngine::turned(Member &any, Quat to, Vec spin) {
  BulletMember &m = static_cast<BulletMember &>(any);  // links are turned by Bullet
  m.ended = state_of(load(m.ended.position), to, load(m.ended.velocity), spin);
}

void BulletEngine::rest(double h) {
  for (BulletMember *m : bodies_) m->put(m->ended);
  const bool acts = (world->*Opened::actions()).size() > 0;
  before_actions_.clear();
  for (size_t i = 0; acts && i < bodies_.size(); ++i)
    before_actions_.emplace_back(bodies_[i]->body->getLinearVelocity(),
                                 bodies_[i]->body->getAngularVelocity());
  (world->*Opened::act())(static_cast<btScalar>(h));
  for (size_t i = 0; i < bodies_.size(); ++i) {
    BulletMember &m = *bodies_[i];
    if (acts) {
      const auto &[v, w] = before_actions_[i];
      const Vec dv = from_bullet(m.body->getLinearVelocity()) - from_bullet(v);
      const Vec dw = from_bullet(m.body->getAngularVelocity()) - from_bullet(w);
      store(m.ended.velocity, load(m.ended.velocity) + dv);
      store(m.ended.spin, load(m.ended.spin) + dw);
    }
    if (!(dot(m.impulse.v, m.impulse.v) > 0) || !may_sleep(m.body)) continue;
    const auto [speed, spin] = m.idle_limits();
    if (norm(load(m.ended.velocity)) > speed || norm(load(m.ended.spin)) > spin) m.body->activate(true);
  }
  (world->*Opened::idle())(static_cast<btScalar>(h));
  for (BulletMember *m : bodies_) m->next_idle = {0, m->body->getDeactivationTime()};
}

}  // namespace dfm_bullet_detail
