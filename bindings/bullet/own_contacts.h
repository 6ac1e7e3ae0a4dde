// Bullet's contacts among the bodies of a set of its own, as numbers that the dfm_world keeps with the states
// of the bodies: a step is then a function of these alone, also after a restore and where a sub-step is
// repeated. Three things of Bullet's depend on how the world came to where it is, and each is replaced:
//
//   which pairs there are   a box of btDbvtBroadphase is enlarged by earlier motion of the body, and Bullet
//                           joins islands by pairs; here a pair is two present boxes that overlap
//   the order of pairs and  Bullet: order of creation; here: by the numbers of the bodies
//   manifolds
//   points of a manifold    they last from step to step: kept as numbers, put back after a restore
#pragma once
#include <vector>

#include "opened.h"

namespace dfm_bullet_detail {

struct SortedPairs { btSortedOverlappingPairCache pairs; };  // made before the base that gets its address

// All pairs of boxes that overlap now, by sweeping along x; in the order of the bodies.
class OverlapsOfNow : private SortedPairs, public btSimpleBroadphase {
 public:
  explicit OverlapsOfNow(int most_bodies) : btSimpleBroadphase(most_bodies, &pairs) {}
  btBroadphaseProxy *createProxy(const btVector3 &min, const btVector3 &max, int shape, void *object,
                                 int group, int mask, btDispatcher *dispatcher) override;
  void calculateOverlappingPairs(btDispatcher *dispatcher) override;

 private:
  std::vector<btBroadphaseProxy *> by_x_;
  std::vector<btBroadphasePair> now_;
};

// The points of all manifolds. As numbers: how many follow; for each manifold with points the numbers of its
// two bodies and of points, then the points.
class OwnContacts {
 public:
  // The bodies' user indices are their numbers. Room for every pair of a small set, and for kPairsPerBody per
  // body of a large one; what is beyond starts from zero after a restore.
  OwnContacts(btDispatcher &dispatcher, uint32_t moving, uint32_t fixed);
  uint32_t room() const { return room_; }
  void write(double *out, bool last);  // last: are_of_now() compares with them
  bool are_of_now(const double *in) const;
  void restore(const double *in);          // with the next collision
  void collided(btCollisionWorld &world);  // after the world's collision, before its islands

 private:
  btDispatcher &dispatcher_;
  uint32_t room_ = 1;
  std::vector<double> now_{0.0}, next_;
  bool put_ = false;
  void sort();
  void fill();
};

}  // namespace dfm_bullet_detail
