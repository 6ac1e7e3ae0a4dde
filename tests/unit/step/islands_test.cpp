#include "step/islands.h"

#include "../world/inside.h"
#include "step/context.h"
#include "step/solve/solve_islands.h"
#include "world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using dfm::Islands;

std::vector<std::vector<uint32_t>> sets(const Islands &x) {
  std::vector<std::vector<uint32_t>> out;
  for (uint32_t k = 0; k < x.count; ++k)
    out.emplace_back(x.member.begin() + x.begin[k], x.member.begin() + x.begin[k + 1]);
  return out;
}

}  // namespace

TEST(Islands, WithoutPairs_EveryThingIsOne) {
  Islands x(dfm::Memory::standard());
  x.start(3);
  x.finish();
  EXPECT_EQ(sets(x), (std::vector<std::vector<uint32_t>>{{0}, {1}, {2}}));
  x.start(0);
  x.finish();
  EXPECT_EQ(x.count, 0u);
}

// Ordered by the lowest member: 1 joins 6 late, and still its island is the second.
TEST(Islands, ThatJoinThroughOthers_AreOrderedByTheirLowestMember) {
  Islands x(dfm::Memory::standard());
  x.start(8);
  for (auto [a, b] : {std::pair{7u, 6u}, {4u, 3u}, {5u, 3u}, {6u, 1u}, {0u, 5u}, {3u, 0u}}) x.join(a, b);
  x.finish();
  EXPECT_EQ(sets(x), (std::vector<std::vector<uint32_t>>{{0, 3, 4, 5}, {1, 6, 7}, {2}}));
  EXPECT_EQ(std::vector<uint32_t>(x.of.begin(), x.of.end()), (std::vector<uint32_t>{0, 1, 2, 0, 0, 0, 1, 1}));
}

// Against plain spreading of the lowest number along the pairs; any order of the pairs gives
// the same columns.
TEST(Islands, OfRandomPairs_AreTheConnectedComponentsInAnyOrder) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    const uint32_t n = 1 + random() % 60;
    std::vector<std::pair<uint32_t, uint32_t>> pairs(random() % (n + 5));
    for (auto &p : pairs) p = {random() % n, random() % n};
    std::vector<uint32_t> lowest(n);
    for (uint32_t i = 0; i < n; ++i) lowest[i] = i;
    for (bool again = true; again;) {
      again = false;
      for (auto [a, b] : pairs)
        if (lowest[a] != lowest[b]) {
          lowest[a] = lowest[b] = std::min(lowest[a], lowest[b]);
          again = true;
        }
    }
    Islands x(dfm::Memory::standard()), y(dfm::Memory::standard());
    x.start(n);
    y.start(n);
    for (auto [a, b] : pairs) x.join(a, b);
    std::shuffle(pairs.begin(), pairs.end(), random);
    for (auto [a, b] : pairs) y.join(b, a);
    x.finish();
    y.finish();
    for (uint32_t i = 0; i < n; ++i) ASSERT_EQ(x.member[x.begin[x.of[i]]], lowest[i]);
    ASSERT_EQ(sets(x), sets(y));
  }
}

// Slip that an island takes back is that of this solve: a law that fails, or an interrupt, before it is known
// leaves none.
TEST(SolveIslands, InterruptedAtTheirStart_TakeBackNoSlipOfEarlierSubSteps) {
  const test::Context context;
  dfm_world w = test::make_world(context, {1, 0, -9.81});
  test::add_plane(w, "floor");
  test::set_friction(w, 0.5);
  test::BodyOptions o;
  o.position = {0, 0, 1e-4};
  test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 40, o);
  test::run(w, 0.2, 1e-3);
  const auto drift = [&] {
    const auto all = test::inside(w).steps->solve_islands->all();
    return std::any_of(all.begin(), all.end(), [](const dfm::SolveIsland &own) { return own.drifts; });
  };
  EXPECT_TRUE(drift());
  test::ok(dfm_world_set_pre_solve(
      w, [](void *world, dfm_contact_choice *) { dfm_world_interrupt(*static_cast<dfm_world *>(world)); },
      &w));
  EXPECT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_DISCARD);
  EXPECT_FALSE(drift());
}
