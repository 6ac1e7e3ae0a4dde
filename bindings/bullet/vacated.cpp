// Placeholders for the broadphase and the dispatcher of a vacated world. They are empty, and no call to them
// needs a result.
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include "adapter.h"

namespace dfm_bullet_detail {
namespace {

class NoPairs : public btBroadphaseInterface {
 public:
  btBroadphaseProxy *createProxy(const btVector3 &, const btVector3 &, int, void *, int, int,
                                 btDispatcher *) override {
    return nullptr;
  }
  void destroyProxy(btBroadphaseProxy *, btDispatcher *) override {}
  void setAabb(btBroadphaseProxy *, const btVector3 &, const btVector3 &, btDispatcher *) override {}
  void getAabb(btBroadphaseProxy *, btVector3 &, btVector3 &) const override {}
  void rayTest(const btVector3 &, const btVector3 &, btBroadphaseRayCallback &, const btVector3 &,
               const btVector3 &) override {}
  void aabbTest(const btVector3 &, const btVector3 &, btBroadphaseAabbCallback &) override {}
  void calculateOverlappingPairs(btDispatcher *) override {}
  btOverlappingPairCache *getOverlappingPairCache() override { return &cache_; }
  const btOverlappingPairCache *getOverlappingPairCache() const override { return &cache_; }
  void getBroadphaseAabb(btVector3 &, btVector3 &) const override {}
  void printStats() override {}

 private:
  btNullPairCache cache_;
};

class NoContacts : public btDispatcher {
 public:
  btCollisionAlgorithm *findAlgorithm(const btCollisionObjectWrapper *, const btCollisionObjectWrapper *,
                                      btPersistentManifold *, ebtDispatcherQueryType) override {
    return nullptr;
  }
  btPersistentManifold *getNewManifold(const btCollisionObject *, const btCollisionObject *) override {
    return nullptr;
  }
  void releaseManifold(btPersistentManifold *) override {}
  void clearManifold(btPersistentManifold *) override {}
  bool needsCollision(const btCollisionObject *, const btCollisionObject *) override { return false; }
  bool needsResponse(const btCollisionObject *, const btCollisionObject *) override { return false; }
  void dispatchAllCollisionPairs(btOverlappingPairCache *, const btDispatcherInfo &,
                                 btDispatcher *) override {}
  int getNumManifolds() const override { return 0; }
  btPersistentManifold *getManifoldByIndexInternal(int) override { return nullptr; }
  btPersistentManifold **getInternalManifoldPointer() override { return nullptr; }
  btPoolAllocator *getInternalManifoldPool() override { return nullptr; }
  const btPoolAllocator *getInternalManifoldPool() const override { return nullptr; }
  void *allocateCollisionAlgorithm(int) override { return nullptr; }
  void freeCollisionAlgorithm(void *) override {}
};

template <class T>
void move(btAlignedObjectArray<T> &from, btAlignedObjectArray<T> &to) {
  to.copyFromArray(from);
  from.resize(0);
}

}  // namespace

Vacated::Vacated(btDiscreteDynamicsWorld &world)
    : world_(world),
      multi_(dynamic_cast<btMultiBodyDynamicsWorld *>(&world)),
      dispatcher_(world.*Opened::dispatcher()),
      broadphase_(world.*Opened::broadphase()) {
  static NoPairs no_pairs;
  static NoContacts no_contacts;
  move(world.*Opened::bodies(), bodies_);
  move(world.*Opened::constraints(), constraints_);
  move(world.*Opened::actions(), actions_);
  move(world.*Opened::predictive(), predictive_);
  move(world.*Opened::objects(), objects_);
  if (multi_) {
    move(multi_->*OpenedMulti::bodies(), multi_bodies_);
    move(multi_->*OpenedMulti::constraints(), multi_constraints_);
  }
  world.*Opened::dispatcher() = &no_contacts;
  world.*Opened::broadphase() = &no_pairs;
}

Vacated::~Vacated() {
  world_.*Opened::broadphase() = broadphase_;
  world_.*Opened::dispatcher() = dispatcher_;
  if (multi_) {
    move(multi_bodies_, multi_->*OpenedMulti::bodies());
    move(multi_constraints_, multi_->*OpenedMulti::constraints());
  }
  move(objects_, world_.*Opened::objects());
  move(predictive_, world_.*Opened::predictive());
  move(actions_, world_.*Opened::actions());
  move(constraints_, world_.*Opened::constraints());
  move(bodies_, world_.*Opened::bodies());
}

}  // namespace dfm_bullet_detail
