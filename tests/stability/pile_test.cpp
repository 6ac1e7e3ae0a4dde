// Random piles with every law: every step is made. `pile_walk` of tests/bench walks a hundred thousand
// steps of each.
#include "pile.h"

namespace {

class Pile : public testing::TestWithParam<const char *> {};

}  // namespace

TEST_P(Pile, OfRandomBodies_MakesEveryStep) {
  for (const uint64_t seed : {3u, 8u}) {
    const test::pile::Result r = test::pile::walk(GetParam(), seed, 250, 2e-3, 8);
    EXPECT_EQ(r.failure, "") << "seed " << seed;
    EXPECT_EQ(r.steps, 250u);
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Pile,
                         testing::Values("coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"),
                         [](const auto &p) { return std::string(p.param); });
