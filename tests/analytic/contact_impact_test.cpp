// Impacts between soft bodies and on planes: momentum, angular momentum, energy. Verification T5, F8, F9.
#include "world.h"

namespace {

struct Totals {
  std::array<double, 3> p{}, l{};
  double energy = 0;
};

// Linear momentum, angular momentum about the origin, kinetic plus elastic energy.
Totals totals(std::initializer_list<dfm_body> bodies) {
  Totals t;
  for (const dfm_body b : bodies) {
    const dfm_body_measure m = test::measure(b);
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      t.p[size_t(k)] += m.momentum[k];
      t.l[size_t(k)] += m.angular[k] + m.com[i] * m.momentum[j] - m.com[j] * m.momentum[i];
    }
    t.energy += m.kinetic + m.elastic;
  }
  return t;
}

}  // namespace

namespace {

// A turning cube hits a softer ball off its center; they part again.
struct Crash {
  test::Context context;
  dfm_world world = 0;
  dfm_body cube = 0, ball = 0;
  explicit Crash(double mu) {
    world = test::make_world(context, {0, 0, 0});
    test::BodyOptions a, b;
    a.name = "cube";
    a.young = 2e5;
    a.velocity = {0.8, 0.1, 0};
    a.position = {-0.15, -0.045, -0.05};
    a.spin = {0, 3, 2};
    b.name = "ball";
    b.young = 1e5;
    b.velocity = {-0.4, 0, 0.2};
    b.density = 700;
    cube = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, a);
    ball = test::make_body(context, world, "ball", {0.05, 0, 0}, 300, b);
    test::set_friction(world, mu);
  }
};

}  // namespace

TEST(Impact, TwoBodiesWithFriction_KeepMomentumAndLoseEnergy) {
  Crash crash(0.5);
  const Totals before = totals({crash.cube, crash.ball});
  uint32_t most = 0, n = 0;
  dfm_pair_report pair{};
  double work = 0, torque = 0;  // torque: bound of what friction at two surfaces d_c apart may turn
  for (int k = 0; k < 400; ++k) {
    test::run(crash.world, 1e-3, 1e-3);
    most = std::max(most, test::stats(crash.world).contacts);
    ASSERT_EQ(dfm_world_pairs(crash.world, 1, &pair, &n), DFM_OK);
    if (n) {
      work = pair.friction_work;
      torque += 1e-3 * std::hypot(pair.friction[0], pair.friction[1], pair.friction[2]);
    }
  }
  const Totals after = totals({crash.cube, crash.ball});
  ASSERT_GT(most, 3u);
  EXPECT_EQ(test::stats(crash.world).contacts, 0u) << "they have parted";
  EXPECT_LT(work, -1e-3);
  EXPECT_LT(after.energy, before.energy + 0.9 * work);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.p[k], before.p[k], 1e-13);
    // Friction acts on both surfaces, which are 1e-3 of an edge (5e-5 m) apart, so its couple is
    // no exact zero.
    EXPECT_NEAR(after.l[k], before.l[k], 1e-4 * torque);
  }
}

TEST(Impact, TwoBodiesWithoutFriction_KeepAngularMomentum) {
  Crash crash(0);
  const Totals before = totals({crash.cube, crash.ball});
  uint32_t most = 0;
  for (int k = 0; k < 400; ++k) {
    test::run(crash.world, 1e-3, 1e-3);
    most = std::max(most, test::stats(crash.world).contacts);
  }
  const Totals after = totals({crash.cube, crash.ball});
  ASSERT_GT(most, 3u);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.p[k], before.p[k], 1e-13);
    EXPECT_NEAR(after.l[k], before.l[k], 1e-14);
  }
}

// Without gravity and damping the sum of kinetic and elastic energy has no business to rise. The step is well
// below the bound, where symplectic Euler's own oscillation of the energy is small.
TEST(Impact, UndampedBallOnPlane_NeverGainsEnergy) {
  for (const double young : {1e5, 1e6}) {
    test::Context context;
    const dfm_world world = test::make_world(context, {0, 0, 0});
    test::BodyOptions o;
    o.name = "ball";
    o.young = young;
    o.position = {0, 0, 0.0505};
    o.velocity = {0.2, 0, -0.5};
    const dfm_body ball = test::make_body(context, world, "ball", {0.05, 0, 0}, 300, o);
    test::add_plane(world, "floor");
    test::set_friction(world, 0, "none");
    const double start = totals({ball}).energy;
    double most = 0;
    for (int k = 0; k < 1600; ++k) {
      test::run(world, 5e-5, 5e-5);
      most = std::max(most, totals({ball}).energy);
    }
    EXPECT_LT(most, 1.001 * start) << "young " << young;
    EXPECT_EQ(test::stats(world).contacts, 0u);
    EXPECT_GT(test::measure(ball).velocity[2], 0.95 * 0.5) << "young " << young;
    EXPECT_NEAR(test::measure(ball).velocity[0], 0.2, 1e-12);
  }
}

// Blocks that pass each other with some clearance do not touch, neither with small steps nor with large ones,
// within which they could come nearer by more than the clearance.
TEST(Impact, BlocksThatPassEachOther_DoNotTouch) {
  struct Row { double clearance, step, speed; };
  for (const Row &row : {Row{1e-3, 1e-3, 1.0}, {5e-4, 2.5e-4, 1.0}, {9e-3, 5e-3, 1.0}, {11e-3, 16e-3, 0.5}}) {
    test::Context context;
    const dfm_world world = test::make_world(context, {0, 0, 0});
    test::BodyOptions a, b;
    a.name = "still";
    b.name = "passing";
    a.young = b.young = 2e5;
    a.integrator = b.integrator = row.step > 1e-3 ? DFM_INTEGRATOR_TR_BDF2 : DFM_INTEGRATOR_AUTO;
    b.position = {-0.1 - row.clearance, 0.02, 0.2};
    b.velocity = {0, 0, -row.speed};
    test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 96, a);
    const dfm_body passing = test::make_body(context, world, "beam", {0.1, 0.06, 0.1}, 96, b);
    uint32_t most = 0;
    for (double t = 0; t < 0.3 / row.speed; t += row.step) {
      test::run(world, row.step, row.step);
      most = std::max(most, test::stats(world).contacts);
    }
    EXPECT_EQ(most, 0u) << row.clearance;
    const dfm_body_measure m = test::measure(passing);
    EXPECT_NEAR(m.momentum[2] / m.mass, -row.speed, 1e-9) << row.clearance;
  }
}
