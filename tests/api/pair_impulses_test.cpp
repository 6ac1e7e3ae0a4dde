// Impulses and peak forces of pairs over a whole step, against the momentum that the bodies exchanged in it.
#include <map>

#include "stack.h"

namespace {

std::vector<dfm_pair_impulse> impulses(dfm_world w) { return test::listed(dfm_world_pair_impulses, w); }

// A ball thrown at the floor, free of gravity: at the stable step, or in frames of 60 Hz that are cut into
// many sub-steps.
struct Throw {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0});
  dfm_obstacle floor = test::add_plane(world, "floor");
  dfm_body ball;
  Throw() {
    test::set_friction(world, 0.3);
    test::BodyOptions o;
    o.name = "ball";
    o.young = 2e5;
    o.damping_stiffness = 1e-4;
    o.position = {0, 0, 0.051};
    o.velocity = {0.5, 0, -2};
    ball = test::make_body(context, world, "ball", {0.05, 0, 0}, 400, o);
  }
};

}  // namespace

TEST(PairImpulses, OfEachFrame_AreTheMomentumThatTheBodyGot) {
  Throw t;
  dfm_body_measure before = test::measure(t.ball);
  const double scale = 2 * before.mass;
  double most = 0;
  for (int frame = 0; frame < 12; ++frame) {
    uint32_t trouble = 0;
    test::ok(dfm_world_step(t.world, 1.0 / 60, &trouble));
    EXPECT_TRUE(trouble & DFM_TROUBLE_SUBSTEPS);
    const dfm_body_measure after = test::measure(t.ball);
    const auto list = impulses(t.world);
    ASSERT_LE(list.size(), 1u);
    const dfm_pair_impulse p = list.empty() ? dfm_pair_impulse{} : list[0];
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(p.impulse[k], after.momentum[k] - before.momentum[k], 1e-12 * scale) << frame;
    EXPECT_NEAR(p.normal_impulse, p.impulse[2], 1e-12 * scale);  // on a plane all normals point up
    if (!list.empty()) {
      EXPECT_EQ(p.a, t.ball);
      EXPECT_EQ(p.b, t.floor);
      EXPECT_GT(p.touching, 0);
      EXPECT_LE(p.touching, 1.0 / 60 * (1 + 1e-12));
      EXPECT_GE(p.peak_normal, p.normal_impulse / p.touching * (1 - 1e-12));
      EXPECT_GE(p.peak_force, p.peak_normal * (1 - 1e-12));
      EXPECT_NEAR(p.point[2], 0, 2e-5);  // within the contact offset
    }
    most = std::max(most, p.normal_impulse);
    before = after;
  }
  EXPECT_GT(most, 1.0 * before.mass);  // it came with 2 m/s and has left
}

// The last sub-step of such a step has no contact, so the report of contacts is empty.
TEST(PairImpulses, OfAnImpactThatEndsWithinTheStep_AreKept) {
  Throw t;
  const dfm_body_measure before = test::measure(t.ball);
  test::ok(dfm_world_step(t.world, 0.1, nullptr));
  EXPECT_TRUE(test::pairs(t.world).empty());
  const auto list = impulses(t.world);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_NEAR(list[0].impulse[2], test::measure(t.ball).momentum[2] - before.momentum[2],
              1e-12 * before.mass);
  EXPECT_GT(list[0].peak_normal, 2 * list[0].normal_impulse / 0.1);
  double sum = 0;
  for (const double part : list[0].part) sum += part;
  EXPECT_NEAR(sum, list[0].normal_impulse, 1e-12 * sum);
  EXPECT_EQ(list[0].part[7], 0) << "it has left";
  test::ok(dfm_world_step(t.world, 1e-3, nullptr));
  EXPECT_TRUE(impulses(t.world).empty());  // of the last step alone
}

// The impact in one long step and in as many short ones. A stiff body far away bounds the sub-steps, so that
// they are equal whatever the ball does: then nothing but rounding differs.
TEST(PairImpulses, SumAndPeak_AreThoseOfTheSameTimeInManySteps) {
  Throw whole, parts;
  for (Throw *t : {&whole, &parts}) {
    test::BodyOptions o;
    o.name = "stiff";
    o.young = 2e7;
    o.position = {1, 0, 1};
    test::make_body(t->context, t->world, "ball", {0.05, 0, 0}, 400, o);
  }
  test::ok(dfm_world_step(whole.world, 0.1, nullptr));
  const uint32_t n = test::stats(whole.world).last_substeps;
  double normal = 0, peak = 0, force = 0;
  for (uint32_t i = 0; i < n; ++i) {
    test::ok(dfm_world_step(parts.world, 0.1 / n, nullptr));
    ASSERT_EQ(test::stats(parts.world).last_substeps, 1u);
    for (const dfm_pair_impulse &p : impulses(parts.world)) {
      normal += p.normal_impulse;
      peak = std::max(peak, p.peak_normal);
      force = std::max(force, p.peak_force);
    }
  }
  const auto list = impulses(whole.world);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_NEAR(list[0].normal_impulse, normal, 1e-12 * normal);
  EXPECT_NEAR(list[0].peak_normal, peak, 1e-12 * peak);
  EXPECT_NEAR(list[0].peak_force, force, 1e-12 * force);
}

// Before it falls asleep, in the frame in which it does, and while it sleeps.
// unsanitized: too slow there; shorter tests run the same code
TEST(PairImpulses, OfAStackAtRest_AreItsWeight_AlsoWhileItSleeps) {
  test::Context context;
  test::Stack s = test::make_stack(context, 1e-5);
  test::ok(dfm_world_set_sleep(s.world, true));
  const double rest = 2e-5, dt = 1.0 / 60, mass = test::measure(s.upper).mass, weight = 9.81 * mass;
  dfm_world_stats stats{};
  stats.size = sizeof stats;
  int checked = 0;
  double before = 1;  // m/s, at the start of the frame
  for (int frame = 0; frame < 600 && checked < 20; ++frame) {
    test::ok(dfm_world_step(s.world, dt, nullptr));
    test::ok(dfm_world_get_stats(s.world, &stats));
    const bool moved = before > rest;
    before = test::measure(s.upper).speed_max;
    if (checked == 0 && (moved || before > rest)) continue;
    std::map<std::pair<uint64_t, uint64_t>, dfm_pair_impulse> of;
    for (const dfm_pair_impulse &p : impulses(s.world)) of[{p.a, p.b}] = p;
    ASSERT_EQ(of.size(), 2u);
    const dfm_pair_impulse between = of[{s.lower, s.upper}], below = of[{s.lower, s.floor}];
    // What a body that moves slower than `rest` has gained in momentum is missing in the impulses.
    EXPECT_NEAR(between.impulse[2], -weight * dt, rest * mass);  // on the lower one
    EXPECT_NEAR(below.impulse[2], 2 * weight * dt, 2 * rest * mass);
    EXPECT_NEAR(between.peak_normal, weight, 3e-4 * weight);  // it still rings with 9e-5 of the weight
    EXPECT_NEAR(between.touching, dt, 1e-12);
    checked += stats.asleep == 2;
  }
  EXPECT_EQ(checked, 20);
}

// A block that sleeps is struck in the middle of a step: the time before has the forces of the sleep.
TEST(PairImpulses, OfASleeperThatIsStruck_AreTheMomentumThatItGot) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  test::ok(dfm_world_set_sleep(w, true));
  const dfm_obstacle floor = test::add_plane(w, "floor");
  test::set_friction(w, 0, "none");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.position = {0, 0, 1e-4};
  const dfm_body block = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  constexpr double kDt = 0.02, kStart = 3.01;
  const dfm_pose_key keys[] = {{0, {{0.152, 0.05, 0.05}, {0, 0, 0, 1}}},
                               {kStart, {{0.152, 0.05, 0.05}, {0, 0, 0, 1}}},
                               {kStart + 1, {{-0.848, 0.05, 0.05}, {0, 0, 0, 1}}}};
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_BOX;
  for (double &half : d.half_size) half = 0.05;
  d.nkey = 3;
  d.keys = keys;
  dfm_obstacle ram = 0;
  test::ok(dfm_obstacle_create(w, &d, &ram));
  while (dfm_world_time(w) < kStart - 0.5 * kDt - 1e-9) test::ok(dfm_world_step(w, kDt, nullptr));
  ASSERT_EQ(test::stats(w).asleep, 1u);
  test::ok(dfm_world_step(w, kDt, nullptr));
  ASSERT_EQ(test::stats(w).asleep, 0u);
  const dfm_body_measure m = test::measure(block);
  const double weight = 9.81 * m.mass;
  ASSERT_LT(m.momentum[0], -0.1 * m.mass);
  const auto list = impulses(w);
  ASSERT_EQ(list.size(), 2u);
  std::map<uint64_t, dfm_pair_impulse> by;
  for (const dfm_pair_impulse &p : list) by[p.b] = p;
  EXPECT_NEAR(by[ram].impulse[0], m.momentum[0], 1e-4 * m.mass);
  EXPECT_NEAR(by[ram].impulse[2] + by[floor].impulse[2], m.momentum[2] + weight * kDt, 1e-3 * weight * kDt);
  EXPECT_LT(by[ram].touching, 0.5 * kDt);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(by[ram].part[k], 0) << k;
    EXPECT_NEAR(by[floor].part[k], weight * kDt / 8, 1e-3 * weight * kDt) << k;
  }
}

TEST(PairImpulses, ArgumentsThatDoNotFit_AreRefused) {
  Throw t;
  test::ok(dfm_world_step(t.world, 0.1, nullptr));
  uint32_t n = 7;
  dfm_pair_impulse out{};
  EXPECT_EQ(dfm_world_pair_impulses(0, 1, &out, &n), DFM_E_HANDLE);
  test::ok(dfm_world_pair_impulses(t.world, 0, nullptr, &n));
  EXPECT_EQ(n, 1u);
  test::ok(dfm_obstacle_destroy(t.floor));
  test::ok(dfm_world_pair_impulses(t.world, 1, &out, &n));
  EXPECT_EQ(out.b, 0u);
}
