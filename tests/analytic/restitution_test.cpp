// Rebound of pairs with a restitution, by integrator and stiffness; doc/concepts/restitution.md.
#include <initializer_list>
#include <optional>

#include "world.h"

namespace {

void set_restitution(dfm_world w, std::optional<double> e) {
  dfm_friction_def f{};
  f.size = sizeof f;
  f.between[0] = f.between[1] = "*";
  f.law = "none";
  if (e) {
    f.flags = DFM_FRICTION_RESTITUTION;
    f.restitution = *e;
  }
  test::ok(dfm_world_add_friction(w, &f));
}

struct Drop {
  double up = 0;      // speed at the floor after the impact, over that before it
  double energy = 0;  // largest one, over that at the start
};

// A ball comes down on a floor at 2 m/s.
Drop drop(int32_t integrator, double young, std::optional<double> e, double step, double seconds) {
  constexpr double g = 9.81, speed = 2, height = 0.02, radius = 0.05;
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -g}, integrator);
  test::BodyOptions o;
  o.name = "ball";
  o.young = young;
  o.position = {0, 0, radius + height};
  o.velocity = {0, 0, -speed};
  const dfm_body ball = test::make_body(context, world, "ball", {radius, 0, 0}, 60, o);
  test::add_plane(world, "floor");
  set_restitution(world, e);
  const double low = test::measure(ball).mass * g * radius, start = test::total_energy(ball) - low;
  const double came = speed * speed + 2 * g * height;
  Drop out;
  for (double t = 0; t < seconds; t += step) {
    test::run(world, step, step);
    const dfm_body_measure m = test::measure(ball);
    const double v = m.velocity[2], z = std::max(0.0, m.com[2] - radius);
    if (v > 0 && test::contacts(world).empty())
      out.up = std::max(out.up, std::sqrt((v * v + 2 * g * z) / came));
    out.energy = std::max(out.energy, (test::total_energy(ball) - low) / start);
  }
  return out;
}

const std::initializer_list<int32_t> kImplicit = {DFM_INTEGRATOR_IMPLICIT_EULER, DFM_INTEGRATOR_TR_BDF2};

}  // namespace

// Impacts of 0.2 ms and 2 ms.
TEST(Restitution, StiffBodyByImplicitTime_ReboundsAtThatShare) {
  for (const int32_t integrator : kImplicit)
    for (const double young : {1e9, 1e7})
      for (const double e : {0.0, 0.5, 0.8}) {
        const Drop d = drop(integrator, young, e, 1.0 / 60, 0.1);
        EXPECT_NEAR(d.up, e, 0.05) << "integrator " << integrator << ", " << young << " Pa, e " << e;
        EXPECT_LT(d.energy, 1.001) << "integrator " << integrator << ", " << young << " Pa, e " << e;
      }
}

TEST(Restitution, ByAnyStepLongerThanTheImpact_IsTheSame) {
  for (const double step : {1e-3, 4e-3, 0.03})
    for (const double e : {0.5, 0.8, 1.0}) {
      const Drop d = drop(DFM_INTEGRATOR_IMPLICIT_EULER, 1e9, e, step, 0.1);
      EXPECT_NEAR(d.up, e, 0.05) << "step " << step << ", e " << e;
      EXPECT_LT(d.energy, 1.001) << "step " << step << ", e " << e;
    }
}

// 1 MPa: the impact lasts 6 ms, so that a part of it is deformation within the step of 17 ms.
TEST(Restitution, SofterBody_LosesWhatItsStepDamps) {
  for (const int32_t integrator : kImplicit)
    for (const double e : {0.5, 0.8}) {
      const Drop d = drop(integrator, 1e6, e, 1.0 / 60, 0.1);
      EXPECT_NEAR(d.up, e, 0.15) << "integrator " << integrator << ", e " << e;
      EXPECT_LT(d.energy, 1.001) << "integrator " << integrator << ", e " << e;
    }
}

// Sub-steps that resolve the impact leave it to the elasticity of the body: nothing is added.
TEST(Restitution, ExplicitBody_ReboundsByItsElasticity) {
  for (const double young : {1e6, 1e9}) {
    const Drop none = drop(DFM_INTEGRATOR_SYMPLECTIC_EULER, young, {}, 1e-3, 0.04);
    EXPECT_GT(none.up, 0.8) << young << " Pa";
    EXPECT_LT(none.up, 1) << young << " Pa";
    for (const double e : {0.0, 0.5, 0.8}) {
      const Drop d = drop(DFM_INTEGRATOR_SYMPLECTIC_EULER, young, e, 1e-3, 0.04);
      EXPECT_EQ(d.up, none.up) << young << " Pa, e " << e;
      EXPECT_EQ(d.energy, none.energy) << young << " Pa, e " << e;
    }
  }
}

// Slower than 2 |g| h nothing is thrown back.
TEST(Restitution, WhatRests_Rests) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -9.81}, DFM_INTEGRATOR_IMPLICIT_EULER);
  test::BodyOptions o;
  o.name = "block";
  o.young = 1e6;
  const dfm_body block = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 40, o);
  test::add_plane(world, "floor");
  set_restitution(world, 0.9);
  test::run(world, 0.5, 1.0 / 60);
  EXPECT_LT(test::measure(block).speed_max, 1e-3);
  EXPECT_LT(test::measure(block).com[2], 0.0505);
}
