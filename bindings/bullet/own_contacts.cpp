#include "own_contacts.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace dfm_bullet_detail {
namespace {

constexpr uint32_t kPairsPerBody = 6;
constexpr size_t kHead = 3, kPoint = 16;  // numbers per manifold and per point
constexpr size_t kManifold = kHead + MANIFOLD_CACHE_SIZE * kPoint;

bool before(const btBroadphasePair &a, const btBroadphasePair &b) {
  return std::pair(a.m_pProxy0->getUid(), a.m_pProxy1->getUid()) <
         std::pair(b.m_pProxy0->getUid(), b.m_pProxy1->getUid());
}

bool may_touch(const btBroadphaseProxy &a, const btBroadphaseProxy &b) {
  const auto is_static = [](const btBroadphaseProxy &p) {
    return static_cast<const btCollisionObject *>(p.m_clientObject)->isStaticOrKinematicObject();
  };
  return (a.m_collisionFilterGroup & b.m_collisionFilterMask) != 0 &&
         (b.m_collisionFilterGroup & a.m_collisionFilterMask) != 0 && !(is_static(a) && is_static(b));
}

std::pair<int, int> bodies_of(const btPersistentManifold &m) {
  return {m.getBody0()->getUserIndex(), m.getBody1()->getUserIndex()};
}

constexpr double kMax = 1e9;
// A count, or the number of a body, from a snapshot; -1: it is out of range (a snapshot of another program).
int number(double x, double most) { return x >= 0 && x <= most ? int(x) : -1; }

// Leaves out what Bullet computes anew in each step (places in the world, directions of friction) and what
// the bodies of a set do not have (rolling friction, restitution, softness).
void write_point(const btManifoldPoint &p, std::vector<double> &out) {
  for (const btVector3 *v : {&p.m_localPointA, &p.m_localPointB, &p.m_normalWorldOnB})
    out.insert(out.end(), {double(v->x()), double(v->y()), double(v->z())});
  out.insert(out.end(), {double(p.m_distance1), double(p.m_combinedFriction), double(p.m_appliedImpulse),
                         double(p.m_prevRHS), double(p.m_appliedImpulseLateral1),
                         double(p.m_appliedImpulseLateral2), double(p.m_lifeTime)});
}

btManifoldPoint point_of(const double *in) {
  const auto vector = [&](size_t at) {
    return btVector3(btScalar(in[at]), btScalar(in[at + 1]), btScalar(in[at + 2]));
  };
  btManifoldPoint p(vector(0), vector(3), vector(6), btScalar(in[9]));
  p.m_combinedFriction = btScalar(in[10]);
  p.m_appliedImpulse = btScalar(in[11]);
  p.m_prevRHS = btScalar(in[12]);
  p.m_appliedImpulseLateral1 = btScalar(in[13]);
  p.m_appliedImpulseLateral2 = btScalar(in[14]);
  p.m_lifeTime = std::max(number(in[15], kMax), 0);
  return p;
}

}  // namespace

btBroadphaseProxy *OverlapsOfNow::createProxy(const btVector3 &min, const btVector3 &max, int shape,
                                              void *object, int group, int mask, btDispatcher *dispatcher) {
  btBroadphaseProxy *const made =
      btSimpleBroadphase::createProxy(min, max, shape, object, group, mask, dispatcher);
  made->m_uniqueId = static_cast<btCollisionObject *>(object)->getUserIndex();
  return made;
}

void OverlapsOfNow::calculateOverlappingPairs(btDispatcher *dispatcher) {
  by_x_.clear();
  for (int i = 0; i <= m_LastHandleIndex; ++i)
    if (m_pHandles[i].m_clientObject) by_x_.push_back(&m_pHandles[i]);
  std::sort(by_x_.begin(), by_x_.end(), [](const btBroadphaseProxy *a, const btBroadphaseProxy *b) {
    return std::pair(a->m_aabbMin.x(), a->getUid()) < std::pair(b->m_aabbMin.x(), b->getUid());
  });
  now_.clear();
  for (size_t i = 0; i < by_x_.size(); ++i)
    for (size_t j = i + 1; j < by_x_.size() && by_x_[j]->m_aabbMin.x() <= by_x_[i]->m_aabbMax.x(); ++j)
      if (testAabbOverlap(by_x_[i], by_x_[j]) && may_touch(*by_x_[i], *by_x_[j]))
        now_.emplace_back(*by_x_[i], *by_x_[j]);
  std::sort(now_.begin(), now_.end(), before);
  btBroadphasePairArray &was = pairs.getOverlappingPairArray();
  size_t at = 0;
  for (int i = 0; i < was.size(); ++i) {
    while (at < now_.size() && before(now_[at], was[i])) ++at;
    if (at < now_.size() && !before(was[i], now_[at])) now_[at].m_algorithm = was[i].m_algorithm;
    else pairs.cleanOverlappingPair(was[i], dispatcher);
  }
  was.resizeNoInitialize(0);
  for (const btBroadphasePair &pair : now_) was.push_back(pair);
}

OwnContacts::OwnContacts(btDispatcher &dispatcher, uint32_t moving, uint32_t fixed)
    : dispatcher_(dispatcher) {
  const uint64_t n = moving, all = n * (n > 0 ? n - 1 : 0) / 2 + n * fixed;
  room_ += static_cast<uint32_t>(std::min<uint64_t>(all, n * kPairsPerBody) * kManifold);
}

void OwnContacts::write(double *out, bool last) {
  next_.assign(1, 0);
  btPersistentManifold **const manifolds = dispatcher_.getInternalManifoldPointer();
  for (int i = 0, n = dispatcher_.getNumManifolds(); i < n; ++i) {
    const btPersistentManifold &m = *manifolds[i];
    const auto points = static_cast<size_t>(m.getNumContacts());
    if (points == 0) continue;
    if (next_.size() + kHead + points * kPoint > room_) break;
    const auto [a, b] = bodies_of(m);
    next_.insert(next_.end(), {double(a), double(b), double(points)});
    for (int k = 0; k < m.getNumContacts(); ++k) write_point(m.getContactPoint(k), next_);
  }
  next_[0] = double(next_.size() - 1);
  std::copy(next_.begin(), next_.end(), out);
  std::fill(out + next_.size(), out + room_, 0.0);
  if (last) now_.swap(next_);
}

bool OwnContacts::are_of_now(const double *in) const {
  return std::memcmp(in, now_.data(), now_.size() * sizeof(double)) == 0;
}

void OwnContacts::restore(const double *in) {
  const int n = number(in[0], double(room_ - 1));
  now_.assign(in, in + 1 + std::max(n, 0));
  put_ = true;
}

void OwnContacts::collided(btCollisionWorld &world) {
  if (std::exchange(put_, false)) {
    fill();
    world.performDiscreteCollisionDetection();
  }
  sort();
}

// Here every pair has its manifold, with points of this collision only.
void OwnContacts::fill() {
  sort();
  btPersistentManifold **const manifolds = dispatcher_.getInternalManifoldPointer();
  const int n = dispatcher_.getNumManifolds();
  for (int i = 0; i < n; ++i) manifolds[i]->clearManifold();
  for (size_t at = 1; at + kHead <= now_.size();) {
    const std::pair bodies(number(now_[at], kMax), number(now_[at + 1], kMax));
    const int points = number(now_[at + 2], MANIFOLD_CACHE_SIZE);
    at += kHead;
    if (points <= 0 || at + size_t(points) * kPoint > now_.size()) return;
    btPersistentManifold **const found = std::lower_bound(
        manifolds, manifolds + n, bodies,
        [](const btPersistentManifold *m, const std::pair<int, int> &x) { return bodies_of(*m) < x; });
    if (found != manifolds + n && bodies_of(**found) == bodies) {
      (*found)->setNumContacts(points);
      for (int k = 0; k < points; ++k)
        (*found)->getContactPoint(k) = point_of(&now_[at + size_t(k) * kPoint]);
    }
    at += size_t(points) * kPoint;
  }
}

// Sorts the list of manifolds: the solver uses its order.
void OwnContacts::sort() {
  btPersistentManifold **const manifolds = dispatcher_.getInternalManifoldPointer();
  const int n = dispatcher_.getNumManifolds();
  std::sort(manifolds, manifolds + n, [](const btPersistentManifold *a, const btPersistentManifold *b) {
    return bodies_of(*a) < bodies_of(*b);
  });
  for (int i = 0; i < n; ++i) manifolds[i]->m_index1a = i;  // where the dispatcher looks for it
}

}  // namespace dfm_bullet_detail
