// A tube pinched between two rods: isotropic, softer along its axis, stiffer along its axis. Across the
// axis all three have one modulus, so the softer gives way at the rods alone and the stiffer carries the
// squeeze to its ends.
#include "scenes.h"

namespace {

struct Tube { double force, spread; };  // N on a rod; how far the ends rise over how far the middle widens

// Slope 2 leaves cos^2 = 1/5: a tube stiffer along its axis is given five times the modulus, so that it has
// that of the others across.
Tube tube(const std::string &kind, double slope, double young) {
  const test::SceneRun run("pinched_tube",
                           {"--time", "0.6", "--set", "/bodies/0/anisotropy/params/kind=" + kind, "--set",
                            "/bodies/0/anisotropy/params/slope=" + std::to_string(slope), "--set",
                            "/materials/rubber/young=" + std::to_string(young)});
  run.expect_valid(8, kind);
  EXPECT_LT(run.last("tube").kinetic, 1e-4);
  const std::vector<double> side = run.probe("side"), end = run.probe("end_top");
  EXPECT_GT(side[1], 0.05);
  return {run.contact_force("upper"), (end[2] - 0.045) / (side[1] - 0.045)};
}

}  // namespace

TEST(PinchedTube, SofterAlongItsAxis_YieldsMoreAndMoreLocally) {
  const Tube isotropic = tube("softer", 0, 1e5), softer = tube("softer", 2, 1e5);
  EXPECT_LT(softer.force, 0.8 * isotropic.force);
  EXPECT_LT(softer.spread, 0.8 * isotropic.spread);
}

TEST(PinchedTube, StifferAlongItsAxis_ResistsMoreAndFarther) {
  const Tube softer = tube("softer", 2, 1e5), stiffer = tube("stiffer", 2, 5e5);
  EXPECT_GT(stiffer.force, 2 * softer.force);
  EXPECT_GT(stiffer.spread, 1.5 * softer.spread);
}

namespace {
bool between_the_rods(const test::SceneRun &run) {
  const double upper = run.contact_force("upper"), lower = run.contact_force("lower");
  return std::fabs(upper - lower) < 0.1 * upper && std::fabs(run.last("tube").com[0]) < 0.005;
}
const std::vector<std::string> kShort = {"--time", "0.45"};
}  // namespace

TEST(PinchedTube, JitteredRuns_StayBetweenTheRods) {
  test::expect_jittered("pinched_tube", 1, 10, kShort, 8, between_the_rods);
}

// One rod alone pushes it away.
TEST(PinchedTube, OneRodAlone_DoesNotHoldIt) {
  const std::string upper_alone = R"(/contact/filter=[{"between": ["lower", "*"], "collide": false}])";
  EXPECT_FALSE(between_the_rods(test::SceneRun("pinched_tube", {"--time", "0.45", "--set", upper_alone})));
}

// The rods stand still from 0.4 s on: so do the contacts. Edges that a straight rod presses flat and that
// lost their contact for it came and went for ever,
// 9 to 18 of them, and half of the steps did not converge.
TEST(PinchedTube, RodsAtRest_KeepTheirContacts) {
  for (const int seed : {5, 8}) {
    const test::SceneRun run(
        "pinched_tube", {"--time", "0.6", "--set", "/output/every=0.005", "--jitter", std::to_string(seed)});
    for (const char *rod : {"upper", "lower"})
      EXPECT_EQ(run.contact_counts(rod, 0.45).size(), 1u) << rod << ", seed " << seed;
    EXPECT_LT(run.number("unconverged_steps"), 0.05 * run.number("steps")) << seed;
  }
}
