// Sets on an engine's host that bring nothing but their defs: their joints mean and say what those of the
// builtin host do. Built once for each engine (engine.h).
#include <gtest/gtest.h>

#include "engine.h"
#include "saboteur.h"

namespace {

using namespace test;

// Without a shape: rigid bodies of an engine touch each other, the builtin host's do not.
dfm_rigid_def part(const char *name, double mass, Vec inertia, Vec position) {
  dfm_rigid_def d = dfm_rigid_def_default();
  d.name = name;
  d.shape = DFM_SHAPE_NONE;
  d.mass = mass;
  for (int k = 0; k < 3; ++k) {
    d.inertia[k] = inertia[size_t(k)];
    d.pose.position[k] = position[size_t(k)];
  }
  return d;
}
// A fixed body that stands askew: 0.8 rad about (1, 2, 2) / 3.
dfm_rigid_def stand(const char *name, Vec position) {
  dfm_rigid_def d = part(name, 1, {1, 1, 1}, position);
  const double s = std::sin(0.4) / 3, q[] = {s, 2 * s, 2 * s, std::cos(0.4)};
  std::copy(q, q + 4, d.pose.rotation);
  d.fixed = 1;
  return d;
}
dfm_joint_def driven(dfm_joint_def j, double velocity, double max) {
  j.motor = 1;
  j.velocity = velocity;
  j.max = max;
  return j;
}

// Which of the two bodies of a joint the arm is, and what the other one is.
enum class With { world, still, still_first, moving };
constexpr With kAll[] = {With::world, With::still, With::still_first, With::moving};
constexpr const char *kNames[] = {"world", "still", "still_first", "moving"};

// An arm of 2 kg whose center is 0.3 m along x from its joint in the origin. A body that moves in the arm's
// stead hangs on the world by a fixed joint.
struct Rig {
  dfm_world world;
  std::vector<dfm_rigid> bodies;
  Rig(dfm_context *c, const char *host, With with, uint32_t type, Vec axis, double velocity, double max,
      Vec gravity = {0, 0, -9.81}) {
    world = make_world(c, gravity);
    const dfm_rigid_def arm = part("arm", 2, {0.02, 0.03, 0.04}, {0.3, 0, 0});
    const Vec anchor = {};
    switch (with) {
      case With::world:
        bodies = create(world, {arm}, {driven(joint(type, 0, DFM_RIGID_WORLD, anchor, axis), velocity, max)},
                        host);
        return;
      case With::still:
        bodies = create(world, {arm, stand("stand", {-0.1, 0.2, 0})},
                        {driven(joint(type, 0, 1, anchor, axis), velocity, max)}, host);
        return;
      case With::still_first:
        bodies = create(world, {stand("stand", {-0.1, 0.2, 0}), arm},
                        {driven(joint(type, 0, 1, anchor, axis), velocity, max)}, host);
        return;
      case With::moving: break;
    }
    dfm_rigid_def base = stand("base", {-0.1, 0.2, 0});
    base.fixed = 0;
    bodies = create(world, {base, arm},
                    {driven(joint(type, 1, 0, anchor, axis), velocity, max),
                     joint(DFM_JOINT_FIXED, 0, DFM_RIGID_WORLD, anchor)},
                    host);
  }
  JointReading read() const { return reading(bodies[0], 0); }
};

// Of an effort, N and N m: joints' errors of four roundings of the arm's place, 0.3 m, of which an engine
// takes back a share of 0.2 in each step of 1 ms, by moving 2 kg.
constexpr double kNoise = 4 * kRounding * 0.3 * 0.2 / 1e-6 * 2;
constexpr Vec kAcross = {0, 1, 0}, kSkew = {1, 2, -2};

class OwnWorld : public ::testing::TestWithParam<With> {
 protected:
  OwnWorld() { ok(register_engine()); }
  Context c;
};

// Runs both hosts side by side and compares what the joint says; the bounds hold over `seconds`.
void compare(dfm_context *c, With with, uint32_t type, Vec axis, double velocity, double max, double seconds,
             JointReading within) {
  const Rig engine(c, kEngine, with, type, axis, velocity, max),
      own(c, nullptr, with, type, axis, velocity, max);
  for (double t = 0; t < seconds; t += 0.02) {
    run(engine.world, 0.02, 1e-3);
    run(own.world, 0.02, 1e-3);
    const JointReading a = engine.read(), b = own.read();
    ASSERT_NEAR(a.position, b.position, within.position) << t;
    ASSERT_NEAR(a.rate, b.rate, within.rate) << t;
    ASSERT_NEAR(a.effort, b.effort, within.effort + kNoise) << t;
  }
}

}  // namespace

// A motor that holds an arm still carries its weight at its lever, 0.3 m: about the axis, not about the arm's
// center, where the hinge's own force turns too. `body` against `with`: where the arm is the second body, the
// motor turns the other way round to carry it.
TEST_P(OwnWorld, HingeThatHoldsAnArm_ReportsItsMomentAboutTheHinge) {
  for (const char *host : {kEngine, "builtin"}) {
    const Rig rig(c, host, GetParam(), DFM_JOINT_HINGE, kAcross, 0, 50);
    run(rig.world, 0.05, 1e-3);
    const double sign = GetParam() == With::still_first ? 1 : -1;
    EXPECT_NEAR(rig.read().effort, sign * 2 * 9.81 * 0.3, 1e-6 + kNoise) << host;
    EXPECT_NEAR(rig.read().rate, 0, 1e-7) << host;
  }
}

TEST_P(OwnWorld, SliderThatHoldsAnArm_ReportsItsForceAlongTheAxis) {
  for (const char *host : {kEngine, "builtin"}) {
    const Rig rig(c, host, GetParam(), DFM_JOINT_SLIDER, kSkew, 0, 50);
    run(rig.world, 0.05, 1e-3);
    const double sign = GetParam() == With::still_first ? 1 : -1;
    EXPECT_NEAR(rig.read().effort, sign * 2 * 9.81 * 2 / 3, 1e-6 + kNoise) << host;
  }
}

// The motor's direction: body against with, about the axis as the def has it in the world, however the bodies
// stand or which of them is fixed.
TEST_P(OwnWorld, HingeMotor_TurnsAsOnTheBuiltinHost) {
  for (const double sign : {1.0, -1.0}) {
    // moments to 8 N m
    compare(c, GetParam(), DFM_JOINT_HINGE, kSkew, 2 * sign, 50, 0.4, {0.005, 0.01, 0.05});
    const Rig rig(c, kEngine, GetParam(), DFM_JOINT_HINGE, kSkew, 2 * sign, 50);
    run(rig.world, 0.4, 1e-3);
    EXPECT_NEAR(rig.read().position, 0.8 * sign, 0.01);
  }
}
TEST_P(OwnWorld, SliderMotor_MovesAsOnTheBuiltinHost) {
  for (const double sign : {1.0, -1.0}) {
    compare(c, GetParam(), DFM_JOINT_SLIDER, kSkew, 0.5 * sign, 5000, 0.4, {1e-6, 1e-6, 1e-4});
    const Rig rig(c, kEngine, GetParam(), DFM_JOINT_SLIDER, kSkew, 0.5 * sign, 5000);
    run(rig.world, 0.4, 1e-3);
    EXPECT_NEAR(rig.read().position, 0.2 * sign, 1e-6);
  }
}

// One that cannot hold its speed does what it can, and says so with its sign.
TEST_P(OwnWorld, MotorAtItsLimit_ReportsItsLimit) {
  for (const double sign : {1.0, -1.0}) {
    compare(c, GetParam(), DFM_JOINT_HINGE, kAcross, 100 * sign, 1.5, 0.4, {0.02, 0.05, 1e-6});
    compare(c, GetParam(), DFM_JOINT_SLIDER, kSkew, 100 * sign, 3, 0.4, {2e-3, 1e-3, 1e-6});
    const Rig rig(c, kEngine, GetParam(), DFM_JOINT_HINGE, kAcross, 100 * sign, 1.5);
    run(rig.world, 0.02, 1e-3);
    EXPECT_NEAR(rig.read().effort, 1.5 * sign, 1e-9 + 8 * kRounding * 6);  // of its parts, 6 N m
  }
}

// Past half a turn the angle goes on from the other side.
TEST_P(OwnWorld, HingeAngle_IsWithinHalfATurn) {
  const Rig engine(c, kEngine, GetParam(), DFM_JOINT_HINGE, kSkew, 5, 200),
      own(c, nullptr, GetParam(), DFM_JOINT_HINGE, kSkew, 5, 200);
  bool below = false;
  for (int i = 0; i < 40; ++i) {
    run(engine.world, 0.04, 1e-3);
    run(own.world, 0.04, 1e-3);
    const double a = engine.read().position, b = own.read().position;
    ASSERT_NEAR(std::remainder(a - b, 2 * 3.141592653589793), 0, 0.02) << i;
    ASSERT_LE(std::fabs(a), 3.1416);
    below |= a < -2;
  }
  EXPECT_TRUE(below);
}
INSTANTIATE_TEST_SUITE_P(All, OwnWorld, ::testing::ValuesIn(kAll),
                         [](const auto &p) { return kNames[int(p.param)]; });

// Two arms on driven hinges, on a fixed body that stands askew; a soft ball under one of them, on it a pile
// that also leans on the fixed body.
namespace {

struct Machine {
  Context c;
  dfm_world world;
  std::vector<dfm_rigid> bodies;
  Machine() {
    ok(register_engine());
    world = make_world(c);
    set_friction(world, 0.5);
    add_plane(world, "floor", {0, 0, -0.25});
    BodyOptions o;
    o.name = "soft";
    o.young = 2e4;
    o.damping_stiffness = 2e-3;
    o.position = {0.3, 0, -0.152};
    make_body(c, world, "ball", {0.1}, 200, o);
    dfm_rigid_def post = stand("post", {0, 0.1, 0.1});
    dfm_rigid_def lying = box("lying", {0.05, 0.05, 0.05}, 0.4, {0.11, 0.02, 0.0705});
    post.shape = DFM_SHAPE_BOX;
    post.half_size[0] = post.half_size[1] = post.half_size[2] = 0.05;
    lying.velocity[0] = -0.3;
    lying.spin[2] = 2;
    bodies = create(world,
                    {box("upper", {0.15, 0.04, 0.02}, 1, {0.2, 0, 0}), post,
                     box("lower", {0.15, 0.04, 0.02}, 1, {0.55, 0, 0}), lying,
                     box("top", {0.06, 0.03, 0.02}, 0.2, {0.13, 0.02, 0.141}),
                     box("end", {0.03, 0.03, 0.03}, 0.2, {0.6, 0, 0.0505})},
                    {driven(joint(DFM_JOINT_HINGE, 1, 0, {0, 0, 0}, {0, 1, 0}), 0, 12),
                     driven(joint(DFM_JOINT_HINGE, 2, 0, {0.375, 0, 0}, {0, 1, 0}), -0.5, 4)},
                    kEngine);
  }
  std::vector<JointReading> read() const { return {reading(bodies[0], 0), reading(bodies[0], 1)}; }
};

}  // namespace

// After a restore joints say what they said then, before any step, in this world and in another one; and both
// go on with the bits of the first run, with the contacts of rigid bodies with each other.
TEST(OwnWorldSnapshot, Restored_ReportsTheSameJointsAndContinuesBitByBit) {
  Machine m;
  run(m.world, 0.15, 1e-3);
  ASSERT_GT(stats(m.world).contacts, 0u);
  EXPECT_GT(state(m.bodies[4]).velocity[2], -0.1);  // carried by what lies below
  const std::string shot = snapshot(m.world);
  const std::vector<JointReading> then = m.read();
  run(m.world, 0.15, 1e-3);
  const uint64_t hash = dfm_world_hash(m.world);
  const std::vector<JointReading> later = m.read();
  EXPECT_GT(std::fabs(later[1].position - then[1].position), 1e-2);

  Machine fresh;
  for (Machine *to : {&m, &fresh}) {
    ok(dfm_world_restore(to->world, shot.data(), shot.size()));
    EXPECT_EQ(to->read(), then) << (to == &fresh);
    run(to->world, 0.15, 1e-3);
    EXPECT_EQ(to->read(), later) << (to == &fresh);
    EXPECT_EQ(dfm_world_hash(to->world), hash) << (to == &fresh);
  }
}

// A chain that a soft ball strikes, interrupted in each solve that the engine has asked for again: nothing
// has changed.
TEST(OwnWorldSnapshot, InterruptedAmidCorrections_LeavesNoTrace) {
  Context c;
  ok(register_engine());
  dfm_world worlds[2];
  for (dfm_world &w : worlds) {
    w = make_world(c);
    soft_ball(c, w, {0.35, 0, 0.14}, {0, 0, -1}, 2e4, 5);
    create(w,
           {box("a", {0.05, 0.03, 0.02}, 0.5, {0.05, 0, 0}), box("b", {0.05, 0.03, 0.02}, 0.5, {0.15, 0, 0}),
            box("c", {0.05, 0.03, 0.02}, 0.5, {0.25, 0, 0}), box("d", {0.05, 0.03, 0.02}, 0.5, {0.35, 0, 0})},
           {joint(DFM_JOINT_BALL, 0, DFM_RIGID_WORLD, {}), joint(DFM_JOINT_BALL, 1, 0, {0.1, 0, 0}),
            joint(DFM_JOINT_BALL, 2, 1, {0.2, 0, 0}), joint(DFM_JOINT_BALL, 3, 2, {0.3, 0, 0})},
           kEngine);
    Saboteur::join(w);
  }
  const dfm_world struck = worlds[0], calm = worlds[1];
  int interrupted = 0;
  for (int i = 0; i < 100; ++i) {
    Saboteur::arm(Saboteur::predict, 0, struck, 2);
    const dfm_status status = dfm_world_step(struck, 1e-3, nullptr);
    Saboteur::left = -1;
    interrupted += status == DFM_DISCARD;
    if (status == DFM_DISCARD) ok(dfm_world_step(struck, 1e-3, nullptr));
    ok(dfm_world_step(calm, 1e-3, nullptr));
    ASSERT_EQ(dfm_world_hash(struck), dfm_world_hash(calm)) << i;
  }
  EXPECT_GT(interrupted, 0);
}

// A state that is set counts at once.
TEST(OwnWorldSnapshot, SetState_IsWhatTheJointReports) {
  Context c;
  ok(register_engine());
  const Rig rig(c, kEngine, With::still, DFM_JOINT_SLIDER, {1, 0, 0}, 0, 50, {0, 0, 0});
  run(rig.world, 0.01, 1e-3);
  dfm_rigid_state s = state(rig.bodies[0]);
  s.position[0] += 0.25;
  s.velocity[0] = 0.5;
  ok(dfm_rigid_set_state(rig.bodies[0], &s));
  EXPECT_NEAR(rig.read().position, 0.25, 1e-9);
  EXPECT_NEAR(rig.read().rate, 0.5, 1e-9);
}

// A heap of boxes, balls and capsules that falls on a soft ball between walls, in steps that the guard cuts:
// which bodies touch, and in which order they came to, changes all the time.
namespace {

struct Heap {
  Context c;
  dfm_world world;
  std::vector<dfm_rigid> bodies;
  Heap() {
    ok(register_engine());
    world = make_world(c);
    set_friction(world, 0.5);
    BodyOptions o;
    o.name = "soft";
    o.young = 2e4;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 0.06};
    make_body(c, world, "ball", {0.05}, 150, o);
    static const char *const names[] = {"r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8"};
    std::vector<dfm_rigid_def> defs;
    for (int i = 0; i < 9; ++i) {
      dfm_rigid_def d = box(names[i], {0.04, 0.03, 0.025}, 0.2 + 0.1 * (i % 4),
                            {0.02 * (i % 3 - 1), 0.02 * (i % 2), 0.16 + 0.085 * i});
      if (i % 3 != 0) {
        d.shape = i % 3 == 1 ? DFM_SHAPE_SPHERE : DFM_SHAPE_CAPSULE;
        d.radius = i % 3 == 1 ? 0.035 : 0.025;
        d.half_length = 0.03;
      }
      const double angle = 0.35 * i;
      d.pose.rotation[0] = std::sin(angle);
      d.pose.rotation[3] = std::cos(angle);
      d.velocity[2] = -0.5;
      defs.push_back(d);
    }
    const auto wall = [&](const char *name, Vec half, Vec place) {
      defs.push_back(box(name, half, 1, place));
      defs.back().fixed = 1;
    };
    wall("table", {0.5, 0.5, 0.05}, {0, 0, -0.05});
    wall("left", {0.02, 0.15, 0.3}, {-0.13, 0, 0.3});
    wall("right", {0.02, 0.15, 0.3}, {0.13, 0, 0.3});
    wall("front", {0.15, 0.02, 0.3}, {0, -0.13, 0.3});
    wall("back", {0.15, 0.02, 0.3}, {0, 0.13, 0.3});
    bodies = create(world, defs, {}, kEngine);
  }
};

}  // namespace

TEST(OwnWorldSnapshot, HeapThatFalls_ContinuesBitByBit) {
  Heap m, fresh;
  run(m.world, 0.3, 2e-3);
  const std::string shot = snapshot(m.world);
  run(m.world, 0.3, 2e-3);
  const uint64_t hash = dfm_world_hash(m.world);
  ASSERT_GT(stats(m.world).contacts, 0u);
  for (Heap *to : {&m, &fresh}) {
    ok(dfm_world_restore(to->world, shot.data(), shot.size()));
    run(to->world, 0.3, 2e-3);
    EXPECT_EQ(dfm_world_hash(to->world), hash) << (to == &fresh);
  }
}

// Pushed apart as fast as in a sub-step of 1 ms, not share * depth / h.
TEST(OwnWorld, BodiesThatOverlap_AreNotThrownInShortSteps) {
  Context c;
  ok(register_engine());
  const dfm_world w = make_world(c, {0, 0, 0});
  const std::vector<dfm_rigid> bodies = create(
      w, {box("a", {0.05, 0.05, 0.05}, 1), box("b", {0.05, 0.05, 0.05}, 1, {0.09, 0, 0})}, {}, kEngine);
  for (const double h : {1e-6, 1e-5, 1e-4}) {
    run(w, 10 * h, h);
    EXPECT_LT(norm(vec(state(bodies[1]).velocity)), 1.1) << h;  // a half of 0.01 m * 0.2 / 1 ms each
  }
  run(w, 0.05, 1e-3);
  EXPECT_GT(state(bodies[1]).position[0] - state(bodies[0]).position[0], 0.099);
}

// What was made before the body that is refused goes in order; the next set is made.
TEST(OwnWorld, SetThatIsRefusedHalfMade_LeavesNothingBehind) {
  Context c;
  ok(register_engine());
  const dfm_world w = make_world(c);
  std::vector<dfm_rigid_def> bodies = {box("a", {0.05, 0.05, 0.05}, 1),
                                       box("b", {0.05, 0.05, 0.05}, 1, {0.1, 0, 0}),
                                       box("c", {0.05, 0.05, 0.05}, 1, {2e9, 0, 0})};
  const dfm_joint_def hinge = joint(DFM_JOINT_HINGE, 0, 1, {0.05, 0, 0});
  const dfm_rigid_set_def set = {sizeof set, 3, 1, 0, bodies.data(), &hinge, nullptr};
  dfm_rigid out[3];
  EXPECT_LT(dfm_rigid_create(w, kEngine, &set, out), 0);
  EXPECT_NE(std::string(dfm_last_error()).find("body 2"), std::string::npos) << dfm_last_error();
  bodies[2].pose.position[0] = 1;
  create(w, bodies, {hinge}, kEngine);
  run(w, 0.01, 1e-3);
}

// Filters hold as everywhere else: both bodies must want to touch.
TEST(OwnWorld, BodiesOfWhichOneDoesNotWantTo_DoNotTouch) {
  for (const uint32_t floor_wants : {1u, 3u}) {
    Context c;
    ok(register_engine());
    const dfm_world w = make_world(c);
    std::vector<dfm_rigid_def> bodies = {box("falls", {0.05, 0.05, 0.05}, 1, {0, 0, 0.051}),
                                         box("floor", {0.5, 0.5, 0.05}, 1, {0, 0, -0.05})};
    bodies[0].category = 2;
    bodies[1].fixed = 1;
    bodies[1].collides_with = floor_wants;
    const std::vector<dfm_rigid> made = create(w, bodies, {}, kEngine);
    run(w, 0.2, 1e-3);
    EXPECT_EQ(state(made[0]).position[2] > 0.04, floor_wants == 3);
  }
}

// So small a moment that the spin is infinite: the step fails, and ends.
TEST(OwnWorld, MomentsNearZero_EndInAStatus) {
  Context c;
  ok(register_engine());
  const dfm_world w = make_world(c);
  dfm_rigid_def dust = part("dust", 1, {1e-310, 1e-310, 1e-310}, {0, 0, 0});
  dust.spin[0] = dust.spin[1] = dust.spin[2] = 1;
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &dust, nullptr, nullptr};
  dfm_rigid out = 0;
  uint32_t trouble = 0;
  ok(dfm_rigid_create(w, kEngine, &set, &out));
  EXPECT_LT(dfm_world_step(w, 1e-3, &trouble), 0);
}
