// The deterministic elementary functions against the C library's 80-bit ones.
#include "math/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/hash.h"
#include "near.h"

namespace {

const double kInf = std::numeric_limits<double>::infinity();

double ulp(long double exact) {
  const double x = std::fabs(static_cast<double>(exact));
  return std::max(std::nextafter(x, kInf) - x, 0x1p-1074);
}

template <class F, class G, class Draw>
double worst(F &&ours, G &&exact, Draw &&draw, int n) {
  double most = 0;
  for (int i = 0; i < n; ++i) {
    const auto x = draw();
    const long double e = exact(x);
    if (!std::isfinite(static_cast<double>(e))) continue;
    most = test::worse(most, static_cast<double>(std::fabs(ours(x) - e) / ulp(e)));
  }
  return most;
}

TEST(Elementary, Exp_IsBelowOneUlp) {
  std::mt19937_64 random(1);
  for (double reach : {1e-12, 1e-3, 0.5, 3.0, 40.0, 708.0}) {
    std::uniform_real_distribution<double> x(-reach, reach);
    EXPECT_LT(worst(
                  dfm_exp, [](double a) { return std::exp(static_cast<long double>(a)); },
                  [&] { return x(random); }, 200000),
              1.0)
        << reach;
  }
  std::uniform_real_distribution<double> tiny(-746.0, -707.0);
  EXPECT_LT(worst(
                dfm_exp, [](double a) { return std::exp(static_cast<long double>(a)); },
                [&] { return tiny(random); }, 200000),
            1.6);
}

TEST(Elementary, ExpAtTheEnds_IsZeroOneInfinityOrNan) {
  EXPECT_EQ(dfm_exp(0.0), 1.0);
  EXPECT_EQ(dfm_exp(-0.0), 1.0);
  EXPECT_EQ(dfm_exp(709.0), std::exp(709.0));
  EXPECT_EQ(dfm_exp(710.0), kInf);
  EXPECT_EQ(dfm_exp(kInf), kInf);
  EXPECT_EQ(dfm_exp(-746.0), 0.0);
  EXPECT_EQ(dfm_exp(-1e300), 0.0);
  EXPECT_EQ(dfm_exp(-kInf), 0.0);
  EXPECT_TRUE(std::isnan(dfm_exp(std::nan(""))));
  EXPECT_GT(dfm_exp(-745.0), 0.0);
}

TEST(Elementary, Log_IsBelowOneUlp) {
  std::mt19937_64 random(2);
  for (double reach : {1e-9, 1e-3, 0.3, 3.0, 100.0, 708.0}) {
    std::uniform_real_distribution<double> e(-reach, reach);
    EXPECT_LT(worst(
                  dfm_log, [](double a) { return std::log(static_cast<long double>(a)); },
                  [&] { return std::exp(e(random)); }, 200000),
              1.0)
        << reach;
  }
  std::uniform_real_distribution<double> subnormal(0, 0x1p-1022);
  EXPECT_LT(worst(
                dfm_log, [](double a) { return std::log(static_cast<long double>(a)); },
                [&] { return subnormal(random) + 0x1p-1074; }, 1000),
            1.0);
}

TEST(Elementary, LogAtTheEnds_FollowsTheCLibrary) {
  EXPECT_EQ(dfm_log(1.0), 0.0);
  EXPECT_EQ(dfm_log(0.0), -kInf);
  EXPECT_EQ(dfm_log(kInf), kInf);
  EXPECT_TRUE(std::isnan(dfm_log(-1.0)));
  EXPECT_TRUE(std::isnan(dfm_log(-kInf)));
  EXPECT_TRUE(std::isnan(dfm_log(std::nan(""))));
}

struct Pair { double x, y; };

TEST(Elementary, Pow_IsBelowTwoUlpForModerateExponents) {
  std::mt19937_64 random(3);
  const auto ours = [](Pair p) { return dfm_pow(p.x, p.y); };
  const auto exact = [](Pair p) {
    return std::pow(static_cast<long double>(p.x), static_cast<long double>(p.y));
  };
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto draw = [&](double reach) {
    return [&, reach] {
      const double l = unit(random) * 20, p = unit(random) * reach;
      return Pair{std::exp(l), p / l};
    };
  };
  EXPECT_LT(worst(ours, exact, draw(5), 200000), 1.0);
  EXPECT_LT(worst(ours, exact, draw(40), 200000), 2.0);
  EXPECT_LT(worst(ours, exact, draw(700), 200000), 40.0);
}

TEST(Elementary, PowOfWholeExponents_IsExactWhereTheProductIs) {
  for (double x : {0.5, 1.5, 3.0, 1024.0, 0.1}) {
    EXPECT_EQ(dfm_pow(x, 1.0), x);
    EXPECT_EQ(dfm_pow(x, 0.0), 1.0);
  }
  EXPECT_EQ(dfm_pow(3.0, 4.0), 81.0);
  EXPECT_EQ(dfm_pow(0.0, 2.0), 0.0);
  EXPECT_EQ(dfm_pow(0.0, -1.0), kInf);
  EXPECT_EQ(dfm_pow(kInf, 0.5), kInf);
  EXPECT_EQ(dfm_pow(kInf, -0.5), 0.0);
  EXPECT_EQ(dfm_pow(2.0, 5000.0), kInf);
  EXPECT_EQ(dfm_pow(2.0, -5000.0), 0.0);
  EXPECT_EQ(dfm_pow(1e12, 1e308), kInf);
  EXPECT_TRUE(std::isnan(dfm_pow(-2.0, 2.0)));
  EXPECT_TRUE(std::isnan(dfm_pow(std::nan(""), 2.0)));
  EXPECT_TRUE(std::isnan(dfm_pow(2.0, std::nan(""))));
}

// Every compiler, optimization level and vector width must give these bits.
TEST(Elementary, Bits_MatchTheRecordedHash) {
  dfm::Hash hash;
  uint64_t state = 88172645463325252ull;
  for (int i = 0; i < 100000; ++i) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    const double u = static_cast<double>(state >> 11) * 0x1p-53;
    hash.add(dfm_exp(1400 * u - 700));
    hash.add(dfm_log(u * 1e10 + 1e-300));
    hash.add(dfm_pow(u * 100, 4 * u - 2));
  }
  EXPECT_EQ(hash.value, 849428759766298756ull);
}

TEST(Elementary, SineAndCosineOfPi_AreBelowTwoUlp) {
  std::mt19937_64 random(5);
  const long double pi = 3.14159265358979323846264338327950288L;
  for (double reach : {1e-12, 0.1, 0.5, 1.0, 30.0}) {
    std::uniform_real_distribution<double> x(-reach, reach);
    // the distance to the nearest even integer is exact, and so is the reduction to a quarter turn
    const auto near = [](double a) {
      return static_cast<long double>(a) - 2 * std::round(static_cast<long double>(a) / 2);
    };
    const auto sine = [&](long double t) {
      return t > 0.5L ? std::sin(pi * (1 - t)) : t < -0.5L ? -std::sin(pi * (1 + t)) : std::sin(pi * t);
    };
    EXPECT_LT(worst(
                  dfm_sinpi, [&](double a) { return sine(near(a)); }, [&] { return x(random); }, 200000),
              1.7)
        << reach;
    EXPECT_LT(worst(
                  dfm_cospi, [&](double a) { return sine(0.5L - std::fabs(near(a))); },
                  [&] { return x(random); }, 200000),
              1.7)
        << reach;
  }
}

TEST(Elementary, SineAndCosineOfPiAtTheEnds_AreExact) {
  for (double n : {0.0, 1.0, 2.0, -3.0, 1e15, 4503599627370497.0, 9007199254740994.0, 1e300}) {
    EXPECT_EQ(dfm_sinpi(n), 0.0) << n;
    EXPECT_EQ(std::fabs(dfm_cospi(n)), 1.0) << n;
  }
  EXPECT_EQ(dfm_cospi(4503599627370497.0), -1.0);
  EXPECT_EQ(dfm_cospi(-1.0), -1.0);
  EXPECT_EQ(dfm_sinpi(0.5), 1.0);
  EXPECT_EQ(dfm_sinpi(-1.5), 1.0);
  EXPECT_EQ(dfm_cospi(0.5), 0.0);
  EXPECT_TRUE(std::isnan(dfm_sinpi(kInf)) && std::isnan(dfm_cospi(-kInf)) &&
              std::isnan(dfm_sinpi(std::nan(""))));
}

}  // namespace
