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
      if (known.empty())
        for (const std::string &sentence : wrong) ADD_FAILURE() << what << ": " << sentence;
      else EXPECT_FALSE(wrong.empty()) << what << " holds now, take it out of known_failures: " << known;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Suite, testing::ValuesIn(kScenes),
                         [](const auto &i) { return std::string(i.param); });
