// What the caller does to ODE's world between two steps: things come, go, move, fall asleep, and soft
// bodies take notice.
#include <gtest/gtest.h>

#include <cstring>

#include "obstacle.h"
#include "ode.h"

namespace {

using namespace test;

double height(dfm_body b) { return measure(b).com[2]; }

// A soft ball at rest on a rigid plate of 4 kg that a hinge-free column would not hold: it stands
// on ODE's plane.
struct OnAPlate {
  Ode ode;
  dGeomID floor;
  dBodyID plate;
  dfm_body ball;
  OnAPlate() {
    set_friction(ode.soft, 0.8);
    floor = dCreatePlane(ode.space, 0, 0, 1, 0);
    plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, 0.05});
    ball = soft_ball(ode, {0, 0, 0.203}, {}, 3e4, 30);
    ode.run(0.3);
  }
};

// On the bed; on a hinge a weight that has no geom, which is returned.
dBodyID box_with_a_weight(Ode &ode) {
  const dBodyID box = ode.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.16});
  const dBodyID weight = ode.body(0.5, {1e-3, 1e-3, 1e-3}, {0.15, 0.2, 0.3});
  const dJointID hinge = dJointCreateHinge(ode.world, nullptr);
  dJointAttach(hinge, box, weight);
  dJointSetHingeAnchor(hinge, 0.15, 0.15, 0.25);
  dJointSetHingeAxis(hinge, 1, 0, 0);
  return weight;
}

}  // namespace

TEST(OdeLifecycle, GeomDestroyedWhileTouched_EndsItsContacts) {
  OnAPlate s;
  ASSERT_GT(stats(s.ode.soft).contacts, 0u);
  EXPECT_NEAR(height(s.ball), 0.19, 0.02);
  dGeomDestroy(dBodyGetFirstGeom(s.plate));
  s.ode.step();
  EXPECT_EQ(s.ode.stats().bodies, 0u);
  EXPECT_EQ(s.ode.stats().shapes, 1u);
  s.ode.run(0.3);  // down to the plane
  EXPECT_LT(height(s.ball), 0.12);
  EXPECT_GT(height(s.ball), 0.05);
}

TEST(OdeLifecycle, BodyDestroyedWhileTouched_LeavesItsGeomInTheWorld) {
  OnAPlate s;
  const dGeomID g = dBodyGetFirstGeom(s.plate);
  dBodyDestroy(s.plate);
  s.ode.run(0.1);
  EXPECT_EQ(s.ode.stats().bodies, 0u);
  EXPECT_EQ(s.ode.stats().shapes, 2u);
  EXPECT_NEAR(height(s.ball), 0.19, 0.02);  // ODE's rule: a geom without a body stands where it is
  dGeomDestroy(g);
  s.ode.run(0.25);
  EXPECT_LT(height(s.ball), 0.12);
}

// What stands for ODE's bodies is the adapter's: the caller cannot take it away, and nothing has happened
// where he tried.
TEST(OdeLifecycle, RigidOfTheAdapter_IsNotTheCallersToDestroy) {
  OnAPlate s;
  dfm_rigid r = 0;
  ok(dfm_ode_rigid(s.ode.adapter, s.plate, &r));
  EXPECT_EQ(dfm_rigid_destroy(r), DFM_E_STATE);
  const std::string why = dfm_last_error();
  EXPECT_NE(why.find("dBodyDestroy"), std::string::npos) << why;
  s.ode.run(0.02);
  EXPECT_EQ(s.ode.stats().bodies, 1u);
  EXPECT_EQ(rigid_measure(r).mass, 4.0);
}

// A shape's obstacle may go: then its geom takes no part, and the adapter works on.
TEST(OdeLifecycle, ObstacleDestroyedByTheCaller_LeavesTheAdapterAtWork) {
  OnAPlate s;
  dfm_obstacle shape = 0, plane = 0;
  ok(dfm_ode_obstacle(s.ode.adapter, dBodyGetFirstGeom(s.plate), &shape));
  ok(dfm_ode_obstacle(s.ode.adapter, s.floor, &plane));
  ok(dfm_obstacle_destroy(shape));
  ok(dfm_obstacle_destroy(plane));
  s.ode.run(0.02);
  dGeomPlaneSetParams(s.floor, 0, 0, 1, -0.1);
  dGeomDestroy(dBodyGetFirstGeom(s.plate));
  s.ode.run(0.02);
  EXPECT_EQ(s.ode.stats().bodies, 0u);
}

TEST(OdeLifecycle, BitsOfAGeom_ChangeInPlace) {
  OnAPlate s;
  const dGeomID shape = dBodyGetFirstGeom(s.plate);
  for (const dGeomID g : {s.floor, shape}) {
    dfm_obstacle before = 0, after = 0;
    ok(dfm_ode_obstacle(s.ode.adapter, g, &before));
    dGeomSetCollideBits(g, 6);
    ok(dfm_ode_obstacle(s.ode.adapter, g, &after));
    EXPECT_EQ(before, after) << "rules that name it hold on";
    dfm_obstacle_def d = dfm_obstacle_def_default();
    ok(dfm_obstacle_get_def(after, &d));
    EXPECT_EQ(d.collides_with, 6u);
  }
  ASSERT_GT(stats(s.ode.soft).contacts, 0u);
  dGeomSetCollideBits(shape, 0);
  dGeomSetCategoryBits(shape, 0);
  s.ode.run(0.02);
  EXPECT_EQ(stats(s.ode.soft).contacts, 0u);
}

namespace {

struct Asked {
  dfm_ode adapter = 0;
  int calls = 0, wrong = 0;
};
void ask(void *data, dGeomID a, dGeomID b) {
  Asked &asked = *static_cast<Asked *>(data);
  dfm_obstacle o = 0;
  dfm_ode_geom props{};
  ++asked.calls;
  for (const dfm_status s :
       {dfm_ode_obstacle(asked.adapter, a, &o), dfm_ode_set_geom(asked.adapter, a, &props),
        dfm_ode_step(asked.adapter, 1e-3), dfm_ode_detach(asked.adapter)})
    asked.wrong += s != DFM_E_BUSY;
  asked.wrong += dfm_ode_contact(asked.adapter, a, b, nullptr) != DFM_OK;
}

}  // namespace

TEST(OdeLifecycle, CallsFromTheNearCallback_AreRefusedButForContact) {
  Asked asked;
  Ode ode({0, 0, -9.81}, 0, ask, &asked);
  asked.adapter = ode.adapter;
  dCreatePlane(ode.space, 0, 0, 1, 0);
  ode.ball(0.1, 1, {0, 0, 0.1});
  ode.run(0.01);
  EXPECT_GT(asked.calls, 0);
  EXPECT_EQ(asked.wrong, 0);
}

// A body and a geom at the addresses of destroyed ones are new ones.
TEST(OdeLifecycle, ReplacedBody_IsANewOne) {
  Ode ode({0, 0, 0});
  for (int i = 0; i < 20; ++i) {
    const dBodyID b = ode.ball(0.1 + 0.01 * i, 1 + i, {double(i), 0, 0}, {0, 0, 1});
    ode.step();
    EXPECT_EQ(ode.stats().bodies, 1u);
    EXPECT_NEAR(position(b)[2], 1e-3, 1e-15);
    dfm_rigid r = 0;
    ok(dfm_ode_rigid(ode.adapter, b, &r));
    EXPECT_EQ(rigid_measure(r).mass, 1.0 + i);
    dGeomDestroy(dBodyGetFirstGeom(b));
    dBodyDestroy(b);
  }
}

TEST(OdeLifecycle, GeomsThatComeAndChange_AreSeenInTheNextStep) {
  Ode ode;
  const dfm_body ball = soft_ball(ode, {0, 0, 0.15}, {}, 3e4, 30);
  const dGeomID box = dCreateBox(ode.space, 1, 1, 0.02);
  ode.run(0.1);
  EXPECT_GT(height(ball), 0.08);
  dGeomBoxSetLengths(box, 1, 1, 0.06);  // thicker by 2 cm on each side, at once: pushed out
  ode.run(0.5);
  EXPECT_GT(height(ball), 0.11);
  dGeomSetPosition(box, 5, 0, -1);  // gone
  dGeomDestroy(box);
  ode.run(0.1);
  EXPECT_LT(height(ball), 0.1);
}

TEST(OdeLifecycle, KinematicBody_LiftsAndGetsNoForce) {
  Ode ode;
  const dBodyID lift = ode.box({0.2, 0.2, 0.05}, 1, {0, 0, -0.05});
  dBodySetKinematic(lift);
  dBodySetLinearVel(lift, 0, 0, 0.1);
  const dfm_body ball = soft_ball(ode, {0, 0, 0.101}, {0, 0, 0.1}, 3e4, 30);
  ode.run(0.8);
  EXPECT_NEAR(position(lift)[2], -0.05 + 0.08, 1e-12);
  EXPECT_NEAR(measure(ball).velocity[2], 0.1, 0.01);
  EXPECT_GT(height(ball), 0.15);
  dBodySetDynamic(lift);
  ode.run(0.1);
  EXPECT_LT(velocity(lift)[2], -0.5);  // falls, with the ball
}

// A kinematic body that the caller moves without a velocity, as a geom without a body: the surface comes
// along within the step.
TEST(OdeLifecycle, GeomMovedByHand_CarriesByFriction) {
  Ode ode;
  set_friction(ode.soft, 0.9);
  const dGeomID belt = dCreateBox(ode.space, 2, 0.6, 0.1);
  dGeomSetPosition(belt, 0, 0, -0.05);
  const dfm_body ball = soft_ball(ode, {0, 0, 0.1}, {}, 3e4, 0);
  ode.run(0.2);
  for (int i = 1; i <= 400; ++i) {
    dGeomSetPosition(belt, 0.5 * 0.5e-3 * 1e-3 * i * i, 0, -0.05);
    ode.step();  // 0.5 m/s2
  }
  EXPECT_GT(measure(ball).velocity[0], 0.02);
  const dfm_obstacle none = 0;
  dfm_obstacle o = none;
  ok(dfm_ode_obstacle(ode.adapter, belt, &o));
  dfm_pose pose;
  ok(dfm_obstacle_get_pose(o, &pose));
  EXPECT_NEAR(pose.position[0], dGeomGetPosition(belt)[0], 1e-15);
}

TEST(OdeLifecycle, BodyMovedByHand_IsThereAtOnce) {
  OnAPlate s;
  dBodySetPosition(s.plate, 3, 0, 0.05);
  dBodySetLinearVel(s.plate, 0, 0, 0);
  s.ode.run(0.02);
  EXPECT_NEAR(position(s.plate)[0], 3, 1e-3);
  EXPECT_EQ(stats(s.ode.soft).contacts, 0u);
  s.ode.run(0.25);
  EXPECT_LT(height(s.ball), 0.12);
}

TEST(OdeLifecycle, DisabledBody_StaysUntilSomethingTouchesIt) {
  Ode ode;
  const dBodyID box = ode.box({0.1, 0.1, 0.1}, 1, {0, 0, 0});
  dBodyDisable(box);
  const dfm_body ball = soft_ball(ode, {0, 0, 0.25}, {}, 3e4);
  ode.run(0.05);
  EXPECT_EQ(position(box)[2], 0);  // hangs in the air, as ODE has it
  EXPECT_FALSE(dBodyIsEnabled(box));
  ode.run(0.15);
  EXPECT_TRUE(dBodyIsEnabled(box));
  EXPECT_LT(velocity(box)[2], -0.1);
  EXPECT_LT(height(ball), 0.2);
}

// It stands still in the solve, and its load and weight are in balance: nothing wakes it until that changes.
TEST(OdeLifecycle, DisabledBoxOnASoftBed_WakesWhenItsLoadChanges) {
  Ode ode;
  soft_bed(ode);
  const dBodyID box = ode.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  ode.run(3);
  dBodyDisable(box);
  const double rest = position(box)[2];
  dfm_rigid rigid = 0;
  ok(dfm_ode_rigid(ode.adapter, box, &rigid));
  double force[3], moment[3];
  ode.run(0.3);
  EXPECT_FALSE(dBodyIsEnabled(box));
  EXPECT_EQ(position(box)[2], rest);
  ok(dfm_rigid_contact_wrench(rigid, force, moment));
  EXPECT_NEAR(force[2], 2 * 9.81, 0.01 * 2 * 9.81);
  soft_ball(ode, {0.15, 0.15, rest + 0.17}, {0, 0, -1});
  ode.run(0.06);
  EXPECT_TRUE(dBodyIsEnabled(box));
  EXPECT_LT(position(box)[2], rest - 1e-4);
}

// ODE lets only bodies with joints fall asleep: here those of the contact with its plane. What they carried
// stays carried.
TEST(OdeLifecycle, AutoDisabledPlate_SleepsUnderABallAndWakesWithoutIt) {
  Ode ode;
  dWorldSetAutoDisableFlag(ode.world, 1);
  dWorldSetAutoDisableSteps(ode.world, 20);
  dWorldSetAutoDisableTime(ode.world, 0);
  set_friction(ode.soft, 0.8);
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, 0.05});
  const dfm_body ball = soft_ball(ode, {0, 0, 0.203}, {}, 3e4, 30);
  ode.run(1);
  EXPECT_FALSE(dBodyIsEnabled(plate));
  dfm_rigid rigid = 0;
  ok(dfm_ode_rigid(ode.adapter, plate, &rigid));
  double force[3], moment[3];
  ok(dfm_rigid_contact_wrench(rigid, force, moment));
  EXPECT_NEAR(force[2], -measure(ball).mass * 9.81, 0.02 * measure(ball).mass * 9.81);
  ode.run(0.3);
  EXPECT_FALSE(dBodyIsEnabled(plate));
  ok(dfm_body_destroy(ball));
  bool woke = false;
  for (int i = 0; i < 50; ++i) {
    ode.step();
    woke |= bool(dBodyIsEnabled(plate));
  }
  EXPECT_TRUE(woke);
}

// What strikes far away makes the guard solve again: a sleeper counts each sub-step once nevertheless.
TEST(OdeLifecycle, SleeperThatIsPushed_WakesAsSoonWhetherTheGuardSolvesAgainOrNot) {
  int woke[2];
  for (const bool strikes : {false, true}) {
    Ode ode({0, 0, 0});
    const dBodyID plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, 0});
    dBodySetAutoDisableLinearThreshold(plate, 0.1);
    soft_ball(ode, {0, 0, 0.152}, {0, 0, -0.3});
    dBodyDisable(plate);
    add_mesh(ode.soft, "ground", height_field(0.5, 20, [](double x, double y) {
               return 0.01 * std::sin(60 * x) * std::sin(60 * y) - 5;
             }));
    const char *const names[] = {"a", "b"};
    for (int i = 0; i < 2 && strikes; ++i) {
      BodyOptions o;
      o.name = names[i];
      o.position = {0, 0, -4.98 + 0.2 * i};
      o.velocity = {3, 1, -20};
      make_body(ode.context, ode.soft, "beam", {0.1, 0.1, 0.1}, 40, o);
    }
    int &steps = woke[strikes] = 0;
    for (; !dBodyIsEnabled(plate) && steps < 300; ++steps) ode.step();
    EXPECT_EQ(stats(ode.soft).guard_solves > 0, strikes);
  }
  EXPECT_EQ(woke[0], woke[1]);
  EXPECT_LT(woke[0], 300);
}

// ODE counts steps until it disables a body that is slow. Where a stiff soft body divides the step into
// hundreds, ten of them pass before a body that begins to fall is faster than the threshold.
TEST(OdeLifecycle, LinkedBodiesThatBeginToFall_StayAwakeInShortSubSteps) {
  Ode ode;
  dWorldSetAutoDisableFlag(ode.world, 1);
  const dBodyID a = ode.ball(0.1, 10, {5, 0, 2}), b = ode.ball(0.1, 10, {5.3, 0, 2});
  const dJointID link = dJointCreateBall(ode.world, nullptr);
  dJointAttach(link, a, b);
  dJointSetBallAnchor(link, 5.15, 0, 2);
  soft_ball(ode, {0, 0, 5}, {}, 4e6);
  ode.run(0.2, 1.0 / 60);
  ASSERT_GT(stats(ode.soft).last_substeps, 200u);
  EXPECT_TRUE(dBodyIsEnabled(a));
  EXPECT_NEAR(position(a)[2], 2 - 0.5 * 9.81 * 0.04, 0.02);
}

// ODE closes a share of a depth in each step. In short sub-steps that share would be a speed of many m/s.
TEST(OdeLifecycle, BoxInTheFloor_IsNotThrownInShortSubSteps) {
  for (const double young : {1e4, 2e6}) {
    Ode ode;
    dCreatePlane(ode.space, 0, 0, 1, 0);
    const dBodyID box = ode.box({0.15, 0.15, 0.15}, 10, {5, 0, 0.145});
    soft_ball(ode, {0, 0, 5}, {}, young);
    double fastest = 0;
    for (int i = 0; i < 30; ++i) {
      ode.step(1.0 / 60);
      fastest = std::max(fastest, velocity(box)[2]);
    }
    EXPECT_GT(stats(ode.soft).last_substeps, young > 1e5 ? 100u : 3u);
    EXPECT_LT(fastest, 0.2 * 0.005 * 60);  // as in one step of ODE
    EXPECT_NEAR(position(box)[2], 0.15, 1e-3);
    EXPECT_EQ(dWorldGetERP(ode.world), 0.2);
  }
}

// What hangs on something awake does not sleep, idle as it is: asleep it would stand still in the solve while
// ODE moves it without its load.
TEST(OdeLifecycle, PlateWithASwingingPendulum_StaysAwakeUntilThatHangsStill) {
  Ode ode;
  dWorldSetAutoDisableFlag(ode.world, 1);
  dWorldSetAutoDisableSteps(ode.world, 20);
  dWorldSetAutoDisableTime(ode.world, 0);
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, 0.05});
  const dBodyID bob = ode.body(0.01, {1e-5, 1e-5, 1e-5}, {0.3, 0.03, -0.1});
  soft_ball(ode, {0, 0, 0.203}, {}, 3e4, 30);
  const dJointID hinge = dJointCreateHinge(ode.world, nullptr);
  dJointAttach(hinge, plate, bob);
  dJointSetHingeAnchor(hinge, 0.3, 0, 0.05);
  dJointSetHingeAxis(hinge, 1, 0, 0);
  for (int i = 0; i < 800; ++i) {
    ode.step();
    ASSERT_TRUE(dBodyIsEnabled(plate) && dBodyIsEnabled(bob)) << i;
  }
  dBodySetAngularDamping(bob, 0.2);
  dBodySetAngularDampingThreshold(bob, 0);
  ode.run(1);
  EXPECT_FALSE(dBodyIsEnabled(plate));
  EXPECT_FALSE(dBodyIsEnabled(bob));
}

// A sleeping plate that a soft ball leans on is struck by a rigid one: in that very sub-step it takes the
// impulses of both.
TEST(OdeLifecycle, SleepingPlateStruckByARigidBall_IsAwakeInTheSolveAtOnce) {
  Ode ode({0, 0, 0});
  const dfm_body ball = soft_ball(ode, {0, 0, 0}, {0, 0, -0.005});
  const double low = lowest(ball);
  const dBodyID plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, low - 0.0502});
  const dBodyID striker = ode.ball(0.05, 3, {0.1, 0, low - 0.2302}, {0, 0, 1});
  dBodyDisable(plate);
  for (int i = 0; i < 200 && !dBodyIsEnabled(plate); ++i) {
    Momenta start, end;
    add(start, ball);
    add(start, plate);
    add(start, striker);
    ode.step();
    if (!dBodyIsEnabled(plate)) continue;
    add(end, ball);
    add(end, plate);
    add(end, striker);
    dfm_rigid rigid = 0;
    ok(dfm_ode_rigid(ode.adapter, plate, &rigid));
    double force[3], moment[3];
    ok(dfm_rigid_contact_wrench(rigid, force, moment));
    EXPECT_LT(force[2], 0);
    EXPECT_GT(velocity(plate)[2], 0.1);
    EXPECT_LT(apart(start.linear, end.linear), 1e-14 * start.size);
  }
  EXPECT_TRUE(dBodyIsEnabled(plate));
}

// The forces that a body has when dfm_ode_step is called act over all of its sub-steps.
TEST(OdeLifecycle, ForcesOfTheCaller_ActOverTheWholeStep) {
  Ode ode({0, 0, 0});
  soft_ball(ode, {5, 0, 0}, {}, 1e6);
  const dBodyID free = ode.ball(0.1, 2, {0, 0, 0}), other = ode.body(2, {1, 1, 1}, {1, 0, 0});
  const dJointID tie = dJointCreateFixed(ode.world, nullptr);
  dJointAttach(tie, free, other);
  dJointSetFixed(tie);
  dBodyAddForce(free, 3, 0, 0);
  dBodyAddForce(other, 1, 0, 0);  // `other` has no geom: it is known through the joint
  ode.step(0.02);
  ASSERT_GT(stats(ode.soft).last_substeps, 5u);
  EXPECT_NEAR(velocity(free)[0], 0.02, 1e-9);
  EXPECT_NEAR(velocity(other)[0], 0.02, 1e-9);
  ode.step(0.02);
  EXPECT_NEAR(velocity(free)[0], 0.02, 1e-9);
}

TEST(OdeLifecycle, MassOfALiveBody_CountsFromTheNextStep) {
  Ode ode({0, 0, 0});
  const dBodyID b = ode.ball(0.1, 1, {0, 0, 0});
  const dfm_body ball = soft_ball(ode, {0, 0, 0.205}, {0, 0, -1});
  ode.step();
  dMass m;
  dMassSetSphereTotal(&m, 50, 0.1);
  dBodySetMass(b, &m);
  Momenta start, end;
  add(start, ball);
  add(start, b);
  ode.run(0.1);
  add(end, ball);
  add(end, b);
  EXPECT_LT(velocity(b)[2], -0.05);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
}

// A restored world continues as it did the first time, and takes ODE's bodies with it.
TEST(OdeLifecycle, Restore_TakesTheBodiesBack) {
  Ode ode;
  soft_bed(ode);
  const dBodyID box = ode.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.17});
  dBodySetAngularVel(box, 0.3, 1, 0.2);
  ode.run(0.2);
  const std::string shot = snapshot(ode.soft);
  ode.run(0.1);
  const uint64_t hash = dfm_world_hash(ode.soft);
  const Vec there = position(box);
  ok(dfm_world_restore(ode.soft, shot.data(), shot.size()));
  ode.run(0.1);
  EXPECT_EQ(dfm_world_hash(ode.soft), hash);
  EXPECT_EQ(position(box), there);
}

// Auto-disable counts in the state that is restored: the plate falls asleep at the same step again, and one
// that slept sleeps.
TEST(OdeLifecycle, Restore_TakesSleepAndItsCountersBack) {
  Ode ode;
  dWorldSetAutoDisableFlag(ode.world, 1);
  dWorldSetAutoDisableSteps(ode.world, 40);
  dWorldSetAutoDisableTime(ode.world, 0);
  set_friction(ode.soft, 0.8);
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID plate = ode.box({0.2, 0.2, 0.05}, 4, {0, 0, 0.05});
  soft_ball(ode, {0, 0, 0.203}, {}, 3e4, 30);
  std::string before = snapshot(ode.soft), awake;
  int fell = 0;
  for (; dBodyIsEnabled(plate) && fell < 2000; ++fell) {
    awake = std::move(before);
    ode.run(0.01);
    before = snapshot(ode.soft);
  }
  ASSERT_LT(fell, 2000);
  const std::string asleep = std::move(before);
  ode.run(0.02);
  const uint64_t hash = dfm_world_hash(ode.soft);
  for (const bool slept : {false, true}) {
    const std::string &shot = slept ? asleep : awake;
    dBodyEnable(plate);  // whatever ODE's bodies are at
    ok(dfm_world_restore(ode.soft, shot.data(), shot.size()));
    ode.run(slept ? 0.02 : 0.03);
    EXPECT_FALSE(dBodyIsEnabled(plate));
    EXPECT_EQ(dfm_world_hash(ode.soft), hash);
  }
}

// A body without a geom is not the dfm_world's; the adapter's snapshot has it, with
// dWorldQuickStep's random order.
TEST(OdeLifecycle, SnapshotOfTheAdapter_HasBodiesWithoutGeomsToo) {
  Ode ode({0, 0, -9.81}, DFM_ODE_QUICK);
  soft_bed(ode);
  const dBodyID weight = box_with_a_weight(ode);
  ode.run(0.1);
  size_t bytes = 0;
  ok(dfm_ode_snapshot(ode.adapter, nullptr, &bytes));
  std::vector<unsigned char> shot(bytes);
  size_t few = bytes - 1;
  EXPECT_EQ(dfm_ode_snapshot(ode.adapter, shot.data(), &few), DFM_E_ARG);
  EXPECT_EQ(few, bytes);
  ok(dfm_ode_snapshot(ode.adapter, shot.data(), &bytes));
  ode.run(0.1);
  const uint64_t hash = dfm_world_hash(ode.soft);
  const Vec there = position(weight);
  ok(dfm_ode_restore(ode.adapter, shot.data(), shot.size()));
  EXPECT_GT(apart(position(weight), there), 1e-3);
  ode.run(0.1);
  EXPECT_EQ(dfm_world_hash(ode.soft), hash);
  EXPECT_EQ(position(weight), there);
  for (const size_t wrong : {size_t{0}, size_t{40}, bytes - 8, bytes - 1})
    EXPECT_EQ(dfm_ode_restore(ode.adapter, shot.data(), wrong), DFM_E_FORMAT) << wrong;
  EXPECT_EQ(position(weight), there);
  shot[60] ^= 1;
  EXPECT_EQ(dfm_ode_restore(ode.adapter, shot.data(), bytes), DFM_E_FORMAT);
  EXPECT_EQ(position(weight), there);
}

// Damaged, and forged behind a checksum that holds: refused whole, with the reason.
TEST(OdeLifecycle, SnapshotThatIsDamaged_IsRefusedAndChangesNothing) {
  Ode ode;
  soft_bed(ode);
  const dBodyID weight = box_with_a_weight(ode);
  ode.run(0.05);
  const std::vector<unsigned char> good = ode.snapshot();
  const size_t bytes = good.size();
  ode.run(0.05);
  const uint64_t hash = dfm_world_hash(ode.soft);
  const Vec there = position(weight);
  const auto refused = [&](const std::vector<unsigned char> &bad, const char *why) {
    EXPECT_EQ(dfm_ode_restore(ode.adapter, bad.data(), bad.size()), DFM_E_FORMAT) << why;
    EXPECT_NE(std::string(dfm_last_error()).find(why), std::string::npos) << dfm_last_error();
    EXPECT_EQ(dfm_world_hash(ode.soft), hash) << why;
    EXPECT_EQ(position(weight), there) << why;
  };
  for (size_t i = 0; i < 2000; ++i) {
    std::vector<unsigned char> bad = good;
    bad[i * 7919 % bytes] ^= static_cast<unsigned char>(1 + i % 255);
    refused(bad, "");
  }
  constexpr size_t kChecksum = 24, kBody = 16 * sizeof(double);
  const auto forged = [&](size_t at, double value) {
    std::vector<unsigned char> bad = good;
    std::memcpy(&bad[at], &value, sizeof value);
    uint64_t sum = 14695981039346656037ull;
    for (size_t i = 0; i < bytes; ++i)
      if (i < kChecksum || i >= kChecksum + 8) sum = (sum ^ bad[i]) * 1099511628211ull;
    std::memcpy(&bad[kChecksum], &sum, sizeof sum);
    return bad;
  };
  // the weight's numbers; it has no geom
  const size_t friction = bytes - 2 * sizeof(double), body = friction - kBody;
  double x = 0;
  std::memcpy(&x, &good[body], sizeof x);
  ok(dfm_ode_restore(ode.adapter, forged(body, x).data(), bytes));  // the seal itself is right
  ok(dfm_ode_restore(ode.adapter, good.data(), bytes));
  ode.run(0.05);
  ASSERT_EQ(dfm_world_hash(ode.soft), hash);
  for (size_t k = 0; k < 16; ++k) refused(forged(body + 8 * k, NAN), "out of range");
  refused(forged(body + 8 * 13, 2), "out of range");
  refused(forged(body + 8 * 14, -1), "out of range");
  refused(forged(body + 8 * 3, 40), "out of range");
  refused(forged(body - 8, 0.5), "out of range");
  refused(forged(friction + 8, INFINITY), "out of range");
  refused(forged(friction, 3), "another law");
}

// Of another scene: the sentence says what the snapshot has and what is there.
TEST(OdeLifecycle, SnapshotOfAnotherScene_IsRefusedWithBothNumbers) {
  Ode ode;
  ode.ball(0.1, 1, {0, 0, 1});
  ode.run(0.01);
  const std::vector<unsigned char> shot = ode.snapshot();
  ode.ball(0.1, 1, {0, 0, 2});
  EXPECT_EQ(dfm_ode_restore(ode.adapter, shot.data(), shot.size()), DFM_E_FORMAT);
  const std::string why = dfm_last_error();
  EXPECT_NE(why.find("it has 1 geoms, 1 bodies with geoms and 0 without, and there are 2, 2 and 0"),
            std::string::npos)
      << why;
}

// Where a geom without a body is, is ODE's to say: after a restore its surface comes along again.
TEST(OdeLifecycle, Restore_BringsTheSurfaceOfAMovedGeomToIt) {
  Ode ode;
  const dGeomID box = dCreateBox(ode.space, 1, 1, 0.02);
  ode.step();
  const std::vector<unsigned char> shot = ode.snapshot();
  dGeomSetPosition(box, 0, 0, 0.01);
  dGeomSetCollideBits(box, 6);
  ode.step();
  ok(dfm_ode_restore(ode.adapter, shot.data(), shot.size()));
  ode.step();
  dfm_obstacle o = 0;
  dfm_pose pose{};
  ok(dfm_ode_obstacle(ode.adapter, box, &o));
  ok(dfm_obstacle_get_pose(o, &pose));
  EXPECT_EQ(pose.position[2], 0.01);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  ok(dfm_obstacle_get_def(o, &d));
  EXPECT_EQ(d.collides_with, 6u);
}

TEST(OdeLifecycle, PlainWorldStep_IsRefused) {
  Ode ode;
  ode.ball(0.1, 1, {0, 0, 1});
  ode.step();
  uint32_t trouble = 0;
  EXPECT_LT(dfm_world_step(ode.soft, 1e-3, &trouble), 0);
  EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
  EXPECT_NE(std::string(dfm_last_error()).find("dfm_ode_step"), std::string::npos) << dfm_last_error();
  ode.step();
}

TEST(OdeLifecycle, WrongUse_IsReportedInOneSentence) {
  Ode ode;
  dfm_ode second = 0;
  dfm_ode_def d = dfm_ode_def_default();
  const auto refused = [&](dfm_status expected, const char *word) {
    EXPECT_EQ(dfm_ode_attach(ode.soft, &d, &second), expected);
    EXPECT_NE(std::string(dfm_last_error()).find(word), std::string::npos) << dfm_last_error();
  };
  refused(DFM_E_ARG, "dfm_ode_def: world is NULL");
  d.world = ode.world;
  refused(DFM_E_ARG, "dfm_ode_def: space is NULL");
  d.space = ode.space;
  refused(DFM_E_STATE, "dWorldID already has an adapter");
  d.world = dWorldCreate();
  d.space = dSimpleSpaceCreate(nullptr);
  refused(DFM_E_STATE, "dfm_world already has an adapter");
  dSpaceDestroy(d.space);
  dWorldDestroy(d.world);
  d.world = ode.world;
  d.space = ode.space;
  d.real_bytes = 4;
  refused(DFM_E_UNSUPPORTED, "4 bytes");
  d.real_bytes = 8;
  d.version = "0.13.1";
  refused(DFM_E_UNSUPPORTED, "0.13.1");
  d.version = dODE_VERSION;
  d.most_contacts = 0;
  refused(DFM_E_ARG, "most_contacts");
  EXPECT_EQ(dfm_ode_step(ode.adapter, 0), DFM_E_ARG);
  EXPECT_EQ(dfm_ode_step(12345, 1e-3), DFM_E_HANDLE);
  EXPECT_EQ(dfm_ode_detach(0), DFM_E_HANDLE);
  dfm_rigid r = 0;
  EXPECT_EQ(dfm_ode_rigid(ode.adapter, ode.body(1, {1, 1, 1}), &r), DFM_E_ARG);
}
