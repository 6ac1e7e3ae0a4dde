// A soft ball on top of a block of 0.1 m that stands at the origin on a floor.
#pragma once
#include "world.h"

namespace test {

// Both rest after `seconds` of 1 ms: the floor carries both weights, the block the ball's.
inline void expect_block_carries_ball(dfm_context *c, dfm_world world, dfm_body block, double seconds) {
  BodyOptions o;
  o.name = "ball";
  o.young = 5e4;
  o.damping_stiffness = 2e-3;
  o.position = {0.05, 0.05, 0.152};
  const dfm_body ball = make_body(c, world, "ball", {0.05, 0, 0}, 300, o);
  run(world, seconds, 1e-3);
  dfm_pair_report pair[4];
  uint32_t n = 0;
  ASSERT_EQ(dfm_world_pairs(world, 4, pair, &n), DFM_OK) << dfm_last_error();
  ASSERT_EQ(n, 2u);
  const double own = measure(block).mass * 9.81, top = measure(ball).mass * 9.81;
  double below = 0, between = 0;
  for (uint32_t i = 0; i < n; ++i)
    (pair[i].a == block && pair[i].b != ball ? below : between) = pair[i].normal;
  EXPECT_NEAR(below, own + top, 0.02 * (own + top));
  EXPECT_NEAR(between, top, 0.05 * top);
  EXPECT_GT(measure(ball).com[2], 0.13);
}

}  // namespace test
