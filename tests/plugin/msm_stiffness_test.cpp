// Blocks of the tangent: its pattern, differences of the forces where nothing is left out, what is left out
// by name, and that the sum is negative semidefinite in every shape.
#include "model_tangent.h"
#include "msm_host.h"

namespace msm_test {
namespace {

enum { kVoigt, kMaxwell, kSls };

Params springs_only(double slope = 0, bool form_a = false, bool stiffer = false) {
  Params p = {1e5, 0.3, 0, 0, 0};
  p.slope = slope;
  p.axis = {1, 1, 0.3};
  p.form_a = form_a;
  p.stiffer = stiffer;
  return p;
}
Params relaxing(int damper, double slope = 0) {
  Params p = springs_only(slope);
  p.damper = damper;
  p.ratio = 0.7;
  p.time = 0.01;
  return p;
}

// Every spring longer than at rest, by an uneven strain and a turn.
void stretch(Instance &b, double by = 1.3) {
  const Vec about = (1 / std::sqrt(14.0)) * Vec{-1, 3, 2};
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, rotate({by * x[0] + 0.1 * x[1], (by + 0.1) * x[1], (by - 0.1) * x[2]}, about, 0.8));
  }
  b.shake(0.004, 0);
}

TEST(MsmStiffness, Pattern_IsEachPointAndEachSpringOnce) {
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), {});
  expect_pattern_of_edges(b);
}

TEST(MsmStiffness, StretchedSprings_AreDifferencesOfTheForces) {
  const std::pair<const char *, Params> all[] = {{"plain", springs_only()},
                                                 {"B softer", springs_only(2)},
                                                 {"A softer", springs_only(2, true)},
                                                 {"B stiffer", springs_only(0.7, false, true)},
                                                 {"A stiffer", springs_only(0.7, true, true)},
                                                 {"maxwell", relaxing(kMaxwell)},
                                                 {"sls", relaxing(kSls)},
                                                 {"sls tilted", relaxing(kSls, 1.5)}};
  for (const auto &[name, p] : all) {
    Host host;
    Instance b(host, kuhn_bar(2, 2, 1, 0.1), p);
    b.dt = 3e-3;
    if (p.damper != kVoigt) {  // what a step has left behind
      stretch(b, 1.2);
      b.forces_and_step();
    }
    stretch(b);
    const Dense k = tangent(b, 1, 0);
    // fourth-order error of springs of 0.1 m: (step/0.1)^2; rounding 1e-16 over step/0.1
    EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-6)), 1e-8 * largest(k)) << name;
    Dense scaled = k;
    for (double &x : scaled.value) x *= 2.5;
    EXPECT_LT(largest_difference(tangent(b, 2.5, 0), scaled), 1e-13 * largest(scaled)) << name;
  }
}

TEST(MsmStiffness, DampersAndDrag_AreDifferencesByVelocity) {
  Fields uneven;
  const Mesh mesh = kuhn_bar(2, 2, 1, 0.1);
  for (uint32_t c = 0; c < mesh.ncell(); ++c) {
    uneven["damping_stiffness"].push_back(c % 3 ? 0 : 0.01);
    uneven["damping_mass"].push_back(c % 5);
  }
  for (const Fields &fields : {Fields{}, uneven})
    for (Params p : {springs_only(), springs_only(2), springs_only(2, true), relaxing(kSls, 1)}) {
      p.damping_stiffness = 0.004;
      p.damping_mass = 3;
      Host host;
      Instance b(host, mesh, p, 4, fields);
      stretch(b);
      const Dense c = tangent(b, 0, 1);
      EXPECT_LT(largest_difference(c, differences(b, b.v, 1.0)), 1e-10 * largest(c)) << p.slope;
      EXPECT_TRUE(below(c, 1e-12 * largest(c)));
    }
}

// The force of each cell on its corners with the pressures of the present shape kept.
std::vector<Vec> held_pressures(const Instance &b, const std::vector<double> &pressure) {
  std::vector<Vec> f(b.size(), Vec{});
  for (uint32_t c = 0; c < b.mesh.ncell(); ++c)
    for (int a = 0; a < 4; ++a) {
      const uint32_t *q = &b.mesh.cells[4 * c];
      const Vec o = b.get(b.x, q[(a + 1) & 3]);
      const Vec normal = cross(b.get(b.x, q[(a + 2) & 3]) - o, b.get(b.x, q[(a + 3) & 3]) - o);
      f[q[a]] = f[q[a]] + (a % 2 ? 1 : -1) * pressure[c] * normal;
    }
  return f;
}

TEST(MsmStiffness, VolumeTerm_LacksTheSecondDerivativeOfTheVolumesAlone) {
  Host host;
  Params p = springs_only();
  p.poisson = 0.45;
  p.volume = 1;
  Instance b(host, kuhn_bar(2, 2, 1, 0.1, 0.2), p);
  stretch(b, 1.15);
  std::vector<double> pressure;
  for (uint32_t c = 0; c < b.mesh.ncell(); ++c) {
    const uint32_t *q = &b.mesh.cells[4 * c];
    const Vec o = b.get(b.x, q[0]);
    const double now = dot(b.get(b.x, q[1]) - o, cross(b.get(b.x, q[2]) - o, b.get(b.x, q[3]) - o));
    const double rest = 6 * b.mesh.volume(c);
    pressure.push_back(p.young / (3 * (1 - 2 * p.poisson)) / (6 * rest) * (rest - now));
  }
  std::vector<Vec> f;
  const Dense held =
      differences(b, b.x, 1e-4, [&] { f = held_pressures(b, pressure); }, [&](uint32_t i) { return f[i]; });
  const Dense k = tangent(b, 1, 0), all = differences(b, b.x, 1e-6);
  Dense sum = k;
  for (size_t n = 0; n < sum.value.size(); ++n) sum.value[n] += held.value[n];
  EXPECT_GT(largest(held), 0.05 * largest(k));  // what is left out is not rounding
  EXPECT_LT(largest_difference(sum, all), 1e-8 * largest(all));
}

// Resistance to collapse of one cell, alone: p = kC (0.6 rest - y), f = p grad y, hence - kC grad y grad y^T.
TEST(MsmStiffness, CollapseOfACellNearAndFarFromItsShape_IsTheDyadOfTheCountedVolume) {
  Params with = springs_only(), without = with;
  with.collapse = 3;
  Host host;
  const auto scaled = [](double x, double y, double z) { return Vec{x, y, z}; };
  for (const Vec &s : {scaled(1, 1, 0.4), scaled(0.8, 0.9, -0.3), scaled(3, 2, 0.02), scaled(2, 3, -0.05)}) {
    Instance a(host, irregular_tet(), with), b(host, irregular_tet(), without);
    for (Instance *m : {&a, &b}) {
      for (uint32_t i = 0; i < 4; ++i) {
        const Vec x = m->mesh.at(i);
        m->set(m->x, i, {s[0] * x[0], s[1] * x[1], s[2] * x[2]});
      }
      m->forces();
    }
    double q = 0, most = 0;
    for (uint32_t i = 0; i < 4; ++i)
      for (uint32_t j = 0; j < i; ++j) {
        q += dot(a.get(a.x, i) - a.get(a.x, j), a.get(a.x, i) - a.get(a.x, j));
        most += dot(a.mesh.at(i) - a.mesh.at(j), a.mesh.at(i) - a.mesh.at(j));
      }
    const double u = std::min(1.0, 3 * most / q), rest = 6 * a.mesh.volume(0);
    const double y = s[0] * s[1] * s[2] * rest * std::pow(u, 1.5) * (5 - 3 * u) / 2;
    ASSERT_GT(y, -rest);
    const double k = 3 * with.young / (6 * rest), pressure = k * (0.6 * rest - y);
    Dense expected(12, 12), got = tangent(a, 1, 0), rest_of_it = tangent(b, 1, 0);
    const auto by = [&](size_t n) {
      return (a.f[4 * (n / 3) + n % 3] - b.f[4 * (n / 3) + n % 3]) / pressure;
    };
    for (size_t r = 0; r < 12; ++r)
      for (size_t c = 0; c < 12; ++c) {
        expected(r, c) = -k * by(r) * by(c);
        got(r, c) -= rest_of_it(r, c);
      }
    EXPECT_LT(largest_difference(got, expected), 1e-10 * largest(got) + 1e-12 * largest(rest_of_it)) << s[2];
  }
}

TEST(MsmStiffness, CompressedSpring_KeepsItsLengthStiffnessAlone) {
  Host host;
  Instance b(host, regular_tet(), springs_only());
  b.mask({1, 2, 3, 4, 5}, false);
  b.set(b.x, 1, {0.5, 0, 0});
  const Dense k = tangent(b, 1, 0);
  const double stiffness = 1e5 * b.mesh.volume(0);
  for (size_t r = 0; r < 12; ++r)
    for (size_t c = 0; c < 12; ++c) {
      const bool ends = r % 3 == 0 && c % 3 == 0 && r < 6 && c < 6;
      EXPECT_NEAR(k(r, c), ends ? (r == c ? -stiffness : stiffness) : 0, 1e-12 * stiffness) << r << " " << c;
    }
}

TEST(MsmStiffness, EveryShape_IsNegativeSemidefiniteAndFinite) {
  const Mesh mesh = kuhn_bar(2, 2, 1, 0.1, 0.2);
  Params whole = relaxing(kSls, 1.5);
  whole.volume = -1;
  whole.collapse = 3;
  whole.poisson = 0.45;
  Params turned = springs_only(3, true);
  turned.volume = 1;
  for (Params p : {springs_only(), turned, relaxing(kMaxwell), whole})
    for (double size : {1.0, 0.3, 0.0, -1.0, 10.0, -30.0}) {
      p.damping_stiffness = 0.001;
      Host host;
      Instance b(host, mesh, p);
      for (uint32_t i = 0; i < b.size(); ++i) {
        const Vec x = b.mesh.at(i);
        b.set(b.x, i, {size * x[0], x[1], size * x[2]});
      }
      b.shake(size == 0 ? 0 : 0.03, 1);
      if (p.damper != kVoigt) b.forces_and_step();
      const Dense k = tangent(b, 1e-4, 1e-2);
      ASSERT_TRUE(std::isfinite(largest(k)));
      EXPECT_TRUE(below(k, 1e-10 * largest(k))) << size << " " << p.slope;
    }
}

TEST(MsmStiffness, NoStateForABranch_IsRefused) {
  Host host;
  Instance b(host, regular_tet(), relaxing(kMaxwell));
  dfm_kin k = b.kin();
  k.state = nullptr;
  std::vector<double> blk(90);
  EXPECT_EQ(b.ops->stiffness(b.self, &k, 1, 0, blk.data()), DFM_E_STATE);
}

}  // namespace
}  // namespace msm_test
