// What material the springs are: fields by cell, and the Voigt element in closed form. Moduli: msm_bars_test.cpp.
#include "msm_host.h"

namespace msm_test {
namespace {

TEST(MsmMaterial, YoungField_ScalesTheSpringsOfItsCells) {
  Host host;
  const Mesh mesh = kuhn_bar(6, 2, 2, 0.1, 0.2);
  const std::vector<double> uniform(mesh.ncell(), 3e4);
  std::vector<double> doubled = uniform;
  for (double &e : doubled) e *= 2;
  const Params p = {1e4, 0.4, 0.002, 0, 1};
  Instance plain(host, mesh, {3e4, 0.4, 0.002, 0, 1}), field(host, mesh, p, 4, {{"young", uniform}}), twice(host, mesh, p, 4, {{"young", doubled}});
  plain.shake(0.01, 1), field.shake(0.01, 1), twice.shake(0.01, 1);
  plain.forces(), field.forces(), twice.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
    EXPECT_LT(norm(2.0 * field.get(field.f, i) - twice.get(twice.f, i)), 1e-12 * plain.largest_force());
  }
}

// M3: m x'' + c x' + k x = F from rest, with m = 0.2, k = 50, c = 0.4: the free point of a cell whose base is held. A force of 1e-5 N
// keeps x so small that the springs are linear to 1e-7.
TEST(MsmMaterial, VoigtElement_FollowsTheClosedForm) {
  Host host;
  const double m = 0.2, k = 50, c = 0.4, force = 1e-5, h = 2e-5;
  // Regular cell of unit edge: three springs at 2/3 of their stiffness along the height, k_e = young V.
  const Mesh mesh = regular_tet();
  const double young = k / (3 * (2.0 / 3)) / mesh.volume(0);
  Instance b(host, mesh, {young, 0.3, c / k, 0, 0});
  const double zeta = c / (2 * std::sqrt(k * m)), w0 = std::sqrt(k / m), wd = w0 * std::sqrt(1 - zeta * zeta);
  const double rest = mesh.at(3)[2];
  double v = 0, worst = 0;
  for (int n = 1; n <= 100000; ++n) {
    // Midpoint: order 2, so that the integrator's error stays below the comparison.
    double *x = b.x + 4 * 3 + 2, *vel = b.v + 4 * 3 + 2;
    const double x0 = *x;
    *vel = v, b.forces();
    const double a0 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + 0.5 * h * v, *vel = v + 0.5 * h * a0, b.forces();
    const double a1 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + h * (v + 0.5 * h * a0), v += h * a1;
    if (n % 500) continue;
    const double t = n * h;
    const double turn = std::cos(wd * t) + zeta / std::sqrt(1 - zeta * zeta) * std::sin(wd * t);
    const double exact = force / k * (1 - std::exp(-zeta * w0 * t) * turn);
    worst = std::max(worst, std::abs((*x - rest) - exact) / (force / k));
    if (n == 500) { EXPECT_NEAR((*x - rest) / force, 0.000247825376157322, 1e-8); }   // x of a unit force at 0.01 s
    if (n == 2500) { EXPECT_NEAR((*x - rest) / force, 0.00574037939570326, 1e-8); }   // at 0.05 s
  }
  EXPECT_LT(worst, 1e-6);
}

}  // namespace
}  // namespace msm_test
