// Bodies that touch with fine surfaces on coarse cells: momentum, and nothing passes through.
#include <random>

#include "coupled.h"
#include "crossing.h"

namespace {

using test::Skin;

struct Body {
  dfm_body body;
  std::vector<uint32_t> triangles;
};

size_t crossings(const std::vector<Body> &bodies) {
  std::vector<std::vector<double>> x;
  std::vector<crossing::Surface> surfaces;
  for (const Body &b : bodies) x.push_back(test::surface_positions(b.body));
  for (size_t i = 0; i < bodies.size(); ++i)
    surfaces.push_back({x[i].data(), uint32_t(x[i].size() / 3), bodies[i].triangles.data(),
                        uint32_t(bodies[i].triangles.size() / 3)});
  return crossing::Counter().count(surfaces, crossing::Touching::counts).all();
}

struct Momentum { double p[3] = {}, scale = 0; };
Momentum momentum(const std::vector<Body> &bodies) {
  Momentum sum;
  for (const Body &b : bodies) {
    const dfm_body_measure m = test::measure(b.body);
    for (int k = 0; k < 3; ++k) {
      sum.p[k] += m.momentum[k];
      sum.scale += std::fabs(m.momentum[k]);
    }
  }
  return sum;
}

// A ball meets a block off its center. 100 to 400 cells, 258 to 1,538 surfels.
struct Pair {
  test::Context context;
  dfm_world world;
  std::vector<Body> bodies;
  Skin box = test::box_skin({0.1, 0.1, 0.06}, 8), ball = test::ball_skin(0.048, 3);
  Pair(int32_t coupling, double support, std::array<double, 3> gravity, std::array<double, 3> aim,
       double speed) {
    world = test::make_world(context, gravity);
    test::set_friction(world, 0.4);
    const dfm_surface_def below = box.def(coupling, support), above = ball.def(coupling, support);
    test::BodyOptions o;
    o.young = 5e4;
    o.damping_stiffness = 5e-4;
    o.name = "block";
    o.position = {-0.05, -0.05, 1e-4};
    o.surface = &below;
    add(test::make_body(context, world, "beam", {0.1, 0.1, 0.06}, 100, o));
    o.name = "ball";
    o.position = {aim[0], aim[1], 0.112 + aim[2]};
    o.velocity = {0.2, 0.1, -speed};
    o.spin = {0, 10, 3};
    o.surface = &above;
    add(test::make_body(context, world, "ball", {0.05, 0, 0}, 200, o));
  }
  void add(dfm_body b) { bodies.push_back({b, test::surface_triangles(b)}); }
};

}  // namespace

TEST(CoupledBodies, Collision_KeepsMomentumAndParts) {
  for (const auto &[coupling, support] :
       {std::pair{DFM_COUPLING_BARYCENTRIC, 0.0}, {DFM_COUPLING_MLS, 1.5}}) {
    Pair p(coupling, support, {0, 0, 0}, {0.01, 0.007, 0}, 1.3);
    const Momentum before = momentum(p.bodies);
    size_t crossed = 0;
    for (int i = 0; i < 60; ++i) {
      test::run(p.world, 2e-3, 1e-3);
      crossed += crossings(p.bodies);
    }
    const Momentum after = momentum(p.bodies);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.p[k], before.p[k], 1e-12 * before.scale);
    EXPECT_EQ(crossed, 0u);
    EXPECT_GE(test::stats(p.world).contacts_max, 3u);
    EXPECT_GT(test::measure(p.bodies[1].body).velocity[2], -0.5) << "the ball was thrown back";
    EXPECT_LT(test::measure(p.bodies[0].body).velocity[2], -0.05) << "the block took it";
  }
}

TEST(CoupledBodies, TenJitteredDrops_NeverCross) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> jitter(-0.02, 0.02);
  for (int run = 0; run < 10; ++run) {
    const double x = jitter(random), y = jitter(random), z = 0.5 * std::fabs(jitter(random));
    Pair p(run % 3 == 2 ? DFM_COUPLING_MLS : DFM_COUPLING_BARYCENTRIC, 1.5, {0, 0, -9.81}, {x, y, z}, 0.5);
    test::add_plane(p.world, "floor");
    size_t crossed = 0;
    for (int i = 0; i < 50; ++i) {
      test::run(p.world, 3e-3, 1e-3);
      crossed += crossings(p.bodies);
    }
    EXPECT_EQ(crossed, 0u) << "run " << run;
    EXPECT_GT(test::stats(p.world).contacts_max, 10u) << "run " << run;
    EXPECT_LT(test::measure(p.bodies[1].body).speed_max, 5) << "run " << run;
  }
}

TEST(CoupledBodies, Snapshot_ContinuesTheSameAndFitsNoOtherCoupling) {
  const std::array<double, 3> gravity{0, 0, -9.81};
  Pair p(DFM_COUPLING_BARYCENTRIC, 0, gravity, {0.01, 0.007, -0.002}, 1),
      same(DFM_COUPLING_BARYCENTRIC, 0, gravity, {0.01, 0.007, -0.002}, 1);
  test::run(p.world, 0.01, 1e-3);
  const std::string kept = test::snapshot(p.world);
  test::run(p.world, 0.02, 1e-3);
  ASSERT_GT(test::stats(p.world).contacts_max, 0u);
  test::ok(dfm_world_restore(same.world, kept.data(), kept.size()));
  test::run(same.world, 0.02, 1e-3);
  EXPECT_EQ(dfm_world_hash(same.world), dfm_world_hash(p.world));
  EXPECT_EQ(test::surface_positions(same.bodies[1].body), test::surface_positions(p.bodies[1].body));
  Pair other(DFM_COUPLING_MLS, 1.5, gravity, {0.01, 0.007, -0.002}, 1);
  EXPECT_EQ(dfm_world_restore(other.world, kept.data(), kept.size()), DFM_E_FORMAT)
      << "the same cells, but surfels that hang otherwise";
}

// The judge sees a crossing where contact is switched off.
TEST(CoupledBodies, WithoutContact_Cross) {
  Pair p(DFM_COUPLING_BARYCENTRIC, 0, {0, 0, 0}, {}, 1);
  test::ok(dfm_body_set_filter(p.bodies[1].body, 2, 2));
  test::run(p.world, 0.03, 1e-3);
  EXPECT_GT(crossings(p.bodies), 0u);
}
