// Facts of a scene do not grow with its pairs: a thousand bodies have half a million pairs.
#include <gtest/gtest.h>

#include "../world/inside.h"
#include "step/context.h"
#include "support.h"
#include "world.h"

namespace {

size_t facts_of(int bodies) {
  const test::Context context;
  const dfm_world world = test::make_world(context);
  test::add_plane(world, "floor");
  test::set_friction(world, 0.5);
  for (int n = 0; n < bodies; ++n) {
    test::BodyOptions o;
    o.position = {0.2 * n, 0, 1};
    test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 10, o);
  }
  test::run(world, 1e-3, 1e-3);
  const dfm::SceneFacts &facts = test::inside(world).steps->facts;
  EXPECT_EQ(facts.body_pairs, unsigned(bodies * (bodies - 1) / 2));
  return facts.offered.size() + facts.idle.size();
}

TEST(SceneFacts, OfManyPairs_GrowWithBodiesAlone) {
  const size_t two = facts_of(2), four = facts_of(4), eight = facts_of(8);
  EXPECT_EQ(eight - four, 2 * (four - two));
}

}  // namespace
