// The polynomials and the three root finders under the time of impact.
#include <gtest/gtest.h>

#include "ccd/toi_finders.h"
#include "ccd/toi_poly.h"
#include "toi_support.h"

namespace {

using namespace dfm::toi;

Poly cubic(double b0, double b1, double b2, double b3) { return {3, {b0, b1, b2, b3}}; }

}  // namespace

TEST(ToiPoly, ProductsAndDerivatives_AreThoseOfTheValues) {
  const Poly p = dfm::toi::linear(2, -3), q = {2, {1, 5, -2}}, r = p * q;
  const Poly c = cubic(1, -4, 2, 7);
  for (const double t : {0.0, 0.2, 0.5, 0.9, 1.0}) {
    EXPECT_NEAR(p(t), 2 - 5 * t, 1e-15);
    EXPECT_NEAR(r(t), p(t) * q(t), 1e-14);
    EXPECT_NEAR(raised(q)(t), q(t), 1e-14);
    const double h = 1e-6;
    EXPECT_NEAR(c.derivative()(t), (c(t + h) - c(t - h)) / (2 * h), 1e-8);
    EXPECT_NEAR(r.derivative()(t), (r(t + h) - r(t - h)) / (2 * h), 1e-8);
  }
}

TEST(ToiPoly, Bounds_HoldAllValues) {
  test::Random random(1);
  for (int n = 0; n < 200; ++n) {
    Poly p;
    p.degree = random.whole(1, kMaxDegree);
    for (int i = 0; i <= p.degree; ++i) p.b[i] = random.real(-1, 1);
    double least, largest;
    p.bounds(least, largest);
    for (int k = 0; k <= 32; ++k) {
      EXPECT_LE(p(k / 32.0), largest + 1e-14);
      EXPECT_GE(p(k / 32.0), least - 1e-14);
    }
    EXPECT_TRUE(p.degree > 1 || largest == std::max(p.b[0], p.b[1]));
  }
}

TEST(ToiPoly, QuadraticRoots_KeepTheirDigits) {
  double root[2];
  // Roots at x = t / (1-t) of 5e-19 and about -2; and at 2e18 and -5e-19 the other way round.
  ASSERT_EQ(quadratic_roots({2, {-1e-18, 2, 1}}, root), 1);
  EXPECT_NEAR(root[0], 5e-19, 1e-33);
  ASSERT_EQ(quadratic_roots({2, {1e-18, -2, -1}}, root), 1);
  EXPECT_NEAR(root[0], 5e-19, 1e-33);
  ASSERT_EQ(quadratic_roots({2, {3, -7, 3}}, root), 2);  // symmetric about 1/2
  EXPECT_LT(root[0], root[1]);
  EXPECT_NEAR(root[0] + root[1], 1, 1e-15);
  EXPECT_NEAR(Poly({2, {3, -7, 3}})(root[0]), 0, 1e-15);
  EXPECT_EQ(quadratic_roots({2, {3, -6, 3}}, root), 1);  // double
  EXPECT_EQ(root[0], 0.5);
  EXPECT_EQ(quadratic_roots({2, {3, -5, 3}}, root), 0);
  EXPECT_EQ(quadratic_roots({2, {0, 0, 0}}, root), 0);
  ASSERT_EQ(quadratic_roots({2, {-1, 0, 1}}, root), 1);  // linear: 2 t - 1
  EXPECT_EQ(root[0], 0.5);
}

class ToiFinder : public testing::TestWithParam<int> {};

// Functions on which secants fare badly: a flat root, a steep one, a jump, a bend.
TEST_P(ToiFinder, EndsWithinTheWidth) {
  const double at = 0.3141592653589793;
  const auto odd = [&](double t) { return (t - at) * (t - at) * (t - at); };
  const auto steep = [&](double t) { return (t - at) / (1e-6 + std::fabs(t - at)); };
  const auto jump = [&](double t) { return t < at ? -1.0 : 3.0; };
  const auto bend = [&](double t) { return t < at ? 1e-9 * (t - at) : t - at; };
  const auto check = [&](const auto &f, const char *what) {
    for (const double sign : {1.0, -1.0}) {
      const auto g = [&](double t) { return sign * f(t); };
      uint32_t evaluations = 0;
      const double root = find_root(GetParam(), g, {0, 1, g(0), g(1)}, 1e-12, 200, evaluations);
      EXPECT_NEAR(root, at, 1e-12) << what;
      EXPECT_LE(evaluations, 160u) << what;
    }
  };
  check(odd, "flat");
  check(steep, "steep");
  check(jump, "jump");
  if (GetParam() != DFM_TOI_REGULA_FALSI) check(bend, "bend");  // no polynomial has one
}

TEST_P(ToiFinder, Cap_EndsInsideTheBracket) {
  const auto f = [](double t) { return t * t * t - 0.02; };
  for (const int cap : {0, 1, 2, 5}) {
    uint32_t evaluations = 0;
    const double root = find_root(GetParam(), f, {0, 1, f(0), f(1)}, 1e-15, cap, evaluations);
    EXPECT_LE(evaluations, uint32_t(cap));
    EXPECT_GE(root, 0);
    EXPECT_LE(root, 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Finders, ToiFinder, testing::Values(0, 1, 2),
                         [](const auto &i) { return std::string(test::kFinderNames[i.param]); });
