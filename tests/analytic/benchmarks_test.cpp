// Benchmarks of elasticity by second-order tetrahedra and hexahedra of 8, 20 and 27 points, each against its
// converged value (reference/elasticity/cases.json) or its closed form: NAFEMS LE1, LE10, LE11 (The Standard
// NAFEMS Benchmarks, 1990), Cook's membrane (1974), the twisted beam of MacNeal and Harder (1985), Lame's
// cylinder and sphere; orders of convergence, patch tests and frequencies. static_test.cpp has first-order
// tetrahedra.
#include <cstring>
#include <random>

#include "dense.h"
#include "mapped_solid.h"

namespace {

using test::Counts;
using test::kHex20;
using test::kHex27;
using test::kHex8;
using test::kTet10;
using test::MappedSolid;
using test::Vec;

constexpr double kRight = M_PI / 2;

bool on_ellipse(const Vec &x, double a, double b) {
  return std::abs(std::pow(x[0] / a, 2) + std::pow(x[1] / b, 2) - 1) < 1e-9;
}
int symmetry(const Vec &x) { return (x[0] == 0 ? 1 : 0) | (x[1] == 0 ? 2 : 0); }

// A quarter of the plate between two ellipses, from one height to another.
test::Brick elliptic(Counts n, double from, double to, Vec power) {
  return {n,
          [=](double a, double b, double c) -> Vec {
            return {(2 + 1.25 * a) * std::cos(kRight * b), (1 + 1.75 * a) * std::sin(kRight * b),
                    from + (to - from) * c};
          },
          power};
}
double le1(uint32_t kind, Counts n) {
  MappedSolid s(kind, {elliptic(n, 0, 0.05, {2, 2, 1})}, 2.1e11, 0.3);
  s.hold([](const Vec &x) { return symmetry(x) | (x[2] == 0 ? 4 : 0); });
  s.pull([](const Vec &x) { return on_ellipse(x, 3.25, 2.75); },
         [](const Vec &out) -> Vec { return {1e7 * out[0], 1e7 * out[1], 0}; });
  s.solve();
  return s.stress({2, 0, 0}, 1);
}
double le10(uint32_t kind, Counts n) {
  MappedSolid s(kind,
                {elliptic({n[0], n[1], n[2] - 1}, 0.6, 0.3, {1.5, 1.5, 2}),
                 elliptic({n[0], n[1], 1}, 0, 0.3, {1.5, 1.5, 1})},
                2.1e11, 0.3);
  s.hold([](const Vec &x) {
    if (on_ellipse(x, 3.25, 2.75)) return std::abs(x[2] - 0.3) < 1e-9 ? 7 : 3;
    return symmetry(x);
  });
  s.pull([](const Vec &x) { return std::abs(x[2] - 0.6) < 1e-9; },
         [](const Vec &out) -> Vec { return {0, 0, -1e6 * out[2]}; });
  s.solve();
  return s.stress({2, 0, 0.6}, 1);
}
// A cylinder over a taper over a part of a sphere, warmed by hypot(x, y) + z; n: through the wall, around,
// up.
double le11(uint32_t kind, Counts n) {
  const auto around = [](double r, double z, double t) -> Vec {
    return {r * std::cos(kRight * t), r * std::sin(kRight * t), z};
  };
  const double low = std::sqrt(0.5), rim = std::sqrt(1.4 * 1.4 - 0.5), top = low + 1.09;
  const Counts third = {n[0], n[1], n[2] / 3};
  const auto ball = [&](double a, double b, double c) {
    const double in = M_PI / 4 * c, out = std::atan2(low, rim) * c;
    return around((1 - a) * std::cos(in) + 1.4 * a * std::cos(out),
                  (1 - a) * std::sin(in) + 1.4 * a * std::sin(out), b);
  };
  const auto taper = [&](double a, double b, double c) {
    return around((1 - a) * low + a * (rim + (1 - rim) * c), low + 0.69 * c, b);
  };
  const auto tube = [&](double a, double b, double c) {
    return around((1 - a) * low + a, low + 0.69 + 0.4 * c, b);
  };
  MappedSolid s(kind, {{third, ball, {1.5, 1, 1.5}}, {third, taper, {1.5, 1, 1}}, {third, tube, {1.5, 1, 1}}},
                2.1e11, 0.3);
  s.hold([&](const Vec &x) { return symmetry(x) | (x[2] == 0 || std::abs(x[2] - top) < 1e-9 ? 4 : 0); });
  const auto strain = [](const Vec &x) { return 2.3e-4 * (std::hypot(x[0], x[1]) + x[2]); };
  s.warm(strain);
  s.solve();
  const Vec where = {1, 0, 0};
  return s.stress(where, 2) - (3 * s.lambda + 2 * s.mu) * strain(where);
}

// A solid between x = 0, which is held, and x = length, on which a unit force acts along an axis.
MappedSolid clamped(uint32_t kind, const test::Brick &brick, double young, double poisson, double length,
                    double area, size_t axis, const std::function<int(const Vec &)> &held) {
  MappedSolid s(kind, {brick}, young, poisson);
  s.hold(held);
  s.pull([=](const Vec &x) { return std::abs(x[0] - length) < 1e-9; },
         [=](const Vec &) {
           Vec p{};
           p[axis] = 1 / area;
           return p;
         });
  s.solve();
  return s;
}
int clamp(const Vec &x) { return x[0] == 0 ? 7 : 0; }

MappedSolid cook(uint32_t kind, Counts n, double thick, double poisson,
                 const std::function<int(const Vec &)> &held) {
  const auto at = [=](double a, double b, double c) -> Vec {
    return {48 * a, 44 * a + (44 - 28 * a) * b, thick * c};
  };
  return clamped(kind, {n, at}, 1e6, poisson, 48, 16, 1, held);
}
// Young's modulus is 1e6 times that of the reference, and the unit force is one per thickness.
double cook_slab(uint32_t kind, Counts n) {
  return 1e6 * cook(kind, n, 1, 1.0 / 3, clamp).displacement({48, 60, 0}, 1);
}
double cook_plane_stress(uint32_t kind, Counts n) {
  const auto held = [](const Vec &x) { return (x[0] == 0 ? 3 : 0) | (x[2] == 0 ? 4 : 0); };
  return 1e6 * cook(kind, n, 0.5, 1.0 / 3, held).displacement({48, 52, 0}, 1);
}
double cook_plane_strain(uint32_t kind, Counts n) {
  const auto held = [](const Vec &x) { return x[0] == 0 ? 7 : 4; };
  return 1e6 * cook(kind, n, 0.5, 0.4999, held).displacement({48, 60, 0}, 1);
}

double twisted(uint32_t kind, Counts n, size_t axis) {
  const auto at = [](double a, double b, double c) -> Vec {
    const double w = 1.1 * (b - 0.5), t = 0.32 * (c - 0.5), turn = kRight * a;
    return {12 * a, w * std::cos(turn) - t * std::sin(turn), w * std::sin(turn) + t * std::cos(turn)};
  };
  return clamped(kind, {n, at}, 29e6, 0.22, 12, 1.1 * 0.32, axis, clamp).work();
}
double twisted_y(uint32_t kind, Counts n) { return twisted(kind, n, 1); }
double twisted_z(uint32_t kind, Counts n) { return twisted(kind, n, 2); }

test::Brick bar_of(Counts n) {
  return {n, [](double a, double b, double c) -> Vec { return {a, 0.1 * b, 0.1 * c}; }};
}
double bar(uint32_t kind, Counts n) { return clamped(kind, bar_of(n), 1e5, 0.3, 1, 0.01, 2, clamp).work(); }
// Lame: u = A r + B / r of the cylinder in plane strain, A r + B / r^2 of the sphere.
constexpr double kInner = 0.05, kOuter = 0.1, kPressure = 1000, kYoung = 1e5;
double outward(double r, double poisson) {
  const double a2 = kInner * kInner, b2 = kOuter * kOuter, f = kPressure * a2 / (b2 - a2);
  return (1 + poisson) / kYoung * f * ((1 - 2 * poisson) * r + b2 / r);
}
double outward_of_sphere(double poisson) {
  const double a3 = std::pow(kInner, 3), b3 = std::pow(kOuter, 3);
  return kPressure * a3 / (b3 - a3) / kYoung * kInner * ((1 - 2 * poisson) + (1 + poisson) / 2 * b3 / a3);
}
void press(MappedSolid &s, bool sphere) {
  s.pull(
      [=](const Vec &x) { return std::abs(std::hypot(x[0], x[1], sphere ? x[2] : 0) - kInner) < 1e-9; },
      [](const Vec &out) -> Vec { return {-kPressure * out[0], -kPressure * out[1], -kPressure * out[2]}; });
  s.solve();
}
MappedSolid cylinder(uint32_t kind, Counts n, double poisson) {
  const auto at = [](double a, double b, double c) -> Vec {
    const double r = kInner + (kOuter - kInner) * a;
    return {r * std::cos(kRight * b), r * std::sin(kRight * b), 0.01 * c};
  };
  MappedSolid s(kind, {{n, at}}, kYoung, poisson);
  s.hold([](const Vec &x) { return symmetry(x) | 4; });
  press(s, false);
  return s;
}
// An eighth by three bricks, one for each face of a cube.
MappedSolid sphere(uint32_t kind, Counts n, double poisson) {
  std::vector<test::Brick> bricks;
  for (size_t face = 0; face < 3; ++face)
    bricks.push_back({n, [=](double a, double b, double c) {
                        Vec x{};
                        x[face] = 1;
                        x[face == 0 ? 1 : 0] = std::tan(M_PI / 4 * b);
                        x[face == 2 ? 1 : 2] = std::tan(M_PI / 4 * c);
                        const double r = (kInner + (kOuter - kInner) * a) / std::hypot(x[0], x[1], x[2]);
                        for (double &v : x) v *= r;
                        return x;
                      }});
  MappedSolid s(kind, bricks, kYoung, poisson);
  s.hold([](const Vec &x) { return symmetry(x) | (x[2] == 0 ? 4 : 0); });
  press(s, true);
  return s;
}
// Mean displacement of the inner face, from the work of the pressure.
constexpr double kFace = kPressure * kRight * kInner;  // N/m
template <int kPermille>
double cylinder_widens(uint32_t kind, Counts n) {
  return cylinder(kind, n, kPermille / 1000.0).work() / (kFace * 0.01);
}
template <int kPermille>
double sphere_widens(uint32_t kind, Counts n) {
  return sphere(kind, n, kPermille / 1000.0).work() / (kFace * kInner);
}
double hoop_of_cylinder(uint32_t kind, Counts n) {
  return cylinder(kind, n, 0.3).stress({kInner, 0, 0.005}, 1);
}
double hoop_of_sphere(uint32_t kind, Counts n) { return sphere(kind, n, 0.3).stress({kInner, 0, 0}, 1); }

struct Row {
  const char *name;
  double (*value)(uint32_t kind, Counts n);
  uint32_t kind;
  Counts n;
  double reference, tolerance;
};

// unsanitized: too slow there; plugin.CellBody runs the same code
TEST(Benchmarks, ValuesOfTheTable_AreReached) {
  const auto check = [](const Row &r) {
    const double ratio = r.value(r.kind, r.n) / r.reference;
    std::printf("%-24s %-24s %2u x %2u x %2u  %+.2f %%\n", r.name, test::cells_of(r.kind).name, r.n[0],
                r.n[1], r.n[2], 100 * (ratio - 1));
    EXPECT_NEAR(ratio, 1, r.tolerance) << r.name << ", " << test::cells_of(r.kind).name;
  };
  const Row rows[] = {
      {"LE1, stress yy", le1, kTet10, {8, 16, 1}, 92658992.83574139, 0.01},
      {"LE10, stress yy", le10, kTet10, {8, 12, 4}, -5382085.012387738, 0.01},
      {"LE11, stress zz", le11, kTet10, {4, 8, 18}, -106023795.44120494, 0.01},
      {"LE1, stress yy", le1, kHex8, {8, 16, 1}, 92658992.83574139, 0.01},
      {"LE10, stress yy", le10, kHex8, {16, 24, 8}, -5382085.012387738, 0.03},
      {"LE11, stress zz", le11, kHex8, {8, 16, 36}, -106023795.44120494, 0.01},
      {"Cook, plane stress", cook_plane_stress, kTet10, {8, 8, 1}, 23.967742422116622, 0.01},
      {"Cook, plane stress", cook_plane_stress, kHex8, {16, 16, 1}, 23.967742422116622, 0.01},
      {"Cook, slab", cook_slab, kTet10, {16, 16, 1}, 25.071512047568202, 0.01},
      {"Cook, slab", cook_slab, kHex8, {24, 24, 2}, 25.071512047568202, 0.01},
      {"Cook, poisson 0.4999", cook_plane_strain, kTet10, {24, 24, 1}, 19.427921689478026, 0.01},
      {"Cook, poisson 0.4999", cook_plane_strain, kHex8, {40, 40, 1}, 19.427921689478026, 0.01},
      {"twisted beam, y", twisted_y, kTet10, {24, 2, 1}, 0.0017532043130333605, 0.01},
      {"twisted beam, z", twisted_z, kTet10, {24, 2, 1}, 0.005422969874624581, 0.01},
      {"twisted beam, y", twisted_y, kHex8, {24, 4, 2}, 0.0017532043130333605, 0.01},
      {"twisted beam, z", twisted_z, kHex8, {24, 4, 2}, 0.005422969874624581, 0.01},
      // on the mesh that the authors name
      {"twisted beam, y", twisted_y, kTet10, {12, 2, 1}, 0.0017532043130333605, 0.02},
      {"twisted beam, z", twisted_z, kTet10, {12, 2, 1}, 0.005422969874624581, 0.02},
      {"twisted beam, y", twisted_y, kHex8, {12, 2, 1}, 0.0017532043130333605, 0.02},
      {"twisted beam, z", twisted_z, kHex8, {12, 2, 1}, 0.005422969874624581, 0.02},
      {"bar", bar, kTet10, {20, 2, 2}, 0.4003982437917666, 0.01},
      {"cylinder", cylinder_widens<300>, kTet10, {2, 4, 1}, outward(kInner, 0.3), 0.01},
      {"cylinder", cylinder_widens<300>, kHex8, {8, 16, 1}, outward(kInner, 0.3), 0.01},
      {"cylinder, poisson 0.499", cylinder_widens<499>, kTet10, {2, 4, 1}, outward(kInner, 0.499), 0.01},
      {"cylinder, poisson 0.499", cylinder_widens<499>, kHex8, {8, 16, 1}, outward(kInner, 0.499), 0.01},
      {"cylinder, hoop stress", hoop_of_cylinder, kTet10, {6, 12, 1}, kPressure * 5 / 3, 0.01},
      {"cylinder, hoop stress", hoop_of_cylinder, kHex8, {8, 16, 1}, kPressure * 5 / 3, 0.01},
      {"sphere", sphere_widens<300>, kTet10, {2, 2, 2}, outward_of_sphere(0.3), 0.01},
      {"sphere", sphere_widens<300>, kHex8, {10, 10, 10}, outward_of_sphere(0.3), 0.01},
      {"sphere, poisson 0.499", sphere_widens<499>, kTet10, {2, 2, 2}, outward_of_sphere(0.499), 0.01},
      {"sphere, poisson 0.499", sphere_widens<499>, kHex8, {10, 10, 10}, outward_of_sphere(0.499), 0.01},
      {"sphere, hoop stress", hoop_of_sphere, kTet10, {4, 5, 5}, kPressure * 5 / 7, 0.01},
      {"sphere, hoop stress", hoop_of_sphere, kHex8, {10, 10, 10}, kPressure * 5 / 7, 0.01},
      {"sphere, hoop stress", hoop_of_sphere, kHex20, {6, 8, 8}, kPressure * 5 / 7, 0.01},
  };
  for (const Row &r : rows) check(r);
  const Row both[] = {
      {"LE1, stress yy", le1, 0, {8, 16, 1}, 92658992.83574139, 0.01},
      {"LE10, stress yy", le10, 0, {8, 12, 4}, -5382085.012387738, 0.01},
      {"LE11, stress zz", le11, 0, {4, 8, 18}, -106023795.44120494, 0.01},
      {"Cook, plane stress", cook_plane_stress, 0, {8, 8, 1}, 23.967742422116622, 0.01},
      {"Cook, slab", cook_slab, 0, {16, 16, 1}, 25.071512047568202, 0.01},
      {"Cook, poisson 0.4999", cook_plane_strain, 0, {24, 24, 1}, 19.427921689478026, 0.01},
      {"twisted beam, y", twisted_y, 0, {12, 2, 1}, 0.0017532043130333605, 0.01},
      {"twisted beam, z", twisted_z, 0, {12, 2, 1}, 0.005422969874624581, 0.01},
      {"bar", bar, 0, {20, 1, 1}, 0.4003982437917666, 0.01},
      {"cylinder", cylinder_widens<300>, 0, {2, 4, 1}, outward(kInner, 0.3), 0.01},
      {"cylinder, poisson 0.499", cylinder_widens<499>, 0, {2, 4, 1}, outward(kInner, 0.499), 0.01},
      {"cylinder, hoop stress", hoop_of_cylinder, 0, {6, 12, 1}, kPressure * 5 / 3, 0.01},
      {"sphere", sphere_widens<300>, 0, {2, 2, 2}, outward_of_sphere(0.3), 0.01},
      {"sphere, poisson 0.499", sphere_widens<499>, 0, {2, 2, 2}, outward_of_sphere(0.499), 0.01},
  };
  for (Row r : both)
    for (const uint32_t kind : {kHex20, kHex27}) {
      r.kind = kind;
      check(r);
    }
}

// Errors of displacement and strain in the mean square over the cylinder.
std::array<double, 2> errors_of(uint32_t kind, uint32_t cells, double poisson) {
  const MappedSolid s = cylinder(kind, {cells, 2 * cells, 1}, poisson);
  double off[2] = {}, all[2] = {};
  s.each_point([&](const uint32_t *cell, const test::Shape &p, double volume) {
    const double r = std::hypot(p.at[0], p.at[1]), d = 1e-6, along = outward(r, poisson) / r;
    const double across = (outward(r + d, poisson) - outward(r - d, poisson)) / (2 * d);
    const Vec n = {p.at[0] / r, p.at[1] / r, 0};
    double u[3] = {}, h[3][3] = {};
    for (size_t k = 0; k < s.nodes; ++k)
      for (size_t i = 0; i < 3; ++i) {
        u[i] += p.n[k] * s.u[3 * size_t(cell[k]) + i];
        for (size_t j = 0; j < 3; ++j) h[i][j] += s.u[3 * size_t(cell[k]) + i] * p.g[k][j];
      }
    for (size_t i = 0; i < 3; ++i) {
      off[0] += volume * std::pow(u[i] - outward(r, poisson) * n[i], 2);
      all[0] += volume * std::pow(outward(r, poisson) * n[i], 2);
      for (size_t j = 0; j < 3; ++j) {
        const double exact = across * n[i] * n[j] + along * ((i == j && i < 2) - n[i] * n[j]);
        off[1] += volume * std::pow(0.5 * (h[i][j] + h[j][i]) - exact, 2);
        all[1] += volume * exact * exact;
      }
    }
  });
  return {std::sqrt(off[0] / all[0]), std::sqrt(off[1] / all[1])};
}

// unsanitized: too slow there; plugin.CellBars has a smaller body
TEST(Benchmarks, ThickCylinder_ConvergesByTheOrderOfTheCells) {
  for (const double poisson : {0.3, 0.499})
    for (const uint32_t kind : {kTet10, kHex8, kHex20, kHex27}) {
      const std::array<double, 2> coarse = errors_of(kind, 4, poisson), fine = errors_of(kind, 8, poisson);
      const double order = kind == kHex8 ? 2 : 3;
      EXPECT_GT(std::log2(coarse[0] / fine[0]), order - 0.1) << kind << " " << poisson;
      EXPECT_GT(std::log2(coarse[1] / fine[1]), order - 1.15) << kind << " " << poisson;
      if (kind != kHex8) {
        EXPECT_LT(fine[0], 1e-4) << poisson;
        EXPECT_LT(fine[1], 0.003) << poisson;
      }
    }
}

// Points on the border follow an affine map, which the inner ones have to find: a strain, for the
// corotational model with a rotation.
TEST(Benchmarks, PatchOfDistortedCells_FollowsAnAffineMap) {
  constexpr double kStrain[3][3] = {{1e-3, 3e-4, -2e-4}, {3e-4, -7e-4, 4e-4}, {-2e-4, 4e-4, 6e-4}};
  constexpr double kTurn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
  const auto at = [](double a, double b, double c) -> Vec {
    const double by = 6 * a * (1 - a) * b * (1 - b) * c * (1 - c);
    return {a + by * std::sin(5 * b + 1), b + by * std::sin(4 * c), c + by * std::sin(6 * a + 2)};
  };
  for (const uint32_t kind : {kTet10, kHex8, kHex20, kHex27})
    for (const bool turned : {false, true}) {
      MappedSolid s(kind, {{{3, 3, 3}, at}}, 1e5, 0.3, turned ? "corotational_fem" : "linear_fem");
      std::vector<double> exact(s.points.size()), start(exact);
      const auto inner = [](const Vec &x) {
        return std::all_of(x.begin(), x.end(), [](double v) { return v > 1e-9 && v < 1 - 1e-9; });
      };
      for (size_t i = 0; i < s.npoint(); ++i) {
        const Vec x = s.point(i);
        const size_t to = 3 * size_t(s.body.of_node[i]);
        Vec strained = x;
        for (size_t r = 0; r < 3; ++r)
          for (size_t c = 0; c < 3; ++c) strained[r] += kStrain[r][c] * x[c];
        for (size_t r = 0; r < 3; ++r)
          for (size_t c = 0; c < 3; ++c) {
            const double turn = turned ? kTurn[r][c] : r == c;
            exact[to + r] += turn * strained[c];
            start[to + r] += turn * (inner(x) ? x : strained)[c];
          }
      }
      test::ok(dfm_body_set_state(s.body.body, s.body.npoint, start.data(), nullptr));
      s.hold([&](const Vec &x) { return inner(x) ? 0 : 7; });
      s.body.solve();
      const std::vector<double> x = s.body.positions();
      double most = 0;
      for (size_t i = 0; i < x.size(); ++i) most = std::max(most, std::abs(x[i] - exact[i]));
      EXPECT_LT(most, 1e-12) << kind << " " << turned;
    }
}

// kg, of a bar of 10 kg in one box-shaped cell: the squares of the shape functions, scaled to the whole mass
// (E. Hinton, T. Rock, O. C. Zienkiewicz, Earthq. Eng. Struct. Dyn. 4, 1976).
double share_of(uint32_t kind, size_t node) {
  if (kind == kTet10) return node < 4 ? 10.0 / 36 : 40.0 / 27;
  if (kind == kHex8) return 10.0 / 8;
  if (kind == kHex20) return node < 8 ? 70.0 / 248 : 20.0 / 31;
  return node < 8 ? 10.0 / 216 : node < 20 ? 40.0 / 216 : node < 26 ? 160.0 / 216 : 640.0 / 216;
}

// The lowest frequencies of the clamped bar, Hz: subspace iteration with the library's equilibria and lumped
// masses.
std::vector<double> frequencies(uint32_t kind, Counts n, size_t count) {
  MappedSolid s(kind, {bar_of(n)}, 1e7, 0.3);
  s.hold(clamp);
  const size_t all = s.points.size();
  std::vector<double> mass(all);
  for (size_t c = 0; c < s.ncell(); ++c)
    for (size_t k = 0; k < s.nodes; ++k)
      for (size_t r = 0; r < 3; ++r)
        mass[3 * size_t(s.cell(c)[k]) + r] += share_of(kind, k) / double(s.ncell());
  using Field = std::vector<double>;
  const auto inner = [&](const Field &a, const Field &b) {
    double sum = 0;
    for (size_t i = 0; i < all; ++i) sum += mass[i] * a[i] * b[i];
    return sum;
  };
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Field> v(count, Field(all));
  for (Field &x : v) std::generate(x.begin(), x.end(), [&] { return normal(random); });
  std::vector<double> out(count);
  for (int round = 0; round < 5; ++round) {
    std::vector<Field> next;
    for (size_t a = 0; a < count; ++a) {
      for (size_t b = 0; b < a; ++b) {
        const double along = inner(v[a], v[b]);
        for (size_t i = 0; i < all; ++i) v[a][i] -= along * v[b][i];
      }
      const double length = std::sqrt(inner(v[a], v[a]));
      for (double &x : v[a]) x /= length;
      for (size_t i = 0; i < all; ++i) s.loads[i] = mass[i] * v[a][i];
      s.solve();
      next.push_back(s.u);
    }
    // the flexibility on these vectors, turned to its axes by Jacobi's method
    test::Dense m(count, count);
    for (size_t a = 0; a < count; ++a)
      for (size_t b = 0; b < count; ++b) m(a, b) = 0.5 * (inner(v[a], next[b]) + inner(v[b], next[a]));
    for (int sweep = 0; sweep < 8; ++sweep)
      for (size_t p = 0; p < count; ++p)
        for (size_t q = p + 1; q < count; ++q) {
          const double angle = 0.5 * std::atan2(2 * m(p, q), m(q, q) - m(p, p));
          const auto turn = [cosine = std::cos(angle), sine = std::sin(angle)](double &x, double &y) {
            const double was = x;
            x = cosine * was - sine * y;
            y = sine * was + cosine * y;
          };
          for (size_t k = 0; k < count; ++k) turn(m(p, k), m(q, k));
          for (size_t k = 0; k < count; ++k) turn(m(k, p), m(k, q));
          for (size_t i = 0; i < all; ++i) turn(next[p][i], next[q][i]);
        }
    for (size_t k = 0; k < count; ++k) out[k] = 1 / (2 * M_PI * std::sqrt(m(k, k)));
    v = next;
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Bending about each axis twice, torsion, along the axis, with one and two cells across. Lumped masses lower
// torsion, as the rotary inertia of the section is that of points at its border.
TEST(Benchmarks, BarOfCellsThatBend_VibratesAsTheReference) {
  const double exact[6] = {1.6110655, 1.6110655, 9.6617503, 9.6617503, 14.273807, 25.076516};
  constexpr struct {
    uint32_t kind;
    double one, one_in_torsion, two, two_in_torsion;
  } kRows[] = {{kTet10, 0.01, 0.13, 0.006, 0.05},
               {kHex8, 0.08, 0.34, 0.005, 0.12},
               {kHex20, 0.03, 0.28, 0.011, 0.12},
               {kHex27, 0.004, 0.09, 0.0004, 0.008}};
  for (const auto &row : kRows) {
    const std::vector<double> coarse = frequencies(row.kind, {10, 1, 1}, 9),
                              fine = frequencies(row.kind, {10, 2, 2}, 9);
    for (size_t k = 0; k < 6; ++k) {
      SCOPED_TRACE(std::string(test::cells_of(row.kind).name) + ", mode " + std::to_string(k));
      EXPECT_NEAR(coarse[k] / exact[k], 1, k == 4 ? row.one_in_torsion : row.one);
      EXPECT_NEAR(fine[k] / exact[k], 1, k == 4 ? row.two_in_torsion : row.two);
    }
  }
}

}  // namespace
