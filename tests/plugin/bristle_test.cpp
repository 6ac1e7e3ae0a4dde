// A law with state in contact shows that the host owns typed state: it is carried with the contact, committed
// once per sub-step, dropped on lift-off, saved and restored.
#include "bristle_law.h"

namespace {

constexpr double kG = 9.81;

struct World {
  test::Context context;
  dfm_world world;
  dfm_body body;
  // A block of edge 0.1 m under gravity tilted by theta.
  // drag (1/s) lets the sway on undamped bristles die out; it carries nothing at rest.
  World(double theta, double sigma0, uint32_t cells = 200, double drag = 0) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_bristle, "bristle"));
    world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.damping_mass = drag;
    o.position = {-0.05, -0.05, 2e-5};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, cells, o);
    test::add_plane(world, "floor");
    test::ok(test::add_friction(world, "test.bristle", {{"mu", 0.5}, {"sigma0", sigma0}}));
  }
  std::vector<dfm_contact> contacts() {
    std::vector<dfm_contact> c(512);
    uint32_t n = 0;
    test::ok(dfm_world_contacts(world, 512, c.data(), &n));
    c.resize(n);
    return c;
  }
};

}  // namespace

// At rest on a slope the bristles carry the tangential weight: sum sigma0 A z = m g sin(theta), and with all
// of the base touching the mean deflection is m g sin(theta) / (sigma0 area of the base), whatever the mesh.
// unsanitized: too slow there; shorter tests run the same code
TEST(Bristle, AtRestOnASlope_DeflectsByWeightOverStiffnessTimesArea) {
  for (uint32_t cells : {100u, 600u}) {
    World w(0.2, 2e6, cells, 30);
    test::run(w.world, 1.5, 1e-3);
    double area = 0, carried = 0, force = 0;
    for (const dfm_contact &c : w.contacts()) {
      // along the slope, which is x; the second tangent is normal x tangent
      const double t1 = c.tangent[0], t2 = c.normal[1] * c.tangent[2] - c.normal[2] * c.tangent[1];
      area += c.area;
      carried += 2e6 * c.area * (c.bristle[0] * t1 + c.bristle[1] * t2);
      force -= c.ft[0] * t1 + c.ft[1] * t2;
    }
    const double weight = test::measure(w.body).mass * kG * std::sin(0.2);
    EXPECT_NEAR(area, 0.01, 0.02 * 0.01) << cells;
    EXPECT_NEAR(carried, weight, 0.01 * weight) << cells;
    EXPECT_NEAR(force, carried, 1e-6 * weight) << cells;
    EXPECT_LT(test::measure(w.body).speed_max, 1e-6) << cells;
  }
}

// No stiffness limit on the step: bristles are a compliance that is solved implicitly.
// unsanitized: too slow there; shorter tests run the same code
TEST(Bristle, FromSoftToNearlyRigid_HoldsAtTheSameStep) {
  for (double sigma0 : {1e6, 1e8, 1e9, 1e10, 1e12}) {
    World w(0.2, sigma0, 200, 30);
    test::run(w.world, 1.5, 1e-3);
    const double x0 = test::measure(w.body).com[0];
    test::run(w.world, 0.5, 1e-3);
    EXPECT_LT(std::fabs(test::measure(w.body).com[0] - x0), 1e-5) << sigma0;
    EXPECT_LT(test::measure(w.body).speed_max, 1e-3) << sigma0;
    EXPECT_LT(double(test::stats(w.world).unconverged), 0.01 * double(test::stats(w.world).substeps))
        << sigma0;
  }
}

TEST(Bristle, AboveTheCone_SlidesWithCoulombsAcceleration) {
  World w(0.8, 1e8);
  test::run(w.world, 0.1, 1e-3);
  const double v0 = test::measure(w.body).velocity[0];
  test::run(w.world, 0.3, 1e-3);
  const double expected = kG * (std::sin(0.8) - 0.5 * std::cos(0.8));
  EXPECT_NEAR((test::measure(w.body).velocity[0] - v0) / 0.3, expected, 0.01 * expected);
}

TEST(Bristle, LiftedOff_ForgetsItsDeflection) {
  World w(0.2, 2e6);
  test::run(w.world, 1.0, 1e-3);
  ASSERT_FALSE(w.contacts().empty());
  const double up[3] = {0, 0, 30};
  test::ok(dfm_world_set_gravity(w.world, up));
  test::run(w.world, 0.1, 1e-3);
  EXPECT_TRUE(w.contacts().empty());
  const double down[3] = {0, 0, -kG};
  test::ok(dfm_world_set_gravity(w.world, down));
  test::run(w.world, 1.0, 1e-3);
  for (const dfm_contact &c : w.contacts())
    EXPECT_LT(2e6 * c.area * std::hypot(c.bristle[0], c.bristle[1]), 0.5 * c.fn + 1e-9);
}

TEST(Bristle, SavedInMidContact_ContinuesWithTheSameBits) {
  World a(0.2, 2e6), b(0.2, 2e6);
  test::run(a.world, 0.2, 1e-3);
  const std::string data = test::snapshot(a.world);
  test::ok(dfm_world_restore(b.world, data.data(), data.size()));
  test::run(a.world, 0.2, 1e-3);
  test::run(b.world, 0.2, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}
