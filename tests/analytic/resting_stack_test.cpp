// A stack at rest: the impulses of the last sub-step hold it, so that there is nothing left to sweep for.
#include <algorithm>

#include "support.h"
#include "world.h"

// Before half of a change was taken over at rest, the largest of these sub-steps took 30 sweeps: each solve
// stopped what the last one had left within its tolerance, and the next one began with the impulse for that.
TEST(RestingStack, EverySubStep_TakesFewSweeps) {
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
  for (int k = 0; k < 400; ++k) test::ok(dfm_world_step(w, 1e-3, nullptr));
  uint32_t most = 0;
  for (int k = 0; k < 400; ++k) {
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    most = std::max(most, test::stats(w).sweeps);
  }
  EXPECT_LE(most, 8u);
  EXPECT_EQ(test::stats(w).sweeps, 1u) << "at the end nothing moves";
}
