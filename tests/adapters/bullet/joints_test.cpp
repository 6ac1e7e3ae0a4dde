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
