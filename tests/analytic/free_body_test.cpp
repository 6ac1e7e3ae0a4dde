// A body that nothing touches: momentum and angular momentum to rounding, energy bounded.
// Verification T4, T5.
#include "world.h"

namespace {

struct Free {
  test::Context context;
  dfm_world world;
  dfm_body body;
  explicit Free(double damping, double volume) {
    world = test::make_world(context, {0, 0, 0});
    test::BodyOptions o;
    o.young = 1e5;
    o.damping_stiffness = damping;
    o.volume = volume;
    o.velocity = {0.3, -0.2, 0.1};
    o.spin = {3, -5, 8};
    body = test::make_body(context, world, "beam", {0.3, 0.1, 0.1}, 150, o);
    // Some deformation to start with.
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(body, &info));
    std::vector<double> x(3 * info.npoint);
    test::ok(dfm_body_get_state(body, info.npoint, x.data(), nullptr, nullptr));
    for (uint32_t i = 0; i < info.npoint; ++i) {
      x[3 * i] *= 1.05;
      x[3 * i + 2] *= 0.97;
    }
    test::ok(dfm_body_set_state(body, info.npoint, x.data(), nullptr));
  }
};

double norm3(const double *a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

}  // namespace

TEST(FreeBody, DampedAndSpinning_KeepsMomentumAndAngularMomentum) {
  Free f(1e-3, 1.0);
  const dfm_body_measure a = test::measure(f.body);
  double dt;
  test::ok(dfm_world_stable_step(f.world, &dt, nullptr, nullptr));
  for (int i = 0; i < 10000; ++i) ASSERT_EQ(dfm_world_step(f.world, 0.9 * dt, nullptr), DFM_OK);
  const dfm_body_measure b = test::measure(f.body);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(b.momentum[k], a.momentum[k], 1e-12 * norm3(a.momentum));
    EXPECT_NEAR(b.angular[k], a.angular[k], 1e-11 * norm3(a.angular));
  }
}

// Symplectic Euler keeps a nearby energy: E oscillates within C (h w)^1 of the start and has no trend.
TEST(FreeBody, Undamped_EnergyStaysBoundedOver1e5Steps) {
  Free f(0, 0.0);
  double dt;
  test::ok(dfm_world_stable_step(f.world, &dt, nullptr, nullptr));
  dt *= 0.8;
  auto mean_energy = [&](int steps) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(dfm_world_step(f.world, dt, nullptr), DFM_OK);
      if (i % 20 == 0) {
        const dfm_body_measure m = test::measure(f.body);
        sum += m.kinetic + m.elastic;
      }
    }
    return sum / ((steps + 19) / 20);
  };
  const double first = mean_energy(10000);
  double last = 0;
  for (int block = 1; block < 10; ++block) {
    last = mean_energy(10000);
    EXPECT_NEAR(last, first, 0.02 * first) << "block " << block;
  }
}

TEST(FreeBody, FreeFall_IsThatOfAPointMass) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  test::BodyOptions o;
  const dfm_body body = test::make_body(context, world, "ball", {0.05, 0, 0}, 200, o);
  const double z0 = test::measure(body).com[2], dt = 1e-4;
  const int n = 1000;
  for (int i = 0; i < n; ++i) ASSERT_EQ(dfm_world_step(world, dt, nullptr), DFM_OK);
  // symplectic Euler: z = -g h^2 n (n + 1) / 2 exactly
  EXPECT_NEAR(test::measure(body).com[2] - z0, -9.81 * dt * dt * n * (n + 1.0) / 2, 1e-12);
}

TEST(FreeBody, StepAboveTheBound_IsCutAndReported) {
  Free f(0, 0.0);
  double dt;
  test::ok(dfm_world_stable_step(f.world, &dt, nullptr, nullptr));
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(f.world, 5.5 * dt, &trouble), DFM_OK);
  EXPECT_TRUE(trouble & DFM_TROUBLE_SUBSTEPS);
  EXPECT_EQ(test::stats(f.world).last_substeps, 6u);
}
