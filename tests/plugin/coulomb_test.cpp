// The laws none and coulomb against their closed forms (doc/laws/coulomb.md).
#include <cstring>
#include <random>

#include "law_rules.h"

using tiny::LawOutput;
using tiny::Batch;
using tiny::Context;
using tiny::one_contact;
using tiny::Rig;

namespace {

const double kPi = 3.14159265358979323846;

struct Coulomb : testing::Test {
  Context c;
  dfm_law law = 0, none = 0;
  const dfm_friction *ops = nullptr;
  void SetUp() override {
    law = c.open(std::string(DEFORM_PLUGIN_DIR) + "/friction_coulomb.so");
    none = c.open(std::string(DEFORM_PLUGIN_DIR) + "/friction_none.so");
    const dfm_type *type = nullptr;
    dfm_law_type(law, &type);
    ops = static_cast<const dfm_friction *>(type->ops);
  }
};

struct Parameters {
  double mu_c = 0.5, mu_s = 0.5, v_s = 0.01, delta = 2, sigma2 = 0;
  std::vector<double> values() const { return {mu_c, mu_s, v_s, delta, sigma2}; }
  double level(double fn, double w) const {
    return fn * (mu_c + (mu_s - mu_c) * std::exp(-std::pow(w / v_s, delta)));
  }
};

LawOutput evaluate(const dfm_friction &ops, const Parameters &p, double fn, double vx, double vy, double sx,
                   double sy, double area = 1) {
  return one_contact(ops, p.values(), fn, vx, vy, sx, sy, area);
}

// A slip whose stopping force lies well outside the cone.
LawOutput slide(const dfm_friction &ops, const Parameters &p, double fn, double vx, double vy,
                double area = 1) {
  const double w = std::hypot(vx, vy), s = 10 * (p.mu_s * fn + 1);
  return evaluate(ops, p, fn, vx, vy, -s * vx / w, -s * vy / w, area);
}

TEST_F(Coulomb, SelfDescription_NamesItsKind) {
  const dfm_type *type = nullptr;
  ASSERT_EQ(dfm_law_type(law, &type), DFM_OK);
  EXPECT_STREQ(type->id, "org.deform.coulomb");
  EXPECT_EQ(ops->flags,
            uint32_t(DFM_FRIC_SET_VALUED | DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN));
  EXPECT_EQ(ops->needs, uint32_t(DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_FT_STOP | DFM_NEED_AREA));
  std::vector<std::string> effects;
  for (const char *const *e = type->effects; *e; ++e) effects.push_back(*e);
  EXPECT_EQ(effects, (std::vector<std::string>{"stiction", "stribeck", "viscous"}));
  const char *keys[] = {"mu_C", "mu_S", "v_s", "delta", "sigma2"};
  ASSERT_EQ(type->nparam, 5u);
  for (int i = 0; i < 5; ++i) EXPECT_STREQ(type->params[i].key, keys[i]);
  EXPECT_STREQ(type->params[4].unit, "N s/m^3");
}

TEST_F(Coulomb, InsideTheStaticCone_ReturnsTheStoppingForceItself) {
  const Parameters p{0.4, 0.6};
  for (double share : {0.0, 0.1, 0.999999, 1.0}) {
    const double fn = 2, s = share * p.mu_s * fn;
    for (double vx : {0.0, 1e-9, 3.0}) {  // whatever the trial slip: what stops it is all there is to know
      const LawOutput a = evaluate(*ops, p, fn, vx, 0, s, 0);
      EXPECT_EQ(a.fx, s);
      EXPECT_EQ(a.fy, 0);
      EXPECT_EQ(a.mode, 1);
      EXPECT_EQ(a.limit, p.mu_s * fn);
      for (double d : a.dv) EXPECT_EQ(d, 0);
      EXPECT_EQ(a.dn[0], 0);
    }
  }
  EXPECT_EQ(evaluate(*ops, p, 2, 1, 0, -1.2000000001, 0).mode, 2);
}

TEST_F(Coulomb, OutsideTheStaticCone_SlipsAgainstTheVelocity) {
  const Parameters p{0.4, 0.6, 0.01, 2, 3};
  const LawOutput a = slide(*ops, p, 2, 0.03, -0.04, 0.25);
  const double level = p.level(2, 0.05) + 3 * 0.25 * 0.05;
  EXPECT_EQ(a.mode, 2);
  EXPECT_NEAR(a.fx, -0.6 * level, 1e-15);
  EXPECT_NEAR(a.fy, 0.8 * level, 1e-15);
  EXPECT_NEAR(a.limit, level, 1e-15);
}

TEST_F(Coulomb, SlipFromRest_GoesTheWayTheStoppingForcePoints) {
  const Parameters p{0.4, 0.6};
  const LawOutput a = evaluate(*ops, p, 2, 0, 0, 30, 40);
  EXPECT_EQ(a.mode, 2);
  EXPECT_NEAR(a.fx, 0.6 * 1.2, 1e-15);
  EXPECT_NEAR(a.fy, 0.8 * 1.2, 1e-15);
  for (double d : a.dv) EXPECT_EQ(d, 0);
}

TEST_F(Coulomb, RulesOfEveryLaw_AreKept) {
  for (double delta : {2.0, 0.7}) {
    const rules::Law l = rules::law_of(c.open(std::string(DEFORM_PLUGIN_DIR) + "/friction_coulomb.so"),
                                       {0.6, 0.9, 0.01, delta, 0.4});
    const rules::Draw draw;
    EXPECT_TRUE(l.set_valued);
    rules::odd_to_the_bit(l, draw);
    rules::turns_with_the_frame(l, draw);
    rules::mirrored_trajectories(l, draw);
    rules::extremes(l, 0);
    rules::no_normal_force_is_open(l, 0);
    rules::bad_lane_stays_in_its_lane(l, draw);
    rules::same_alone_and_in_any_batch(l, draw);
    rules::derivatives(l, draw, 1000, 1e-6, [](const rules::In &) { return false; });
    EXPECT_GE(rules::worst_balance(l, 0, 300, false), 0);
  }
}

TEST_F(Coulomb, OppositeSlip_GivesTheOppositeForceToTheBit) {
  const Parameters p{0.3, 0.5, 0.01, 1.5, 0.4};
  std::mt19937 random(1);
  std::normal_distribution<double> g;
  for (int i = 0; i < 1000; ++i) {
    const double vx = 0.02 * g(random), vy = 0.02 * g(random), sx = g(random), sy = g(random);
    const LawOutput a = evaluate(*ops, p, 1, vx, vy, sx, sy), b = evaluate(*ops, p, 1, -vx, -vy, -sx, -sy);
    EXPECT_EQ(a.fx, -b.fx);
    EXPECT_EQ(a.fy, -b.fy);
    EXPECT_EQ(a.limit, b.limit);
    const LawOutput swapped = evaluate(*ops, p, 1, vy, vx, sy, sx);
    EXPECT_EQ(a.fx, swapped.fy) << "mirrored at the diagonal";
  }
}

TEST_F(Coulomb, SlipInEachOf360Directions_HasOneForceNorm) {
  for (const Parameters &p : {Parameters{}, Parameters{0.3, 0.5, 0.01, 2, 0.4}}) {
    const double w = 0.013, expected = p.level(7, w) + p.sigma2 * w;
    for (int degree = 0; degree < 360; ++degree) {
      const double t = degree * kPi / 180, cs = std::cos(t), sn = std::sin(t);
      const LawOutput a = slide(*ops, p, 7, w * cs, w * sn);
      EXPECT_NEAR(std::hypot(a.fx, a.fy), expected, 1e-14 * expected) << degree;
      EXPECT_NEAR(a.fx * sn - a.fy * cs, 0, 1e-14 * expected) << degree;
      EXPECT_LT(a.fx * cs + a.fy * sn, 0) << degree;
    }
  }
}

TEST_F(Coulomb, SteadyCurve_IsTheClosedForm) {
  for (double delta : {0.5, 1.0, 2.0, 3.3}) {
    const Parameters p{0.15, 0.20, 0.01, delta, 0.4};
    for (double w = 1e-9; w < 1e3; w *= 1.7) {
      const LawOutput a = slide(*ops, p, 9.8, -w, 0);
      const double expected = p.level(9.8, w) + 0.4 * w;
      EXPECT_NEAR(a.fx, expected, 4e-15 * expected) << w << " " << delta;
    }
  }
}

TEST_F(Coulomb, EqualCoefficients_GiveOneLevelAtEverySpeed) {
  for (double w = 1e-200; w < 1e200; w *= 1e5) {
    const LawOutput a = slide(*ops, Parameters{}, 2, w, 0);
    EXPECT_EQ(a.limit, 1.0) << w;
    EXPECT_NEAR(a.fx, -1.0, 3e-16) << w;
  }
}

TEST_F(Coulomb, StribeckRangeOfCoefficients_FallsMonotonically) {
  const Parameters p{0.3, 0.5, 0.01, 2, 0};
  double before = 0.5;
  for (double w = 1e-4; w < 0.1; w *= 1.1) {
    const double now = slide(*ops, p, 1, w, 0).limit;
    EXPECT_LE(now, before);
    before = now;
  }
  EXPECT_NEAR(before, 0.3, 1e-12);
}

TEST_F(Coulomb, Derivatives_MatchDifferencesOverDecades) {
  for (const Parameters &p :
       {Parameters{}, Parameters{0.3, 0.5, 0.01, 2, 0.4}, Parameters{0.3, 0.5, 0.01, 0.7, 50}})
    for (double w = 1e-7; w < 1e3; w *= 3.1)
      for (double angle : {0.0, 0.4, 2.0, 4.5}) {
        const double v[2] = {w * std::cos(angle), w * std::sin(angle)}, fn = 3, step = 1e-5 * w;
        const LawOutput a = slide(*ops, p, fn, v[0], v[1]);
        const double scale = std::hypot(a.fx, a.fy) / w;
        for (int k = 0; k < 2; ++k) {
          const double dx = k == 0 ? step : 0, dy = k == 1 ? step : 0;
          const LawOutput up = slide(*ops, p, fn, v[0] + dx, v[1] + dy);
          const LawOutput down = slide(*ops, p, fn, v[0] - dx, v[1] - dy);
          EXPECT_NEAR(a.dv[k], (up.fx - down.fx) / (2 * step), 1e-8 * scale) << w << " " << angle;
          EXPECT_NEAR(a.dv[2 + k], (up.fy - down.fy) / (2 * step), 1e-8 * scale) << w << " " << angle;
        }
        const LawOutput up = slide(*ops, p, fn + 1, v[0], v[1]), down = slide(*ops, p, fn - 1, v[0], v[1]);
        EXPECT_NEAR(a.dn[0], (up.fx - down.fx) / 2, 1e-15 * (1 + a.limit))
            << "linear in fn: only rounding is left";
        EXPECT_NEAR(a.dn[1], (up.fy - down.fy) / 2, 1e-15 * (1 + a.limit));
      }
}

TEST_F(Coulomb, NoNormalForce_IsOpen) {
  for (double fn : {0.0, -0.0, -1.0, -1e300}) {
    const LawOutput a = evaluate(*ops, Parameters{0.3, 0.5, 0.01, 2, 5}, fn, 1, 2, 3, 4);
    EXPECT_EQ(a.fx, 0);
    EXPECT_EQ(a.fy, 0);
    EXPECT_EQ(a.limit, 0);
    EXPECT_EQ(a.mode, 0);
    for (double d : a.dv) EXPECT_EQ(d, 0);
    for (double d : a.dn) EXPECT_EQ(d, 0);
  }
}

TEST_F(Coulomb, ExtremesOfTheRange_StayFiniteAndInsideTheCone) {
  const double values[] = {0, 5e-324, 1e-310, 1e-200, 1e-160, 1e-30, 1, 1e6, 1e100, 1e160, 1e200};
  for (const Parameters &p : {Parameters{}, Parameters{0.3, 0.5, 0.01, 2, 0.4}, Parameters{0, 0},
                              Parameters{0.3, 0.5, 1e-9, 10, 0}})
    for (double fn : values)
      for (double v : values)
        for (double s : values) {
          const LawOutput a = evaluate(*ops, p, fn, v, -v, -s, 0.5 * s);
          EXPECT_TRUE(std::isfinite(a.fx) && std::isfinite(a.fy) && std::isfinite(a.limit))
              << fn << " " << v << " " << s;
          for (double d : a.dv) EXPECT_TRUE(std::isfinite(d)) << fn << " " << v << " " << s;
          for (double d : a.dn) EXPECT_TRUE(std::isfinite(d)) << fn << " " << v << " " << s;
          EXPECT_LE(std::hypot(a.fx, a.fy), a.limit * (1 + 1e-15) + 1e-323) << fn << " " << v << " " << s;
          EXPECT_TRUE(a.mode != 2 || (a.fx - a.fy) * v <= 0) << "friction must not push";
        }
}

// Every compiler, optimization level and vector width must give these bits; inputs use + - * / alone.
TEST_F(Coulomb, Bits_MatchTheRecordedHash) {
  uint64_t seed = 88172645463325252ull, hash = 14695981039346656037ull;
  const auto uniform = [&] {
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return static_cast<double>(seed >> 11) * 0x1p-52 - 1;
  };
  for (const double delta : {2.0, 1.0, 0.8}) {
    Batch b(1000, Parameters{0.3, 0.5, 0.01, delta, 0.4}.values());
    for (uint32_t i = 0; i < b.n; ++i) {
      b.fn[i] = 1 + uniform();
      b.area[i] = 1 + uniform();
      for (uint32_t k = 0; k < 2; ++k) {
        b.vt[k * b.stride + i] = 0.03 * uniform();
        b.stop[k * b.stride + i] = 0.7 * uniform();
      }
    }
    ASSERT_EQ(ops->eval(&b.in, &b.out), DFM_OK);
    const auto add = [&](const double *column, uint32_t width) {
      for (uint32_t k = 0; k < width; ++k)
        for (uint32_t i = 0; i < b.n; ++i) {
          unsigned char bytes[sizeof(double)];
          std::memcpy(bytes, &column[k * b.stride + i], sizeof bytes);
          for (unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211ull;
        }
    };
    add(b.ft, 2);
    add(b.limit, 1);
    add(b.dv, 4);
    add(b.dn, 2);
  }
  EXPECT_EQ(hash, 3992741526289013015ull);
}

TEST_F(Coulomb, OutputsThatAreNotWanted_AreLeftOut) {
  Batch b(9, Parameters{0.3, 0.5}.values());
  for (uint32_t i = 0; i < b.n; ++i) b.stop[i] = 1;
  dfm_friction_out out{};
  out.size = sizeof out;
  EXPECT_EQ(ops->eval(&b.in, &out), DFM_OK);
  out.limit = b.limit;
  EXPECT_EQ(ops->eval(&b.in, &out), DFM_OK);
  EXPECT_EQ(b.limit[8], 0.5);
}

TEST_F(Coulomb, ClosedLoops_Dissipate) {
  const Parameters p{0.3, 0.5, 0.01, 2, 0.4};
  std::mt19937 random(3);
  std::normal_distribution<double> g;
  for (int i = 0; i < 2000; ++i) {
    const double vx = 0.02 * g(random), vy = 0.02 * g(random), fn = std::fabs(g(random));
    const LawOutput a = slide(*ops, p, fn, vx, vy);
    EXPECT_LE(a.fx * vx + a.fy * vy, 0);
  }
}

TEST_F(Coulomb, BlockBelowTheConeAngle_NeverMoves) {
  Rig rig;
  const double angle = std::atan(0.5) - 1e-9;
  for (int i = 0; i < 60000; ++i)
    rig.step(*ops, Parameters{}.values(), 1e-3, 9.81 * std::sin(angle), 9.81 * std::cos(angle));
  EXPECT_EQ(rig.x, 0);
}

TEST_F(Coulomb, SlidingBlock_AcceleratesByGravityLessFriction) {
  Rig rig;
  const double angle = 0.6, expected = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle));
  for (int i = 0; i < 1000; ++i)
    rig.step(*ops, Parameters{}.values(), 1e-3, 9.81 * std::sin(angle), 9.81 * std::cos(angle));
  EXPECT_NEAR(rig.v, expected, 1e-12);
}

TEST_F(Coulomb, ThrownBlock_StopsWhereTheEnergyIsSpent) {
  Rig rig;
  rig.v = 2;
  const double h = 1e-4;
  for (int i = 0; i < 10000; ++i) rig.step(*ops, Parameters{}.values(), h, 0, 9.81);
  EXPECT_EQ(rig.v, 0);
  EXPECT_NEAR(rig.x, 2 * 2 / (2 * 0.5 * 9.81), 2 * h);
}

// A mass pulled through a spring at constant speed: the closed form of the stick-slip cycle
// between two levels.
// unsanitized: too slow there; shorter tests run the same code
TEST_F(Coulomb, StickSlipPeriod_MatchesTheClosedForm) {
  const double k = 2, pull = 0.1, fc = 1, fs = 1.5, w = std::sqrt(k), df = fs - fc, h = 1e-4;
  const double expected = 2 / w * (kPi - std::atan(df * w / (k * pull))) + 2 * df / (k * pull);  // 7.6113 s
  const Parameters levels{fc, fs, 1e-9, 2, 0};
  Rig rig;
  std::vector<double> starts;
  for (int i = 0; i < 320000; ++i) {
    const bool stuck = rig.v == 0;
    rig.step(*ops, levels.values(), h, k * (pull * i * h - rig.x), 1);
    if (stuck && rig.v != 0) starts.push_back(i * h);
  }
  ASSERT_GE(starts.size(), 4u);
  EXPECT_NEAR(starts[3] - starts[2], expected, 2e-3 * expected);
}

TEST_F(Coulomb, None_IsZeroEverywhere) {
  Batch b(9);
  for (uint32_t i = 0; i < b.n; ++i) {
    b.fn[i] = i;
    b.vt[i] = 1;
    b.stop[i] = -5;
    b.ft[i] = 7;
    b.limit[i] = 7;
  }
  ASSERT_EQ(dfm_law_eval(none, &b.in, &b.out), DFM_OK);
  for (uint32_t i = 0; i < b.n; ++i) {
    EXPECT_EQ(b.ft[i], 0);
    EXPECT_EQ(b.ft[b.stride + i], 0);
    EXPECT_EQ(b.limit[i], 0);
  }
  b.fn[3] = std::nan("");
  EXPECT_EQ(dfm_law_eval(none, &b.in, &b.out), DFM_DISCARD);
}

// ---- reference histories ----------------------------------------------------------------------------------

int column_of(const std::vector<std::string> &header, const std::string &name) {
  for (size_t i = 0; i < header.size(); ++i)
    if (header[i] == name) return static_cast<int>(i);
  return -1;
}

struct Reference : Coulomb {
  const Parameters dev{0.15, 0.20, 0.01, 2, 0.4};  // F_C 1.47 N, F_S 1.96 N at 9.8 N
  void compare(const std::string &file, const std::string &force) {
    const auto rows = test::read_csv(test::reference_dir() + "/friction/" + file);
    ASSERT_GT(rows.size(), 10u);
    const int v = column_of(rows[0], "v"), f = column_of(rows[0], force);
    ASSERT_TRUE(v >= 0 && f >= 0);
    int compared = 0;
    for (size_t i = 1; i < rows.size(); ++i) {
      const double slip = std::stod(rows[i][size_t(v)]), expected = std::stod(rows[i][size_t(f)]);
      // set-valued: the file holds sin(k pi) to rounding, and F = 0 there
      if (std::fabs(slip) < 1e-15) continue;
      EXPECT_NEAR(-slide(*ops, dev, 9.8, slip, 0).fx, expected, 2e-12) << "row " << i;
      ++compared;
    }
    EXPECT_GT(compared, 50);
  }
};

TEST_F(Reference, SteadyCurve_Matches) { compare("curves_steady.csv", "F_steady_lugre_ep_coulomb"); }
TEST_F(Reference, SineVelocity_Matches) { compare("sinvel_V1_coulomb.csv", "F"); }
TEST_F(Reference, SineVelocityDoubled_Matches) { compare("sinvel_V2_coulomb.csv", "F"); }

}  // namespace
