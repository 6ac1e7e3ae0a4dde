// Conversions of Bullet's vectors, and access to protected functions of btDiscreteDynamicsWorld.
#pragma once
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "rigid_host/engine.h"

namespace dfm_bullet_detail {

using namespace dfm_rigid_detail;

inline Vec from_bullet(const btVector3 &a) { return {a.x(), a.y(), a.z()}; }
inline Quat from_bullet(const btQuaternion &q) {
  return unit({q.x(), q.y(), q.z(), q.w()});  // its own unit is one of btScalar
}
inline Pose from_bullet(const btTransform &t) {
  return {from_bullet(t.getOrigin()), from_bullet(t.getRotation())};
}
inline btVector3 to_bullet(Vec a) { return {btScalar(a.x), btScalar(a.y), btScalar(a.z)}; }
inline btQuaternion to_bullet(Quat q) { return {btScalar(q.x), btScalar(q.y), btScalar(q.z), btScalar(q.w)}; }
inline btTransform to_bullet(const Pose &p) {
  return btTransform(to_bullet(p.rotation), to_bullet(p.position));
}

// The stages of a tick (btDiscreteDynamicsWorld::internalSingleStepSimulation) are protected and virtual. A
// derived class may name them, and calls reach the class of the caller's world. No object of it is made.
struct Opened : btDiscreteDynamicsWorld {
  using Stage = void (btDiscreteDynamicsWorld::*)(btScalar);
  static Stage predict() { return &Opened::predictUnconstraintMotion; }
  static Stage find_predictive() { return &Opened::createPredictiveContacts; }
  static auto find_islands() { return &Opened::calculateSimulationIslands; }
  static Stage integrate() { return &Opened::integrateTransforms; }
  static Stage act() { return &Opened::updateActions; }
  static Stage idle() { return &Opened::updateActivationState; }
  static auto bodies() { return &Opened::m_nonStaticRigidBodies; }
  static auto constraints() { return &Opened::m_constraints; }
  static auto actions() { return &Opened::m_actions; }
  static auto predictive() { return &Opened::m_predictiveManifolds; }
  static auto objects() { return &Opened::m_collisionObjects; }
  static auto dispatcher() { return &Opened::m_dispatcher1; }
  static auto broadphase() { return &Opened::m_broadphasePairCache; }
  static auto pre_tick() { return &Opened::m_internalPreTickCallback; }
  static auto tick() { return &Opened::m_internalTickCallback; }
};

// The same of a world with multibodies.
struct OpenedMulti : btMultiBodyDynamicsWorld {
  static auto bodies() { return &OpenedMulti::m_multiBodies; }
  static auto constraints() { return &OpenedMulti::m_multiBodyConstraints; }
};

}  // namespace dfm_bullet_detail
