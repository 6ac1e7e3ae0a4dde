// Two clamped bars of a stiff and a soft half, one with the stiff half at the root, one with the soft; a
// third has the first's moduli by cell.
#include "scenes.h"

namespace {

double sag(const test::SceneRun &run, const std::string &bar) { return 0.55 - run.probe(bar + "_tip")[2]; }

// Sag of the tip of a clamped bar of length L and height h under its own weight q, moduli E1 in the root half
// and E2 in the tip half (Timoshenko): the integral of q s^3 / 2 E I + q s / (5/6 G A) over s = distance to
// the tip. In units of q L^4 / 8 I:
double beam(double e1, double e2, double poisson, double slender) {
  // (q L^2 / (2 kappa G A)) / (q L^4 / (8 E I)), G = E / (2 (1 + nu))
  const double shear = 8.0 / 12 / (5.0 / 6) * (1 + poisson) * slender * slender;
  return (15.0 / 16 + 3.0 / 4 * shear) / e1 + (1.0 / 16 + 1.0 / 4 * shear) / e2;
}

// The root bends sixteen times as much as the tip: where the stiff half sits decides the sag.
bool as_theory(const test::SceneRun &run) {
  const double expected = beam(2e6, 8e6, 0.25, 0.2) / beam(8e6, 2e6, 0.25, 0.2);
  return std::fabs(sag(run, "soft_root") / sag(run, "stiff_root") / expected - 1) < 0.05;
}

}  // namespace

TEST(TwoMaterials, Sags_AreInTheRatioOfBeamTheory) {
  const test::SceneRun run("two_materials", {});
  run.expect_valid(0, "bars");
  EXPECT_TRUE(as_theory(run)) << sag(run, "soft_root") << " " << sag(run, "stiff_root");
  EXPECT_NEAR(sag(run, "by_field"), sag(run, "stiff_root"), 1e-9) << "the same moduli, from a table";
  for (const char *bar : {"stiff_root", "soft_root"}) EXPECT_LT(run.last(bar).kinetic, 1e-6) << bar;
}

TEST(TwoMaterials, OneMaterial_LosesTheRatio) {
  EXPECT_FALSE(as_theory(test::SceneRun("two_materials", {"--set", "/materials/stiff/young=2e6"})));
}
