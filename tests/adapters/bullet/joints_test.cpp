// Bodies that Bullet's constraints hold, and multibodies, in a world with soft bodies.
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <gtest/gtest.h>

#include "bullet.h"

namespace {

using namespace test;

// A chain of n balls on ball joints from x = 0 along x.
std::vector<btRigidBody *> chain(Bullet &b, int n, double length, double mass, bool fixed) {
  std::vector<btRigidBody *> links;
  b.world.getSolverInfo().m_numIterations = 200;
  const auto join = [&](btTypedConstraint *c) {
    b.constraints.emplace_back(c);
    b.world.addConstraint(c, true);
  };
  const btVector3 half = bt({0.5 * length, 0, 0});
  for (int i = 0; i < n; ++i) {
    auto *const shape = b.shape<btSphereShape>(btScalar(0.3 * length));
    links.push_back(b.body(shape, mass, {length * (i + 0.5), 0, 0}, {}, {1e-4, 1e-3, 1e-3}));
    if (i > 0) join(new btPoint2PointConstraint(*links[size_t(i) - 1], *links.back(), half, -half));
  }
  if (fixed) join(new btPoint2PointConstraint(*links.front(), -half));
  return links;
}

// A pendulum of three links, hinged about y, hanging from the origin along z; it has 0.3 m links of 1 kg.
struct Pendulum {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  btMultiBody body{3, 0, btVector3(0, 0, 0), true, false};
  Pendulum() {
    world.setGravity(btVector3(0, 0, btScalar(-9.81)));
    const btVector3 inertia = bt({0.01, 0.01, 0.001}), down = bt({0, 0, -0.15});
    for (int i = 0; i < 3; ++i)
      body.setupRevolute(i, 1, inertia, i - 1, btQuaternion::getIdentity(), btVector3(0, 1, 0),
                         i == 0 ? btVector3(0, 0, 0) : down, down, true);
    body.finalizeMultiDof();
    body.setJointPos(0, btScalar(0.4));
    world.addMultiBody(&body);
  }
  ~Pendulum() { world.removeMultiBody(&body); }
};

}  // namespace

// What soft bodies lose in a step the chain has at its end; the joints keep linear momentum to Bullet's own
// rounding. Angular momentum besides as well as its anchors coincide.
TEST(BulletJoints, FreeChainStruckByASoftBall_KeepsMomentumInEachStep) {
  Bullet b({0, 0, 0});
  set_friction(b.soft, 0.5);
  const std::vector<btRigidBody *> links = chain(b, 4, 0.1, 0.5, false);
  const dfm_body ball = soft_ball(b, {0.3, 0.01, 0.15}, {0.3, 0, -2});
  double linear = 0, angular = 0;
  for (int i = 0; i < 200; ++i) {
    Momenta start, end;
    add(start, measure(ball));
    for (const btRigidBody *each : links) b.add_to(start, each);
    b.step();
    add(end, measure(ball));
    for (const btRigidBody *each : links) b.add_to(end, each);
    linear = std::max(linear, apart(start.linear, end.linear) / start.size);
    angular = std::max(angular, apart(start.angular, end.angular) / start.size);
  }
  std::printf("  per step: linear %.2g, angular %.2g\n", linear, angular);
  EXPECT_GT(norm(velocity(links.back())), 0.1);
  EXPECT_LT(linear, kSingle ? 1e-6 : 1e-9);
  EXPECT_LT(angular, kSingle ? 1e-6 : 1e-6);
}

// A hanging chain with a soft ball on it: error of the scheme against a finer step.
TEST(BulletJoints, Chain_ConvergesWithTheStep) {
  const auto end = [](double h) {
    Bullet b;
    b.world.getSolverInfo().m_erp = btScalar(0.8);
    const std::vector<btRigidBody *> links = chain(b, 4, 0.1, 0.5, true);
    soft_ball(b, {0.35, 0, 0.14}, {0, 0, -1}, 2e4, 5);
    b.run(0.16, h);
    return position(links.back());
  };
  const Vec exact = end(1.0 / 16000);
  const double a = apart(end(1e-3), exact), c = apart(end(2.5e-4), exact);
  std::printf("  %.3g m at 1 ms, %.3g m at 0.25 ms\n", a, c);
  EXPECT_LT(a, 2e-3);
  EXPECT_LT(c, 0.4 * a);
}

// A hanging chain of three links, struck by a soft ball at its last one: as a multibody, and as rigid bodies
// on hinges, which are Bullet's two ways to have it.
TEST(BulletJoints, MultibodyStruckByASoftBall_SwingsAsRigidBodiesOnHinges) {
  const auto struck = [](bool multi, double sideways) {
    Context context;
    Pendulum p;
    p.body.setJointPos(0, 0);
    btSphereShape shape(btScalar(0.08));
    std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;
    std::vector<std::unique_ptr<btRigidBody>> links;
    std::vector<std::unique_ptr<btHingeConstraint>> hinges;
    const btVector3 half = bt({0, 0, 0.15}), axis(0, 1, 0);
    if (!multi) p.world.removeMultiBody(&p.body);
    p.world.getSolverInfo().m_numIterations = 200;
    p.body.setCanSleep(false);
    p.body.setLinearDamping(0);  // a multibody has 0.04 by default, a rigid body none
    p.body.setAngularDamping(0);
    for (int i = 0; i < 3; ++i) {
      if (multi) {
        colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&p.body, i));
        colliders.back()->setCollisionShape(&shape);
        p.body.getLink(i).m_collider = colliders.back().get();
        p.world.addCollisionObject(colliders.back().get(), 1, 1);
        continue;
      }
      links.push_back(std::make_unique<btRigidBody>(1, nullptr, &shape, bt({0.01, 0.01, 0.001})));
      links.back()->setCenterOfMassTransform(at({0, 0, -0.15 - 0.3 * i}));
      links.back()->setActivationState(DISABLE_DEACTIVATION);
      p.world.addRigidBody(links.back().get());
      hinges.push_back(i == 0 ? std::make_unique<btHingeConstraint>(*links[0], half, axis)
                              : std::make_unique<btHingeConstraint>(*links[size_t(i) - 1], *links[size_t(i)],
                                                                    -half, half, axis, axis));
      p.world.addConstraint(hinges.back().get(), true);
    }
    btAlignedObjectArray<btQuaternion> turns;
    btAlignedObjectArray<btVector3> places;
    p.body.forwardKinematics(turns, places);
    p.body.updateCollisionObjectWorldTransforms(turns, places);
    const dfm_world soft = make_world(context, {0, 0, -9.81});
    dfm_bullet_def d = dfm_bullet_def_default();
    d.world = &p.world;
    dfm_bullet adapter = 0;
    ok(dfm_bullet_attach(soft, &d, &adapter));
    const dfm_body ball = soft_ball(context, soft, {-0.185, 0, -0.75}, {2, 0, 0});
    for (int i = 0; i < 200; ++i) {
      p.world.setGravity(bt({i % 2 ? sideways : -sideways, 0, -9.81}));
      p.world.stepSimulation(btScalar(1e-3), 0);
      ok(dfm_bullet_last_tick(adapter, nullptr));
    }
    const Vec end =
        multi ? vec(colliders[2]->getWorldTransform().getOrigin()) : vec(links[2]->getCenterOfMassPosition());
    const Vec out = {end[0], end[2], measure(ball).velocity[0]};
    ok(dfm_bullet_detach(adapter));
    for (auto &h : hinges) p.world.removeConstraint(h.get());
    for (auto &l : links) p.world.removeRigidBody(l.get());
    for (auto &c : colliders) p.world.removeCollisionObject(c.get());
    if (!multi) p.world.addMultiBody(&p.body);
    return out;
  };
  for (const double sideways : {0.0, 2000.0}) {  // m/s^2, to and fro in each tick
    const Vec multi = struck(true, sideways), rigid = struck(false, sideways);
    std::printf("  end %.4f %.4f m against %.4f %.4f, ball at %.4f against %.4f m/s\n", multi[0], multi[1],
                rigid[0], rigid[1], multi[2], rigid[2]);
    EXPECT_GT(multi[0], 0.1);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(multi[k], rigid[k], 1e-3) << k;
  }
}

// A multibody swings in a world with an adapter as it does without one.
TEST(BulletJoints, Multibody_SwingsAsWithoutAnAdapter) {
  const auto angles = [](bool attached, bool beside) {
    Context context;
    Pendulum p;
    const dfm_world soft = make_world(context, {0, 0, -9.81});
    dfm_bullet_def d = dfm_bullet_def_default();
    d.world = &p.world;
    dfm_bullet adapter = 0;
    if (attached) ok(dfm_bullet_attach(soft, &d, &adapter));
    btSphereShape shape(btScalar(0.1));
    btRigidBody stone(1, nullptr, &shape, btVector3(1, 1, 1));
    stone.setCenterOfMassTransform(at({5, 0, 0}));
    if (beside) p.world.addRigidBody(&stone);
    for (int i = 0; i < 60; ++i) p.world.stepSimulation(btScalar(1.0 / 64), 16, btScalar(1.0 / 1024));
    if (attached) ok(dfm_bullet_detach(adapter));
    if (beside) p.world.removeRigidBody(&stone);
    return Vec{p.body.getJointPos(0), p.body.getJointPos(1), p.body.getJointPos(2)};
  };
  const Vec without = angles(false, false);
  EXPECT_GT(apart(without, {0.4, 0, 0}), 0.1);
  for (const bool beside : {false, true})  // with a body that takes part, and with none
    EXPECT_LT(apart(angles(true, beside), without), kSingle ? 1e-4 : 1e-9) << beside;
}
