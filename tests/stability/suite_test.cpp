// The stability suite, a test for each scene: every variant with the models, integrators and steps that the
// scene's own file names. `make soak` runs all of them ten times.
#include "suite.h"

namespace {

using namespace test::suite;

// gtest_discover_tests lists tests when they are built: the names stand here, and a test compares them with
// the folder.
constexpr const char *kScenes[] = {"arch",
                                   "card_house",
                                   "cliff_edge",
                                   "closing_plates",
                                   "friction",
                                   "gravity_reversed",
                                   "hand",
                                   "internal_edges",
                                   "mass_ratio",
                                   "nested",
                                   "poisson_0499",
                                   "slivers",
                                   "spike_on_wedge",
                                   "spin_1000rpm",
                                   "stack10",
                                   "start_floor",
                                   "start_free",
                                   "step_30",
                                   "stiffness_between",
                                   "stiffness_within",
                                   "stretch_release"};

class Suite : public testing::TestWithParam<const char *> {};

// Redundant contacts of several bodies whose end is solved for: sweeps end at their cap and drift, bodies
// follow them in turn. That went on until the work of a sub-step was used up, 31,000 sweeps in the mean. Now
// 3 sub-steps of 18 end at the cap, and 4,616 sweeps are the most, as the cards land. (13 and 2,600 before
// crossings in flat faces gave way, in twice the time: solves ended at 50 sweeps,
// doc/decisions/contact_problem.md.)
void expect_few_sweeps_of_card_house(const Seen &seen) {
  EXPECT_GT(seen.stats.substeps, 15u);
  EXPECT_LT(seen.stats.sweeps_max, 6000u);
  EXPECT_LE(seen.stats.unconverged, 6u);
  EXPECT_LT(seen.speed_last, 1e-5);
}

}  // namespace

TEST(SuiteFolder, EveryScene_IsTested) {
  EXPECT_EQ(names(), std::vector<std::string>(std::begin(kScenes), std::end(kScenes)));
}

TEST_P(Suite, Scene_MeetsItsCriteria) {
  const Expectations expect(GetParam());
  EXPECT_FALSE(expect.asks().empty());
  for (const std::string &variant : expect.variants()) {
    EXPECT_FALSE(expect.combinations(variant).empty());
    for (const Combination &c : expect.combinations(variant)) {
      const Settings how = expect.settings(variant, c, 0);
      const Seen seen = run(expect.path(), how);
      const std::vector<std::string> wrong = expect.complaints(variant, c, how, seen);
      const std::string what = std::string(GetParam()) + " " + variant + ", " + name_of(c);
      std::printf("%-60s %6.2f s, %llu sub-steps, gain %.3g of %.3g J, rest %.3g m/s%s\n", what.c_str(),
                  seen.cpu, static_cast<unsigned long long>(seen.stats.substeps), seen.gain, seen.energy_most,
                  seen.speed_last, wrong.empty() ? "" : ", does not hold:");
      for (const std::string &sentence : wrong) std::printf("    %s\n", sentence.c_str());
      const std::string known = expect.known_failure(variant, c);
      if (GetParam() == std::string("card_house")) expect_few_sweeps_of_card_house(seen);
      if (known.empty())
        for (const std::string &sentence : wrong) ADD_FAILURE() << what << ": " << sentence;
      else EXPECT_FALSE(wrong.empty()) << what << " holds now, take it out of known_failures: " << known;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Suite, testing::ValuesIn(kScenes),
                         [](const auto &i) { return std::string(i.param); });
