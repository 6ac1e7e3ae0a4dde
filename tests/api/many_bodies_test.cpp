// What a world of many bodies, as the pieces of one that shatters, costs where it changes: by bodies, not by
// pairs of them.
#include "heap_calls.h"
#include "obstacle.h"
#include "world.h"

namespace {

// Calls of operator new while the tables of a world of n balls and a floor are made again.
uint64_t calls_of_a_change(uint32_t n) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  test::add_plane(w, "floor");
  std::vector<dfm_body> balls;
  for (uint32_t i = 0; i < n; ++i) {
    test::BodyOptions o;
    o.position = {0.3 * i, 0, 0.2};
    balls.push_back(test::make_body(c, w, "ball", {0.1, 0, 0}, 20, o));
  }
  uint32_t found = 0;
  test::ok(dfm_world_overlaps(w, 0, nullptr, &found));
  test::ok(dfm_body_set_filter(balls[0], 1, 3));
  const uint64_t before = test::heap_calls;
  test::ok(dfm_world_overlaps(w, 0, nullptr, &found));
  const uint64_t calls = test::heap_calls - before;
  dfm_world_destroy(w);
  return calls;
}

}  // namespace

// Each pair had its law looked up and its parameters made anew, after each tear and each separation: half of
// the time of a ball that falls into 573 pieces.
TEST(ManyBodies, ChangeOfOne_TakesMemoryByBodiesAndNotByPairs) {
  const uint64_t few = calls_of_a_change(40), many = calls_of_a_change(160);
  EXPECT_LT(many, 6 * few) << "4 times as many bodies, 16 times as many pairs; " << few << " calls of 40";
}
