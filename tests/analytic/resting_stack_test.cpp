// Stacks at rest: what their contact solves need, and what they leave.
#include "support.h"
#include "world.h"

// The impulses of the last sub-step hold it, so that there is nothing left to sweep for: one sweep finds
// that. Others sweep when a contact comes or goes.
TEST(RestingStack, MostSubSteps_TakeOneSweep) {
  const test::Context c;
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.5);
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 20;
  o.volume = 1;
  o.position = {0, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 400, o);
  o.position = {0.013, 0.007, 0.1003};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 400, o);
  for (int k = 0; k < 600; ++k) test::ok(dfm_world_step(w, 1e-3, nullptr));
  uint32_t once = 0, all = 0;
  for (int k = 0; k < 400; ++k) {
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    all += test::stats(w).sweeps;
    once += test::stats(w).sweeps == 1;
  }
  EXPECT_GE(once, 340u) << "of 400";
  EXPECT_LE(all, 800u);
  EXPECT_EQ(test::stats(w).sweeps, 1u) << "at the end nothing moves";
}

// Two boxes of 0.1 kg, or of 0.01 kg, below one of 10 kg, implicit at 1/60 s.
TEST(RestingStack, HeavyOnTop_IsSolvedAndDoesNotCreep) {
  for (const double light : {0.1, 0.01}) {
    const test::Context c;
    const dfm_world w = test::make_world(c, {0, 0, -9.81}, DFM_INTEGRATOR_IMPLICIT_EULER);
    test::add_plane(w, "floor");
    test::set_friction(w, 0.5);
    test::BodyOptions o;
    o.model = "corotational_fem";
    o.young = 1e6;
    o.damping_stiffness = 2e-3;
    dfm_body top = 0;
    for (int k = 0; k < 3; ++k) {
      o.density = (k == 2 ? 10 : light) / 5e-4;
      o.position = {0, 0, 5e-4 + 0.0505 * k};
      top = test::make_body(c, w, "beam", {0.1, 0.1, 0.05}, k == 1 ? 40 : 24, o);
    }
    for (int k = 0; k < 120; ++k) test::ok(dfm_world_step(w, 1.0 / 60, nullptr));
    const dfm_body_measure before = test::measure(top);
    for (int k = 0; k < 60; ++k) test::ok(dfm_world_step(w, 1.0 / 60, nullptr));
    const dfm_body_measure after = test::measure(top);
    EXPECT_EQ(test::stats(w).unconverged, 0u) << light << " kg";
    EXPECT_LT(std::hypot(after.com[0] - before.com[0], after.com[1] - before.com[1]), 1e-6)
        << light << " kg, m in a second";
  }
}
