#include "multi_state.h"

#include <BulletDynamics/Featherstone/btMultiBodyLink.h>

#include <algorithm>

namespace dfm_bullet_detail {

void MultiState::keep(btDiscreteDynamicsWorld &world) {
  count_ = 0;
  auto *const multi = dynamic_cast<btMultiBodyDynamicsWorld *>(&world);
  if (!multi) return;
  count_ = static_cast<size_t>(multi->getNumMultibodies());
  kept_.resize(std::max(kept_.size(), count_));
  for (size_t i = 0; i < count_; ++i) {
    Kept &k = kept_[i];
    k.body = multi->getMultiBody(static_cast<int>(i));
    k.place = k.body->getBasePos();
    k.rotation = k.body->getWorldToBaseRot();
    const btScalar *const v = k.body->getVelocityVector();
    k.velocities.assign(v, v + 6 + k.body->getNumDofs());
    k.joints.clear();
    for (int link = 0; link < k.body->getNumLinks(); ++link) {
      const btScalar *const q = k.body->getJointPosMultiDof(link);
      k.joints.insert(k.joints.end(), q, q + k.body->getLink(link).m_posVarCount);
    }
  }
}

void MultiState::restore() {
  for (size_t i = 0; i < count_; ++i) {
    const Kept &k = kept_[i];
    btMultiBody &b = *k.body;
    b.setBasePos(k.place);
    b.setWorldToBaseRot(k.rotation);
    b.setBaseOmega(btVector3(k.velocities[0], k.velocities[1], k.velocities[2]));
    b.setBaseVel(btVector3(k.velocities[3], k.velocities[4], k.velocities[5]));
    const btScalar *q = k.joints.data(), *v = k.velocities.data() + 6;
    for (int link = 0; link < b.getNumLinks(); ++link) {
      b.setJointPosMultiDof(link, q);
      b.setJointVelMultiDof(link, v);
      q += b.getLink(link).m_posVarCount;
      v += b.getLink(link).m_dofCount;
    }
    b.forwardKinematics(rotations_, origins_);
    b.updateCollisionObjectWorldTransforms(rotations_, origins_);
  }
}

}  // namespace dfm_bullet_detail
