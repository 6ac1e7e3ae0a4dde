// Bars held at one end, isotropic and softer along x, y, z: gravity down bends, along x it stretches them.
#include "scenes.h"

namespace {

const char *const kPull = "/gravity=[9.81, 0, 0]";

double sag(const test::SceneRun &run, const std::string &bar, double height) {
  return height + 0.05 - run.probe(bar)[2];
}
double stretch(const test::SceneRun &run, const std::string &bar, double place) {
  return run.probe(bar)[0] - place - 0.32;
}

// Over the isotropic bar's, weakest first. A spring at an angle b to the axis has 1/(1 + slope^2 cos^2 b) of
// its stiffness: no bar can be softer than 1 + slope^2 times.
struct Ratios { double x[3], y[3], z[3]; };

template <class Measure>
Ratios ratios(Measure measure, double isotropic) {
  Ratios r;
  for (int n = 0; n < 3; ++n) {
    const std::string number = std::to_string(n + 1);
    r.x[n] = measure("x" + number, 0.0, n) / isotropic;
    r.y[n] = measure("y" + number, 0.5, n) / isotropic;
    r.z[n] = measure("z" + number, 1.0, n) / isotropic;
  }
  return r;
}

Ratios sags(const test::SceneRun &run) {
  return ratios([&](const std::string &bar, double, int n) { return sag(run, bar, 0.3 * (2 - n)); },
                sag(run, "isotropic", 0.3));
}

bool ordered(const test::SceneRun &run) {
  const Ratios r = sags(run);
  bool yes = r.x[0] > 1.1;
  for (int n = 0; n < 3; ++n)
    yes = yes && r.x[n] > r.y[n] + 0.1 && r.x[n] > r.z[n] + 0.1 && (n == 0 || r.x[n] > r.x[n - 1] + 0.3);
  return yes;
}

}  // namespace

TEST(GravityAnisotropy, Sag_GrowsWithTheSlopeAlongTheBarAndLittleAcross) {
  const test::SceneRun run("gravity_anisotropy", {});
  run.expect_valid(0, "bars");
  EXPECT_TRUE(ordered(run));
  for (const char *bar : {"isotropic", "x3", "y3", "z3"}) EXPECT_LT(run.last(bar).kinetic, 1e-6) << bar;
}

TEST(GravityAnisotropy, Stretch_StaysBelowThatOfASpringAlongTheAxis) {
  const test::SceneRun run("gravity_anisotropy", {"--set", kPull});
  const Ratios r = ratios([&](const std::string &bar, double place, int) { return stretch(run, bar, place); },
                          stretch(run, "isotropic", -0.5));
  const double slope[3] = {0.5, 1, 2};
  for (int n = 0; n < 3; ++n) {
    const double most = 1 + slope[n] * slope[n];
    EXPECT_LT(r.x[n], most);
    EXPECT_GT(r.x[n], 1 + 0.55 * (most - 1));
    EXPECT_GT(r.y[n], 1);
    EXPECT_LT(r.y[n], 1 + 0.1 * (most - 1));
    EXPECT_NEAR(r.z[n], r.y[n], 0.05 * r.y[n]);  // the bar's two axes across
  }
}

TEST(GravityAnisotropy, AxisAcross_LosesTheOrder) {
  EXPECT_FALSE(
      ordered(test::SceneRun("gravity_anisotropy", {"--set", "/bodies/3/anisotropy/axis=[0, 1, 0]"})));
}

TEST(GravityAnisotropy, JitteredRuns_KeepTheOrder) {
  test::expect_jittered("gravity_anisotropy", 1, 10, {}, 0, ordered);
}
