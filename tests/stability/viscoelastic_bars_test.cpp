// Three bars under gravity along them that begins at once, one for each damper, against the rod's modes
// in closed form:
//   u(t) = 2 g sum_n (-1)^(n-1) / a_n x_n(t),  a_n = (n - 1/2) pi,  (s^2 + d s + w_n^2 e(s)) X_n(s) = 1/s,
//   w_n = a_n sqrt(E/rho)/L,
// e(s) = 1 + tau s (voigt), s tau/(1 + s tau) (maxwell), 1 + r s tau/(1 + s tau) (standard linear solid).
#include <array>
#include <complex>
#include <numbers>

#include "scenes.h"

namespace {

using Complex = std::complex<double>;

constexpr double kLength = 0.32, kGravity = 2, kDensity = 1000, kDrag = 40, kYoung = 3e5;
constexpr double kVoigtTime = 0.05, kMaxwellTime = 0.5, kLinearTime = 0.2, kLinearRatio = 1;

// Velocity of a mode over a step of force is (1 + tau s)/D(s), coefficients of D from s^0 to s^3; voigt has
// no tau in the numerator.
struct Mode {
  double tau;
  std::array<double, 4> below;
};

Mode mode_of(const std::string &damper, double w2) {
  if (damper == "voigt") return {0, {w2, kDrag + w2 * kVoigtTime, 1, 0}};
  if (damper == "maxwell")
    return {kMaxwellTime, {0, kDrag + w2 * kMaxwellTime, 1 + kDrag * kMaxwellTime, kMaxwellTime}};
  return {kLinearTime,
          {w2, kDrag + w2 * kLinearTime * (1 + kLinearRatio), 1 + kDrag * kLinearTime, kLinearTime}};
}

Complex value(const std::array<double, 4> &p, Complex s) { return ((p[3] * s + p[2]) * s + p[1]) * s + p[0]; }
Complex slope(const std::array<double, 4> &p, Complex s) { return (3 * p[3] * s + 2 * p[2]) * s + p[1]; }

// All roots at once (Durand-Kerner).
std::vector<Complex> roots(const std::array<double, 4> &p) {
  const int degree = p[3] != 0 ? 3 : 2;
  const double size = std::pow(std::max(p[0], 1.0) / p[degree], 1.0 / degree) + p[1] / p[degree - 1];
  std::vector<Complex> s;
  for (int i = 0; i < degree; ++i) s.push_back(size * std::pow(Complex(0.4, 0.9), i));
  for (int it = 0; it < 400; ++it)
    for (int i = 0; i < degree; ++i) {
      Complex others = p[degree];
      for (int j = 0; j < degree; ++j)
        if (j != i) others *= s[i] - s[j];
      s[i] -= value(p, s[i]) / others;
    }
  return s;
}

double closed_form(const std::string &damper, double t, double young) {
  double total = 0;
  for (int n = 0; n < 20; ++n) {
    const double a = (n + 0.5) * std::numbers::pi, w = a / kLength;
    const Mode mode = mode_of(damper, w * w * young / kDensity);
    Complex x = 0;
    for (const Complex s : roots(mode.below))
      x += (1.0 + mode.tau * s) / slope(mode.below, s) *
           (std::abs(s) < 1e-6 ? Complex(t) : (std::exp(s * t) - 1.0) / s);
    total += (n % 2 ? -1 : 1) / a * x.real();
  }
  return 2 * kGravity * total;
}

// Largest difference of each bar from its closed form, over the stretch at rest, with the modulus that the
// voigt bar comes to rest at.
struct Difference { double voigt, maxwell, sls, young; };

Difference difference(const std::vector<std::string> &arguments) {
  const test::SceneRun run("viscoelastic_bars", arguments);
  EXPECT_TRUE(run.finite());
  const double rest = run.probe("voigt")[0] - kLength;
  const double young = kDensity * kGravity * kLength * kLength / (2 * rest);
  const auto worst = [&](const std::string &name) {
    double most = 0;
    for (const auto &row : run.probe_rows(name))
      most = std::max(most, std::fabs(row[1] - kLength - closed_form(name, row[0], young)) / rest);
    return most;
  };
  return {worst("voigt"), worst("maxwell"), worst("sls"), young};
}

}  // namespace

TEST(ViscoelasticBars, StepResponses_FollowTheirClosedForms) {
  const Difference d = difference({});
  std::printf("E %.0f Pa; voigt %.4f maxwell %.4f sls %.4f of the stretch at rest\n", d.young, d.voigt,
              d.maxwell, d.sls);
  EXPECT_NEAR(d.young, kYoung, 0.03 * kYoung);
  EXPECT_LT(d.voigt, 0.002);
  EXPECT_LT(d.maxwell, 0.02);  // its first waves are the steepest
  EXPECT_LT(d.sls, 0.01);
}

TEST(ViscoelasticBars, OtherTimesAndRatio_LeaveTheCurves) {
  const Difference d = difference({"--set", "/bodies/0/model/params/damping_stiffness=0.04", "--set",
                                   "/bodies/1/model/params/relaxation_time=0.6", "--set",
                                   "/bodies/2/model/params/relaxation_ratio=1.3"});
  EXPECT_GT(d.voigt, 0.02);
  EXPECT_GT(d.maxwell, 0.2);
  EXPECT_GT(d.sls, 0.04);
}
