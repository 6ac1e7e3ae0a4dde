// What material the springs are: fields by cell, and the Voigt element in closed form. Moduli:
// msm_bars_test.cpp.
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
  Instance plain(host, mesh, {3e4, 0.4, 0.002, 0, 1}), field(host, mesh, p, 4, {{"young", uniform}}),
      twice(host, mesh, p, 4, {{"young", doubled}});
  plain.shake(0.01, 1);
  field.shake(0.01, 1);
  twice.shake(0.01, 1);
  plain.forces();
  field.forces();
  twice.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
    EXPECT_LT(norm(2.0 * field.get(field.f, i) - twice.get(twice.f, i)), 1e-12 * plain.largest_force());
  }
}

// The weights by direction belong to the whole body, so what a part is made of depends on the rest; it stays
// within three times. Without that limit the cube beside a sheet would be 133 times as stiff. Nor does the
// sheet lose what the limit keeps from the cube.
TEST(MsmMaterial, ACubeBesideASheet_KeepsTheOrderOfItsStiffness) {
  Host host;
  const Mesh cube = kuhn_bar(3, 3, 3, 0.1);
  Mesh both = kuhn_bar(20, 20, 1, 1);
  for (uint32_t i = 0; i < both.npoint(); ++i) both.rest[3 * i + 2] *= 0.01;
  const Mesh sheet = both;
  const uint32_t first = both.npoint();
  for (uint32_t i = 0; i < cube.npoint(); ++i)
    both.rest.insert(both.rest.end(), {cube.at(i)[0] + 50, cube.at(i)[1], cube.at(i)[2]});
  for (uint32_t c : cube.cells) both.cells.push_back(first + c);
  both.finish();
  Instance alone(host, cube, {}), beside(host, both, {});
  for (int k = 0; k < 3; ++k) {  // stretched along one axis
    for (uint32_t i = 0; i < cube.npoint(); ++i) {
      Vec a = cube.at(i), b = both.at(first + i);
      a[k] *= 1.001;
      b[k] += 0.001 * cube.at(i)[k];
      alone.set(alone.x, i, a);
      beside.set(beside.x, first + i, b);
    }
    const double ratio = beside.energy() / alone.energy();
    EXPECT_GT(ratio, 1.0 / 3) << k;
    EXPECT_LT(ratio, 3) << k;
  }
  Instance flat(host, sheet, {}), under(host, both, {});
  for (int k = 0; k < 2; ++k) {
    for (uint32_t i = 0; i < first; ++i) {
      Vec a = sheet.at(i);
      a[k] *= 1.001;
      flat.set(flat.x, i, a);
      under.set(under.x, i, a);
    }
    EXPECT_GT(under.energy() / flat.energy(), 1.0 / 3) << k;
    EXPECT_LT(under.energy() / flat.energy(), 3) << k;
  }
}

TEST(MsmMaterial, UniformFields_AreTheParametersAndUnevenOnesAddUpByCell) {
  Host host;
  const Mesh mesh = kuhn_bar(6, 2, 2, 0.1, 0.2);
  const auto all = [&](double value) { return std::vector<double>(mesh.ncell(), value); };
  Instance plain(host, mesh, {3e4, 0.4, 0.002, 3, 1.5});
  Instance field(host, mesh, {}, 4,
                 {{"young", all(3e4)},
                  {"poisson", all(0.4)},
                  {"damping_stiffness", all(0.002)},
                  {"damping_mass", all(3)},
                  {"volume", all(1.5)}});
  plain.shake(0.01, 1);
  field.shake(0.01, 1);
  plain.forces();
  field.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
  EXPECT_NEAR(plain.bound() / field.bound(), 1, 1e-12);

  // Forces are a sum over cells: those of a body of two materials are those of its halves, each in a body
  // whose other half is nothing.
  Fields both, left, right;
  for (uint32_t c = 0; c < mesh.ncell(); ++c) {
    const bool l = mesh.at(mesh.cells[4 * c])[0] < 0.25;
    const auto add = [&](const char *key, double a, double b, double none) {
      both[key].push_back(l ? a : b);
      left[key].push_back(l ? a : none);
      right[key].push_back(l ? none : b);
    };
    add("young", 1e5, 3e4, 1e-3);
    add("poisson", 0.45, 0.1, 0.25);
    add("damping_stiffness", 0.001, 0.004, 0);
    add("volume", 2, 0, 0);
  }
  Instance sum(host, mesh, {}, 4, both), a(host, mesh, {}, 4, left), b(host, mesh, {}, 4, right);
  for (Instance *m : {&sum, &a, &b}) {
    m->shake(0.01, 1);
    m->forces();
  }
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    // nothing is 1e-8 of something
    EXPECT_LT(norm(sum.get(sum.f, i) - a.get(a.f, i) - b.get(b.f, i)), 1e-7 * sum.largest_force()) << i;
}

TEST(MsmMaterial, DragByCell_WeighsByVolumeAroundAPoint) {
  Mesh m = irregular_tet();
  m.rest.insert(m.rest.end(), {0.6, 0.4, -1.3});
  m.cells.insert(m.cells.end(), {0, 2, 1, 4});
  m.finish();
  Host host;
  Instance b(host, m, {}, 4, {{"damping_mass", {2, 10}}});
  for (uint32_t i = 0; i < 5; ++i) b.set(b.v, i, {1, -2, 3});
  b.forces();
  const double v0 = m.volume(0);
  const double v1 = m.volume(1);
  const double mixed = (2 * v0 + 10 * v1) / (v0 + v1);
  const double drag[] = {mixed, mixed, mixed, 2, 10};
  for (uint32_t i = 0; i < 5; ++i)
    EXPECT_LT(norm(b.get(b.f, i) + (drag[i] * m.mass[i]) * Vec{1, -2, 3}), 1e-11 * m.mass[i]);
}

// M3: m x'' + c x' + k x = F from rest, with m = 0.2, k = 50, c = 0.4: the free point of a cell whose base is
// held. A force of 1e-5 N keeps x so small that the springs are linear to 1e-7.
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
    *vel = v;
    b.forces();
    const double a0 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + 0.5 * h * v;
    *vel = v + 0.5 * h * a0;
    b.forces();
    const double a1 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + h * (v + 0.5 * h * a0);
    v += h * a1;
    if (n % 500) continue;
    const double t = n * h;
    const double turn = std::cos(wd * t) + zeta / std::sqrt(1 - zeta * zeta) * std::sin(wd * t);
    const double exact = force / k * (1 - std::exp(-zeta * w0 * t) * turn);
    worst = std::max(worst, std::abs((*x - rest) - exact) / (force / k));
    // x of a unit force at 0.01 s
    if (n == 500) {
      EXPECT_NEAR((*x - rest) / force, 0.000247825376157322, 1e-8);
    }
    // at 0.05 s
    if (n == 2500) {
      EXPECT_NEAR((*x - rest) / force, 0.00574037939570326, 1e-8);
    }
  }
  EXPECT_LT(worst, 1e-6);
}

}  // namespace
}  // namespace msm_test
