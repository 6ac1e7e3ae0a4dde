// Three clamped beams of Young's moduli 1 : 2 : 4 side by side.
#include "scenes.h"

namespace {

constexpr double kStart = 0.55;  // height of the tips at rest shape, m

double sag(const test::SceneRun &run, const std::string &beam) {
  return kStart - run.probe(beam + "_tip")[2];
}

// The softer hangs lower, by about the ratio of the moduli: large bending stiffens the softest by a tenth, a
// still larger spread is wrong.
bool ordered(const test::SceneRun &run) {
  const double soft = sag(run, "soft"), medium = sag(run, "medium"), stiff = sag(run, "stiff");
  return std::fabs(medium / stiff - 2) < 0.1 && std::fabs(soft / medium - 2) < 0.25;
}

}  // namespace

TEST(GravityBeams, Tips_HangInTheOrderOfTheirModuli) {
  const test::SceneRun run("gravity_beams", {});
  run.expect_valid(0, "beams");
  EXPECT_TRUE(ordered(run));
  for (const char *beam : {"soft", "medium", "stiff"}) EXPECT_LT(run.last(beam).kinetic, 1e-4) << beam;
}

TEST(GravityBeams, ModuliSwapped_LosesTheOrder) {
  EXPECT_FALSE(ordered(test::SceneRun(
      "gravity_beams", {"--set", "/materials/soft/young=2e6", "--set", "/materials/stiff/young=5e5"})));
}

// soak: long, and a jittered run of what another test runs
TEST(GravityBeams, JitteredRuns_KeepTheOrder) {
  test::expect_jittered("gravity_beams", 1, 10, {}, 0, ordered);
}
