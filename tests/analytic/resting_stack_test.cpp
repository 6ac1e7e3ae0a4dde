// A stack at rest: the impulses of the last sub-step hold it, so that there is nothing left to sweep for.
#include "support.h"
#include "world.h"

// One sweep finds that. Others sweep when a contact comes or goes.
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
