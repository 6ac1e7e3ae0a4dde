// The augmented Lagrangian on the matrix of the points against sweeps on the dense response, and against the
// conditions of contact themselves.
#include "contact/augmented.h"

#include <gtest/gtest.h>

#include "contact/linear_law.h"
#include "field_case.h"
#include "math/block3.h"

namespace {

using namespace dfm;
using test::FieldCase;
using test::FieldSetup;
using test::TestLaw;

Tolerance same_tolerance(uint32_t n, double most) {
  Tolerance t;
  t.normal.assign(n, most);
  t.tangent.assign(n, most);
  t.most_normal = most;
  return t;
}

struct Solved {
  ContactRows rows{Memory::standard()};
  uint32_t passes = 0;
  std::vector<double> speeds() const {
    std::vector<double> out;
    for (uint32_t i = 0; i < rows.n; ++i)
      for (int k = 0; k < 3; ++k) out.push_back(rows.velocity(i)[k]);
    return out;
  }
};

// Block Gauss-Seidel on A^-1 between the touched points, until nothing moves.
struct BySweeps : Solved {
  BySweeps(const FieldCase &c, const TestLaw &law) {
    c.build(true, rows);
    ContactState s;
    s.resize(rows.n, 0);
    const Tolerance t = same_tolerance(rows.n, 1e-12);
    Acceleration acceleration{Memory::standard()};
    for (; passes < 30; ++passes) {
      set_trial(rows, c.set.step, s);
      law.ask(rows, c.set.step, s);
      acceleration.start(rows);
      for (uint32_t k = 0; k < 200; ++k) {
        sweep(rows, s, c.set.step);
        acceleration.follow(rows);
      }
      sweep(rows, s, c.set.step);
    }
  }
};

struct ByMatrix : Solved {
  AugmentedSolve solve{Memory::standard()};
  std::vector<double> v;
  AugmentedWork work;
  Residual left;
  explicit ByMatrix(const FieldCase &c) {
    c.build(false, rows);
    v.assign(c.start.begin(), c.start.begin() + 4 * ptrdiff_t(c.n));
  }
  // at_least: passes, where the residual alone would end them with directions of slip still a little off
  void run(const FieldCase &c, const TestLaw &law, double tolerance, uint32_t at_least = 1) {
    ContactState s;
    s.resize(rows.n, 0);
    const Tolerance t = same_tolerance(rows.n, tolerance);
    solve.start(rows, c, c.place(rows));
    solve.show(rows, v.data());
    work = {};
    for (passes = 0; passes < 60; ++passes) {
      set_trial(rows, c.set.step, s);
      law.ask(rows, c.set.step, s);
      left = weighted_residual(rows, solve.weights(), s, c.set.step, t);
      if (passes >= at_least && left.relative <= 1) break;
      const AugmentedWork one = solve.run(rows, s, c.set.step, t, tolerance, 400, c, v.data());
      work.newton += one.newton;
      work.iterations += one.iterations;
      work.linear = one.linear;
      work.converged = one.converged;
    }
  }
};

double furthest(const std::vector<double> &a, const std::vector<double> &b) {
  double most = 0;
  for (size_t k = 0; k < a.size(); ++k) most = std::max(most, std::fabs(a[k] - b[k]));
  return most;
}

double largest(const ContactRows &rows) {
  double most = 0;
  for (const double l : rows.impulse) most = std::max(most, std::fabs(l));
  return most;
}

void expect_same(const FieldCase &c, const TestLaw &law, double speed, double share) {
  const BySweeps dense(c, law);
  ByMatrix sparse(c);
  sparse.run(c, law, 1e-10, 6);
  EXPECT_TRUE(sparse.work.converged);
  EXPECT_LT(furthest(dense.speeds(), sparse.speeds()), speed);
  EXPECT_LT(furthest({dense.rows.impulse.begin(), dense.rows.impulse.end()},
                     {sparse.rows.impulse.begin(), sparse.rows.impulse.end()}),
            share * largest(dense.rows));
}

}  // namespace

TEST(Augmented, CoulombFromNoneToTen_MatchesSweepsOnTheDenseResponse) {
  const FieldCase c{FieldSetup{}};
  for (const double mu : {0.0, 0.3, 1.0, 10.0}) expect_same(c, {.mu = mu, .stretch = {}}, 1e-8, 1e-7);
}

TEST(Augmented, Bristles_MatchSweepsOnTheDenseResponse) {
  const FieldCase c{FieldSetup{}};
  std::vector<double> stretch;
  for (size_t k = 0; k < 2 * c.contacts().size(); ++k) stretch.push_back(1e-5 * std::sin(double(k)));
  for (const double stiffness : {1e2, 1e4, 1e6})
    expect_same(c, {.mu = 0.5, .stiffness = stiffness, .stretch = stretch}, 1e-7, 1e-6);
}

TEST(Augmented, StiffAndSoftSteps_MatchSweepsOnTheDenseResponse) {
  FieldSetup s;
  s.step = 1.0 / 60;
  for (const double spring : {1e2, 1e4}) {
    s.spring = spring;
    expect_same(FieldCase{s}, {.mu = 0.5, .stretch = {}}, 1e-7, 1e-6);
  }
}

TEST(Augmented, StiffnessAndMassRatiosOfAMillion_MatchSweepsOnTheDenseResponse) {
  for (const double ratio : {1e6, 1e-6}) {
    FieldSetup s;
    s.stiffer = ratio;
    expect_same(FieldCase{s}, {.mu = 0.5, .stretch = {}}, 1e-7, 1e-6);
    s.stiffer = 1;
    s.heavier = ratio;
    expect_same(FieldCase{s}, {.mu = 0.5, .stretch = {}}, 1e-7, 1e-6);
  }
}

TEST(Augmented, HeldPointsExplicitPointsRigidFloor_MatchSweepsOnTheDenseResponse) {
  FieldSetup held;
  held.held = true;
  expect_same(FieldCase{held}, {.mu = 0.5, .stretch = {}}, 1e-8, 1e-7);
  FieldSetup top;
  top.explicit_top = true;
  expect_same(FieldCase{top}, {.mu = 0.5, .stretch = {}}, 1e-8, 1e-7);
  FieldSetup rigid;
  rigid.rigid_floor = true;
  expect_same(FieldCase{rigid}, {.mu = 0.5, .stretch = {}}, 1e-8, 1e-7);
}

TEST(Augmented, ImpactOfAHundredMetersPerSecond_MatchesSweepsOnTheDenseResponse) {
  FieldSetup s;
  s.fall = 100;
  s.push = 30;
  expect_same(FieldCase{s}, {.mu = 0.5, .stretch = {}}, 1e-7, 1e-8);
}

// Contacts that stand twice share the impulse in any way; velocities are the same.
TEST(Augmented, RedundantContacts_HaveTheVelocitiesOfOne) {
  FieldSetup s;
  ByMatrix once{FieldCase{s}};
  once.run(FieldCase{s}, {.mu = 0.5, .stretch = {}}, 1e-10, 6);
  s.doubled = 10;
  const FieldCase c(s);
  ByMatrix twice(c);
  twice.run(c, {.mu = 0.5, .stretch = {}}, 1e-10, 6);
  EXPECT_LT(furthest(once.v, twice.v), 1e-7);
}

// Signorini and Coulomb with numbers of the result alone.
TEST(Augmented, Result_MeetsTheConditionsOfContact) {
  constexpr double kMu = 0.5;
  const FieldCase c{FieldSetup{}};
  ByMatrix b(c);
  b.run(c, {.mu = kMu, .stretch = {}}, 1e-10, 6);
  uint32_t stick = 0, slide = 0, open = 0;
  for (uint32_t i = 0; i < b.rows.n; ++i) {
    const Vec3 u = b.rows.velocity(i), l = load3(&b.rows.impulse[3 * size_t{i}]);
    const double friction = std::hypot(l.y, l.z), slip = std::hypot(u.y, u.z);
    EXPECT_GE(l.x, 0);
    EXPECT_GE(u.x + b.rows.rate[i], -1e-9);
    EXPECT_LE(l.x * (u.x + b.rows.rate[i]), 1e-9);
    EXPECT_LE(friction, kMu * l.x + 1e-8);
    if (slip > 1e-7 && l.x > 0) {
      EXPECT_NEAR(l.y, -kMu * l.x * u.y / slip, 1e-8);
      EXPECT_NEAR(l.z, -kMu * l.x * u.z / slip, 1e-8);
    }
    ++(l.x == 0 ? open : slip > 1e-7 ? slide : stick);
  }
  EXPECT_GT(stick, 0u);
  EXPECT_GT(slide, 0u);
  EXPECT_GT(open, 0u);
}

// What the linear solves leave is below the tolerance, and none of it is momentum of a free body.
TEST(Augmented, Remainder_IsSmallAndKeepsMomentum) {
  constexpr double kTolerance = 1e-6;
  for (const double step : {1e-3, 1.0 / 60}) {
    FieldSetup s;
    s.step = step;
    const FieldCase c(s);
    ByMatrix b(c);
    b.run(c, {.mu = 0.5, .stretch = {}}, kTolerance);
    const std::vector<double> left = c.remainder(b.rows, b.v);
    for (uint32_t i = 0; i < c.n; ++i)
      for (size_t k = 0; k < 3; ++k)
        EXPECT_LT(std::fabs(left[4 * i + k]), 4 * kTolerance * c.blocks[9 * size_t{i} + 4 * k]);
    double total = 0;
    for (const double l : b.rows.impulse) total += std::fabs(l);
    const uint32_t each = c.n / s.blocks;
    for (uint32_t body = 0; body < s.blocks; ++body) {
      Vec3 sum;
      for (uint32_t i = body * each; i < (body + 1) * each; ++i) sum += load3(&left[4 * size_t{i}]);
      EXPECT_LT(norm(sum), 1e-13 * total) << body;
    }
  }
}

// Of what run() has left: below its tolerance; before it: at least what the blocks of A alone make of it.
TEST(Augmented, Error_IsThatOfTheEquationOfMotion) {
  const FieldCase c{FieldSetup{}};
  ByMatrix b(c);
  b.solve.start(b.rows, c, c.place(b.rows));
  const std::vector<double> left = c.remainder(b.rows, b.v);
  double most = 0;
  for (uint32_t i = 0; i < c.n; ++i) {
    double inverse[9];
    inverse3(c.blocks + 9 * size_t{i}, inverse);
    most = std::max(most, norm(times3(inverse, load3(&left[4 * size_t{i}]))));
  }
  EXPECT_GT(most, 1e-3);
  EXPECT_GE(b.solve.error(b.rows, c, b.v.data()), most * (1 - 1e-12));
  b.run(c, {.mu = 0.5, .stretch = {}}, 1e-6);
  EXPECT_LT(b.solve.error(b.rows, c, b.v.data()), 1e-6);
}

TEST(Augmented, WarmStart_TakesAFractionOfTheWork) {
  FieldCase c{FieldSetup{}};
  const TestLaw law{.mu = 0.5, .stretch = {}};
  ByMatrix b(c);
  b.run(c, law, 1e-6);
  const uint32_t cold = b.work.iterations;
  // the same again: at most what decides that it is solved
  b.run(c, law, 1e-6);
  EXPECT_LE(b.work.iterations, cold / 8);
  std::vector<double> next = c.free;
  for (uint32_t i = 0; i < c.total(); ++i) next[4 * size_t{i} + 2] -= 1e-4;
  c.set_free(next);
  b.run(c, law, 1e-6);
  EXPECT_GT(b.work.iterations, 0u);
  EXPECT_LE(b.work.iterations, cold / 2);
}

// At the cap there is a state to go on with, and it says what it is.
TEST(Augmented, FewSystems_LeaveAFiniteStateThatIsNotConverged) {
  const FieldCase c{FieldSetup{}};
  ByMatrix b(c);
  ContactState s;
  s.resize(b.rows.n, 0);
  b.solve.start(b.rows, c, c.place(b.rows));
  b.solve.show(b.rows, b.v.data());
  set_trial(b.rows, c.set.step, s);
  TestLaw{.mu = 0.5, .stretch = {}}.ask(b.rows, c.set.step, s);
  const AugmentedWork work =
      b.solve.run(b.rows, s, c.set.step, same_tolerance(b.rows.n, 1e-9), 1e-9, 2, c, b.v.data());
  EXPECT_EQ(work.newton, 2u);
  EXPECT_FALSE(work.converged);
  for (const double v : b.v) EXPECT_TRUE(std::isfinite(v));
  for (uint32_t i = 0; i < b.rows.n; ++i) EXPECT_GE(b.rows.impulse[3 * size_t{i}], 0);
}

TEST(Augmented, Settled_AllocatesNothing) {
  static uint64_t calls;
  Memory counted = Memory::standard();
  counted.alloc = [](void *user, size_t bytes, size_t align) {
    ++calls;
    return Memory::standard().alloc(user, bytes, align);
  };
  const FieldCase c{FieldSetup{}};
  AugmentedSolve solve{counted};
  const auto once = [&] {
    ByMatrix b(c);
    ContactState s;
    s.resize(b.rows.n, 0);
    const Tolerance t = same_tolerance(b.rows.n, 1e-6);
    const std::vector<uint32_t> place = c.place(b.rows);
    const uint64_t before = calls;
    solve.start(b.rows, c, place);
    solve.show(b.rows, b.v.data());
    set_trial(b.rows, c.set.step, s);
    TestLaw{.mu = 0.5, .stretch = {}}.ask(b.rows, c.set.step, s);
    solve.run(b.rows, s, c.set.step, t, 1e-6, 100, c, b.v.data());
    return calls - before;
  };
  EXPECT_GT(once(), 0u);
  EXPECT_EQ(once(), 0u);
}

// The slope of the friction impulse against central differences, where the law is smooth.
TEST(LinearLaw, Slope_MatchesDifferences) {
  std::mt19937 random{3};
  std::uniform_real_distribution<double> any(-1, 1);
  constexpr double kStep = 1e-3, kMove = 1e-6;
  uint32_t cut = 0;
  for (uint32_t k = 0; k < 200; ++k) {
    ContactState s;
    s.resize(1, 0);
    const uint32_t n = s.stride;
    s.set_valued[0] = k % 2;
    s.mode[0] = 1 + k / 2 % 2;
    s.fn[0] = 2;
    s.limit[0] = 1;
    s.vt[0] = any(random);
    s.vt[n] = any(random);
    s.ft[0] = any(random);
    s.ft[n] = any(random);
    const double a = -1 - any(random), b = 0.3 * any(random), c = -1 - any(random);
    s.dft_dvt[0] = a;
    s.dft_dvt[n] = s.dft_dvt[2 * n] = b;
    s.dft_dvt[3 * n] = c;
    s.dft_dfn[0] = s.dft_dfn[n] = 0.2;
    const double wt = 500 * (1.1 + any(random)), ln = kStep * (1.5 + any(random));
    const Tangential l{1e-3 * any(random), 1e-3 * any(random)}, u{any(random), any(random)};
    FrictionSlope slope;
    const Tangential now = friction_impulse(s, 0, kStep, wt, l, u, ln, &slope);
    double found[2][2];
    for (int to = 0; to < 2; ++to) {
      Tangential more = u, less = u;
      (to ? more.b : more.a) += kMove;
      (to ? less.b : less.a) -= kMove;
      const Tangential p = friction_impulse(s, 0, kStep, wt, l, more, ln);
      const Tangential q = friction_impulse(s, 0, kStep, wt, l, less, ln);
      found[0][to] = -(p.a - q.a) / (2 * kMove);
      found[1][to] = -(p.b - q.b) / (2 * kMove);
    }
    const double size = std::hypot(now.a, now.b);
    const bool smooth_cut = !s.set_valued[0] && size > 0.999999 * kStep * (ln / kStep / 2);
    if (smooth_cut) {
      // the part across the impulse alone, of which the slope is the symmetric part
      ++cut;
      const double e[2] = {-now.b / size, now.a / size};
      const double across = slope.a * e[0] * e[0] + 2 * slope.b * e[0] * e[1] + slope.c * e[1] * e[1];
      double real = 0;
      for (int r = 0; r < 2; ++r)
        for (int t = 0; t < 2; ++t) real += e[r] * found[r][t] * e[t];
      EXPECT_NEAR(across, real, 1e-6 * std::fabs(real) + 1e-12) << k;
      continue;
    }
    const double scale = std::fabs(slope.a) + std::fabs(slope.c);
    EXPECT_NEAR(slope.a, found[0][0], 1e-5 * scale) << k;
    EXPECT_NEAR(slope.b, found[0][1], 1e-5 * scale) << k;
    EXPECT_NEAR(slope.b, found[1][0], 1e-5 * scale) << k;
    EXPECT_NEAR(slope.c, found[1][1], 1e-5 * scale) << k;
    EXPECT_GE(slope.a * slope.c, slope.b * slope.b - 1e-12 * scale * scale) << k;
  }
  EXPECT_GT(cut, 5u);
}

// R^T r is what give() takes away: total momentum and angular momentum of each free body.
TEST(RigidModes, Give_TakesMomentumAndMoment) {
  const FieldCase c{FieldSetup{}};
  RigidModes modes{Memory::standard()};
  modes.start(ContactRows{Memory::standard()}, c, {});
  std::vector<double> r(4 * size_t{c.n}), v(4 * size_t{c.n});
  for (size_t k = 0; k < r.size(); ++k) r[k] = k % 4 < 3 ? std::sin(double(k)) : 0;
  modes.give(c, r.data(), v.data());
  for (const MatrixPoints::Loose &l : c.loose) {
    Vec3 sum, moment;
    for (uint32_t i = l.first; i < l.first + l.n; ++i) {
      const Vec3 p = load3(&r[4 * size_t{i}]) - c.mass[i] * load3(&v[4 * size_t{i}]);
      sum += p;
      moment += cross(load3(c.x + 4 * size_t{i}), p);
    }
    EXPECT_LT(norm(sum), 1e-12);
    EXPECT_LT(norm(moment), 1e-9);
  }
}

// With the modes of the contacts the preconditioner is exact on rigid motions: P (M + J^T C J) R = R on them.
TEST(RigidModes, Preconditioner_InvertsTheRigidPart) {
  const FieldCase c{FieldSetup{}};
  ContactRows rows{Memory::standard()};
  c.build(false, rows);
  RigidModes modes{Memory::standard()};
  const std::vector<uint32_t> place = c.place(rows);
  modes.start(rows, c, place);
  std::vector<double> slope(4 * size_t{rows.n}, 0.0);
  for (size_t i = 0; i < rows.n; ++i) {
    slope[4 * i] = 0.01 * double(1 + i % 3);
    slope[4 * i + 1] = slope[4 * i + 3] = 0.02;
    slope[4 * i + 2] = 0.005;
  }
  modes.factor(rows, slope.data());
  std::vector<double> v(4 * size_t{c.n}), r(4 * size_t{c.n}), z(4 * size_t{c.n}), seen(4 * size_t{rows.ndof}),
      given(4 * size_t{rows.ndof});
  for (size_t b = 0; b < c.loose.size(); ++b)
    for (uint32_t i = c.loose[b].first; i < c.loose[b].first + c.loose[b].n; ++i)
      store3(&v[4 * size_t{i}],
             Vec3{1, 2 - double(b), 3} + cross({5, -7, 2.0 * double(b)}, load3(c.x + 4 * size_t{i})));
  for (size_t i = 0; i < c.n; ++i)
    for (size_t k = 0; k < 3; ++k) r[4 * i + k] = c.mass[i] * v[4 * i + k];
  for (size_t d = 0; d < rows.ndof; ++d) store3(&seen[4 * d], load3(&v[4 * size_t{place[d]}]));
  for (uint32_t i = 0; i < rows.n; ++i) {
    const Vec3 u = rows.relative(i, seen.data());
    const double *const s = &slope[4 * size_t{i}];
    rows.spread(i, {s[0] * u.x, s[1] * u.y + s[2] * u.z, s[2] * u.y + s[3] * u.z}, given.data());
  }
  for (size_t d = 0; d < rows.ndof; ++d)
    for (size_t k = 0; k < 3; ++k) r[4 * place[d] + k] += given[4 * d + k];
  modes.precondition(c, r.data(), z.data());
  EXPECT_LT(furthest(v, z), 1e-8);
}
