// Bodies of Bullet that come, move, change, sleep and go, while stepSimulation is called as ever.
#include <gtest/gtest.h>

#include "bullet.h"

namespace {

using namespace test;

struct Told : btMotionState {
  btTransform now;
  explicit Told(const btTransform &t) : now(t) {}
  void getWorldTransform(btTransform &t) const override { t = now; }
  void setWorldTransform(const btTransform &t) override { now = t; }
};

int before = 0, after = 0;
void on_before(btDynamicsWorld *, btScalar) { ++before; }
dfm_status left = DFM_OK;
void on_leave(btDynamicsWorld *world, btScalar) {
  left = dfm_bullet_detach(*static_cast<dfm_bullet *>(world->getWorldUserInfo()));
}
void on_after(btDynamicsWorld *world, btScalar) {
  ++after;
  EXPECT_GT(world->getNumCollisionObjects(), 0);  // the world has its content back
}

}  // namespace

// Fixed sub-steps of stepSimulation: 1/60 s in ticks of 1/240 s, one left over for the next call.
TEST(BulletLifecycle, StepSimulation_TicksBothWorlds) {
  Bullet b;
  soft_bed(b);
  btRigidBody *const box = b.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  for (int i = 0; i < 120; ++i)
    EXPECT_EQ(b.world.stepSimulation(btScalar(1.0 / 60), 10, btScalar(1.0 / 240)), 4);
  ok(dfm_bullet_last_tick(b.adapter, nullptr));
  EXPECT_EQ(b.stats().ticks, 480u);
  EXPECT_NEAR(dfm_world_time(b.soft), 2, 1e-6);
  EXPECT_LT(norm(velocity(box)), 0.02);
  EXPECT_GT(position(box)[2], 0.13);
}

// Without soft bodies the adapter changes nothing that one would see: a stack of Bullet's own, beside the
// same one without an adapter.
TEST(BulletLifecycle, RigidScene_IsAsWithoutAnAdapter) {
  const auto top = [](bool attached) {
    Bullet b;
    b.body(b.shape<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)), 0);
    btRigidBody *last = nullptr;
    for (int i = 0; i < 4; ++i) last = b.box({0.1, 0.1, 0.1}, 1, {0.01 * i, 0, 0.1 + 0.21 * i});
    dfm_bullet_def d = dfm_bullet_def_default();
    d.world = &b.world;
    if (!attached) ok(dfm_bullet_detach(b.adapter));
    for (int i = 0; i < 120; ++i) b.world.stepSimulation(btScalar(1.0 / 60), 0);
    if (!attached) ok(dfm_bullet_attach(b.soft, &d, &b.adapter));
    return position(last);
  };
  EXPECT_LT(apart(top(true), top(false)), 2e-3);
  EXPECT_NEAR(top(true)[2], 0.7, 5e-3);
}

TEST(BulletLifecycle, TickCallbacksOfTheCaller_AreCalledAroundTheTick) {
  Bullet b;
  ok(dfm_bullet_detach(b.adapter));
  int info = 0;
  b.world.setInternalTickCallback(on_before, &info, true);
  b.world.setInternalTickCallback(on_after, &info);
  dfm_bullet_def d = dfm_bullet_def_default();
  d.world = &b.world;
  ok(dfm_bullet_attach(b.soft, &d, &b.adapter));
  b.ball(0.1, 1, {0, 0, 1});
  before = after = 0;
  b.world.stepSimulation(btScalar(0.01), 10, btScalar(0.0025));
  EXPECT_EQ(before, 4);
  EXPECT_EQ(after, 4);
  EXPECT_EQ(b.world.getWorldUserInfo(), &info);
}

TEST(BulletLifecycle, DetachBeforeATick_IsRefused) {
  Bullet b;
  ok(dfm_bullet_detach(b.adapter));
  b.world.setInternalTickCallback(on_leave, &b.adapter, true);
  dfm_bullet_def d = dfm_bullet_def_default();
  d.world = &b.world;
  ok(dfm_bullet_attach(b.soft, &d, &b.adapter));
  b.ball(0.1, 1, {0, 0, 1});
  b.step();
  EXPECT_EQ(left, DFM_E_BUSY);
}

TEST(BulletLifecycle, InterruptedTick_IsToldByTheStep) {
  Bullet b;
  const btRigidBody *const ball = b.ball(0.1, 1, {0, 0, 1});
  ok(dfm_world_interrupt(b.soft));
  EXPECT_EQ(dfm_bullet_step(b.adapter, 0.01, 0, 0.01, nullptr), DFM_DISCARD);
  EXPECT_NE(std::string(dfm_last_error()).find("interrupted"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(velocity(ball)[2], 0);
  ok(dfm_bullet_step(b.adapter, 0.01, 0, 0.01, nullptr));
}

TEST(BulletLifecycle, MaskOfAnObject_ChangesInPlace) {
  Bullet b;
  btRigidBody *const box = b.box({0.1, 0.1, 0.1}, 1, {0, 0, 1});
  dfm_obstacle before_it = 0, after_it = 0;
  ok(dfm_bullet_obstacle(b.adapter, box, 0, &before_it));
  box->getBroadphaseHandle()->m_collisionFilterMask = 6;
  ok(dfm_bullet_obstacle(b.adapter, box, 0, &after_it));
  EXPECT_EQ(before_it, after_it) << "rules that name it hold on";
  dfm_obstacle_def d = dfm_obstacle_def_default();
  ok(dfm_obstacle_get_def(after_it, &d));
  EXPECT_EQ(d.collides_with, 6u);
}

TEST(BulletLifecycle, FreeBody_FallsByTheWorldsGravityAndForces) {
  Bullet b;
  btRigidBody *const stone = b.ball(0.1, 2, {0, 0, 5});
  stone->applyCentralForce(btVector3(4, 0, 0));
  for (int call = 0; call < 2; ++call) {  // forces act over all ticks of one call
    EXPECT_EQ(b.world.stepSimulation(btScalar(1.0 / 64), 20, btScalar(1.0 / 1024)), 16);
    EXPECT_NEAR(velocity(stone)[0], 2.0 / 64, 1e-6);
    EXPECT_NEAR(velocity(stone)[2], -9.81 * (call + 1) / 64, 1e-6);
  }
}

TEST(BulletLifecycle, BodyRemovedWhileTouched_EndsItsContacts) {
  Bullet b;
  const dfm_body bed = soft_bed(b);
  btRigidBody *const box = b.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  b.run(0.1);
  EXPECT_GT(stats(b.soft).contacts, 0u);
  b.remove(box);
  b.step();
  EXPECT_EQ(stats(b.soft).contacts, 0u);
  EXPECT_EQ(b.stats().bodies, 0u);
  (void)bed;
}

TEST(BulletLifecycle, RigidOfTheAdapter_IsNotTheCallersToDestroy) {
  Bullet b;
  btRigidBody *const ball = b.ball(0.1, 1, {0, 0, 1});
  b.step();
  EXPECT_EQ(dfm_rigid_destroy(b.rigid(ball)), DFM_E_STATE);
  EXPECT_NE(std::string(dfm_last_error()).find("removeRigidBody"), std::string::npos);
}

TEST(BulletLifecycle, BodyMovedByHand_IsThereAtOnce) {
  Bullet b({0, 0, 0});
  btRigidBody *const ball = b.ball(0.1, 1, {0, 0, 1});
  b.step();
  ball->setCenterOfMassTransform(at({3, 0, 1}));
  ball->setLinearVelocity(btVector3(0, 1, 0));
  b.step();
  EXPECT_LT(apart(position(ball), {3, 1e-3, 1}), 1e-6);
}

// A table that a motion state tells where to be, over ticks of one call, carries a soft ball up with it.
TEST(BulletLifecycle, KinematicBody_LiftsAndGetsNoForce) {
  Bullet b;
  set_friction(b.soft, 0.8);
  Told reported(at({0, 0, -0.1}));
  btRigidBody *const table = b.box({0.3, 0.3, 0.1}, 0, {0, 0, -0.1});
  table->setCollisionFlags(table->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  table->setActivationState(DISABLE_DEACTIVATION);
  table->setMotionState(&reported);
  const dfm_body ball = soft_ball(b, {0, 0, 0.101}, {}, 3e5);
  for (int i = 1; i <= 30; ++i) {
    reported.now = at({0.001 * i, 0, -0.1 + 0.002 * i});
    b.world.stepSimulation(btScalar(1.0 / 60), 10, btScalar(1.0 / 240));
    ok(dfm_bullet_last_tick(b.adapter, nullptr));
  }
  EXPECT_NEAR(position(table)[2], -0.04, 1e-6);
  EXPECT_NEAR(measure(ball).com[2], 0.1 + 0.06, 0.012);
  EXPECT_NEAR(measure(ball).velocity[2], 0.12, 0.05);
  EXPECT_GT(measure(ball).com[0], 0.007);  // it rolls: 2/7 of the way of the table
  table->setMotionState(nullptr);
}

// It sleeps by Bullet's rule, is no obstacle to its own scene, and wakes when a soft body meets it.
TEST(BulletLifecycle, SleepingBody_WakesWhenASoftBodyMeetsIt) {
  Bullet b({0, 0, 0});
  btRigidBody *const target = b.ball(0.1, 1, {0.02, 0, 0.09});
  target->forceActivationState(ISLAND_SLEEPING);
  const dfm_body ball = soft_ball(b, {0, 0, 0.35}, {0, 0, -1});
  b.run(0.02);
  EXPECT_FALSE(target->isActive());
  Momenta start, end;
  add(start, measure(ball));
  b.run(0.1);
  add(end, measure(ball));
  b.add_to(end, target);
  EXPECT_TRUE(target->isActive());
  EXPECT_LT(velocity(target)[2], -0.1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-3 * start.size);  // what it did not feel before it woke
}

// A box at rest on a soft bed falls asleep, and stays where it is.
TEST(BulletLifecycle, BoxAtRestOnASoftBed_FallsAsleep) {
  Bullet b;
  soft_bed(b);
  btRigidBody *const box = b.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  b.run(3.5, 2e-3);
  EXPECT_FALSE(box->isActive());
  const Vec there = position(box);
  b.run(0.5, 2e-3);
  EXPECT_FALSE(box->isActive());
  EXPECT_LT(apart(there, position(box)), 1e-6);
}

// Bullet closes a share of a depth in each step. In short sub-steps that share would be a speed of many m/s.
TEST(BulletLifecycle, BoxInTheFloor_IsNotThrownInShortSubSteps) {
  for (const double young : {1e4, 2e6}) {
    Bullet b;
    b.body(b.shape<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)), 0);
    const btRigidBody *const box = b.box({0.15, 0.15, 0.15}, 10, {5, 0, 0.145});
    soft_ball(b, {0, 0, 5}, {}, young);
    double fastest = 0;
    for (int i = 0; i < 30; ++i) {
      b.step(1.0 / 60);
      fastest = std::max(fastest, velocity(box)[2]);
    }
    EXPECT_GT(stats(b.soft).last_substeps, young > 1e5 ? 100u : 3u);
    EXPECT_LT(fastest, 0.1);  // 0.081 in one step of Bullet's
    EXPECT_NEAR(position(box)[2], 0.15, 2e-3);
    EXPECT_EQ(b.world.getSolverInfo().m_erp2, btScalar(0.2));
  }
}

TEST(BulletLifecycle, LockedAxes_DoNotMove) {
  Bullet b({0, 0, 0});
  btRigidBody *const target = b.box({0.1, 0.1, 0.1}, 1, {0.03, 0.02, 0});
  target->setLinearFactor(btVector3(1, 0, 0));
  target->setAngularFactor(btVector3(0, 0, 0));
  soft_ball(b, {0, 0, 0.205}, {0.5, 0, -1});
  b.run(0.1);
  EXPECT_EQ(velocity(target)[2], 0);
  EXPECT_EQ(norm(spin(target)), 0);
  EXPECT_EQ(position(target)[2], 0);
}

TEST(BulletLifecycle, Restore_TakesTheBodiesBack) {
  Bullet b;
  soft_bed(b);
  btRigidBody *const box = b.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.18});
  b.run(0.05);
  const std::string shot = snapshot(b.soft);
  b.run(0.1);
  const Vec later = position(box);
  ok(dfm_world_restore(b.soft, shot.data(), shot.size()));
  b.run(0.1);
  EXPECT_EQ(later, position(box));
}

// Where a static object is, is Bullet's to say: after a restore its surface comes along again.
TEST(BulletLifecycle, Restore_BringsTheSurfaceOfAMovedObjectToIt) {
  Bullet b;
  btRigidBody *const box = b.box({1, 1, 0.1}, 0, {0, 0, 0});
  b.step();
  const std::string shot = snapshot(b.soft);
  box->setWorldTransform(at({0, 0, 0.0078125}));
  box->getBroadphaseHandle()->m_collisionFilterMask = 6;
  b.step();
  ok(dfm_world_restore(b.soft, shot.data(), shot.size()));
  b.step();
  dfm_obstacle o = 0;
  dfm_pose pose{};
  ok(dfm_bullet_obstacle(b.adapter, box, 0, &o));
  ok(dfm_obstacle_get_pose(o, &pose));
  EXPECT_EQ(pose.position[2], 0.0078125);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  ok(dfm_obstacle_get_def(o, &d));
  EXPECT_EQ(d.collides_with, 6u);
}

TEST(BulletLifecycle, WrongUse_IsReportedInOneSentence) {
  Bullet b;
  dfm_bullet other = 0;
  dfm_bullet_def d = dfm_bullet_def_default();
  EXPECT_EQ(dfm_bullet_attach(b.soft, &d, &other), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("dfm_bullet_def: world is NULL"), std::string::npos);
  d.world = &b.world;
  EXPECT_EQ(dfm_bullet_attach(b.soft, &d, &other), DFM_E_STATE);
  d.real_bytes = kSingle ? 8 : 4;
  EXPECT_EQ(dfm_bullet_attach(b.soft, &d, &other), DFM_E_UNSUPPORTED);
  d.real_bytes = sizeof(btScalar);
  btSimpleDynamicsWorld simple(&b.dispatcher, &b.broadphase, &b.solver, &b.configuration);
  d.world = &simple;
  EXPECT_EQ(dfm_bullet_attach(b.soft, &d, &other), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("btSimpleDynamicsWorld"), std::string::npos);
  EXPECT_EQ(dfm_bullet_step(b.adapter + 1000, 0.01, 0, 0.01, nullptr), DFM_E_HANDLE);
  btRigidBody *const ball = b.ball(0.1, 1, {0, 0, 1});
  b.step();
  uint32_t trouble = 0;
  EXPECT_LT(dfm_world_step(b.soft, 1e-3, &trouble), 0);
  EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
  EXPECT_NE(std::string(dfm_last_error()).find("stepSimulation"), std::string::npos);
  (void)ball;
}

namespace {

struct Counter : btIDebugDraw {
  int lines = 0;
  void drawLine(const btVector3 &, const btVector3 &, const btVector3 &) override { ++lines; }
  void drawContactPoint(const btVector3 &, const btVector3 &, btScalar, int, const btVector3 &) override {}
  void reportErrorWarning(const char *) override {}
  void draw3dText(const btVector3 &, const char *) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return 0; }
};

}  // namespace

// Each edge of a closed surface of n triangles once: 3 n / 2 lines; contacts come on top.
TEST(BulletLifecycle, DebugDraw_DrawsEdgesAndContacts) {
  Bullet b;
  b.box({1, 1, 0.1}, 0, {0, 0, -0.1});
  const dfm_body ball = soft_ball(b, {0, 0, 0.1});
  b.run(0.05);
  EXPECT_EQ(dfm_bullet_debug_draw(b.adapter, 0), DFM_E_STATE);
  Counter counter;
  b.world.setDebugDrawer(&counter);
  uint32_t n = 0;
  ok(dfm_surface_triangles(ball, 0, nullptr, &n));
  ok(dfm_bullet_debug_draw(b.adapter, 0));
  EXPECT_EQ(counter.lines, int(3 * n / 2));
  ok(dfm_bullet_debug_draw(b.adapter, DFM_DRAW_CONTACTS));
  EXPECT_GT(counter.lines, int(3 * n));
  b.world.setDebugDrawer(nullptr);
}
