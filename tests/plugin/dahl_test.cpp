// The law dahl against its closed forms (doc/laws/formulas.md (11) to (14)) and the rules of every law.
#include "bristle_rig.h"

using rig::Contact;
using rules::In;
using rules::Law;
using rules::Out;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Dahl : testing::Test {
  tiny::Context c;
  Law law, bent;  // F_C = 1.47 N at 9.8 N; exponent 1 and 2.5
  void SetUp() override {
    const dfm_law handle = rules::open(c, "friction_dahl");
    law = rules::law_of(handle, {0.15, 1e4, 1});
    bent = rules::law_of(handle, {0.15, 1e4, 2.5});
  }
  rules::Draw draw() const { return {std::mt19937(11), 0.15 / 1e4}; }
};

TEST_F(Dahl, SelfDescription_NamesItsKind) {
  const dfm_type *type = nullptr;
  ASSERT_EQ(dfm_law_type(c.open("dahl"), &type), DFM_OK);
  EXPECT_STREQ(type->id, "org.deform.dahl");
  EXPECT_EQ(law.ops->flags, uint32_t(DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN));
  EXPECT_EQ(law.ops->needs, uint32_t(DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA));
  const char *keys[] = {"mu_C", "sigma0", "alpha"};
  ASSERT_EQ(type->nparam, 3u);
  for (int i = 0; i < 3; ++i) EXPECT_STREQ(type->params[i].key, keys[i]);
  EXPECT_STREQ(type->params[1].unit, "N/m^3");
  EXPECT_EQ(law.pairs, std::vector<uint32_t>{0});
  EXPECT_EQ(law.nstate, 2u);
}

TEST_F(Dahl, RulesOfEveryLaw_AreKept) {
  for (const Law &l : {law, bent}) {
    rules::of_every_bristle(l, draw(), 1.5e-5);
    EXPECT_GE(rules::worst_balance(l, 1.5e-5, 300, false), -1e-13);
    EXPECT_GE(rules::worst_balance(l, 1.5e-5, 300, true), -1e-13);
  }
}

TEST_F(Dahl, Derivatives_MatchDifferences) {
  const auto kink = [](const In &in) {
    return std::fabs(rules::norm(in.state) * 1e4 * in.area / (0.15 * in.fn) - 1) < 1e-3;
  };
  rules::derivatives(law, draw(), 1000, 1e-6, kink);
  rules::derivatives(bent, draw(), 1000, 1e-5, kink);
}

TEST_F(Dahl, Bits_MatchTheRecordedHash) {
  EXPECT_EQ(rules::hash_of_bits(law, 1.5e-5), 8359154458321186457u);
  EXPECT_EQ(rules::hash_of_bits(bent, 1.5e-5), 7379536935484329877u);
}

// Closed forms along the path: F = F_C (1 - e^(-sigma x/F_C)) for exponent 1, else (1 - u)^(1-a) = 1 + (a-1)
// sigma x / F_C.
TEST_F(Dahl, Loading_IsTheClosedForm) {
  const double fc = 1.47, dx = 3e-4;
  for (double a : {1.0, 2.0, 2.5}) {
    double before = 0;
    const double s = 1e4 * dx / fc, rest = 1 + (a - 1) * s;
    const double expected =
        a == 1 ? fc * (1 - std::exp(-s)) : fc * (1 - (rest > 0 ? std::pow(rest, 1 / (1 - a)) : 0.0));
    for (int n : {1000, 2000, 4000}) {
      Contact k({law.ops, {0.15, 1e4, a}, 2, {0}, {}, false}, 9.8);
      const double error = std::fabs(k.path(dx, n, 0.01) - expected);
      EXPECT_LT(error, 1.0 * fc / n) << a;
      if (before > 1e-9) {
        EXPECT_NEAR(before / error, 2, 0.1) << a << ": first order";
      }
      before = error;
    }
  }
}

TEST_F(Dahl, SlidingForLong_ReachesTheLevelInOneStepOrMany) {
  for (double a : {1.0, 2.0})
    for (double h : {1e-6, 1e-3, 1.0 / 30})
      for (double w : {1e-4, 1.0, 1e6}) {
        Contact k({law.ops, {0.15, 1e4, a}, 2, {0}, {}, false}, 9.8);
        for (int i = 0; i < 200 || k.x < 0.02; ++i) k.move(w, 0, h > 0.02 / w / 200 ? h : 0.02 / w / 200);
        // exponent 2 closes as 1/x
        EXPECT_NEAR(k.last.f[0], 1.47, a > 1 ? 2e-2 : 1e-9) << a << " " << h << " " << w;
        EXPECT_LE(k.last.f[0], 1.47 * (1 + 1e-15));
      }
}

// Same path, ten and a thousand times the speed: same force to rounding, because h v is all that enters.
TEST_F(Dahl, Speed_DoesNotMatter) {
  for (const Law &l : {law, bent}) {
    Contact a(l, 9.8), b(l, 9.8);
    for (double dx : {2e-4, -1.2e-4, 3e-5, -4e-4})
      EXPECT_NEAR(a.path(dx, 100, 1e-4), b.path(dx, 100, 0.1), 1e-12);
  }
}

// A load that cycles between F1 and F2 below the level lets the contact creep: per cycle (F_C/sigma) ln{[1 -
// (F1/F_C)^2]/[1 - (F2/F_C)^2]}.
TEST_F(Dahl, BiasedLoadBelowTheLevel_DriftsByTheClosedForm) {
  const double fc = 1.47, f1 = -0.5, f2 = 0.9;
  const double expected = fc / 1e4 * std::log((1 - f1 * f1 / fc / fc) / (1 - f2 * f2 / fc / fc));
  const double work =
      1e-4 * (-2 * fc * (f2 - f1) +
              fc * fc * std::log((1 - f1 / fc) * (1 + f2 / fc) / ((1 - f2 / fc) * (1 + f1 / fc))));
  Contact k(law, 9.8);
  double x0 = 0, done = 0;
  for (int cycle = 0; cycle < 3; ++cycle) {
    x0 = k.x;
    done = 0;
    for (int i = 1; i <= 2000; ++i) {
      const double t = i / 2000.0;
      const double load = f1 + (f2 - f1) * (t < 0.5 ? 2 * t : 2 - 2 * t);
      const double before = k.x;
      const double force = k.last.f[0];
      k.carry(load, 1e-3);
      done += 0.5 * (force + k.last.f[0]) * (k.x - before);
    }
  }
  EXPECT_NEAR(k.x - x0, expected, 0.005 * expected);
  EXPECT_NEAR(done, work, 0.005 * work);
}

// Sliding around a circle of radius R: the elastic force lags by atan(F_C/(sigma R)) and is F_C/sqrt(1 +
// (F_C/(sigma R))^2).
TEST_F(Dahl, AroundACircle_LagsByTheClosedForm) {
  const double r = 5e-4, v = 5e-3, h = 1e-5, s = 1.47 / (1e4 * r);
  Contact k(law, 9.8);
  double t = 0;
  for (int i = 0; i < 60000; ++i, t += h)
    k.move(v * std::cos(v / r * (t + h)), v * std::sin(v / r * (t + h)), h);
  const double lag = std::remainder(v / r * t - std::atan2(k.last.f[1], k.last.f[0]), 2 * kPi);
  EXPECT_NEAR(rules::norm(k.last.f), 1.47 / std::sqrt(1 + s * s), 1e-3);
  EXPECT_NEAR(lag, std::atan(s), 1e-3);
}

TEST_F(Dahl, NearlyRigidBristles_StayBoundedAndPassiveAtEveryStep) {
  for (double sigma0 : {1e9, 1e12, 1e15})
    for (double alpha : {1.0, 3.0}) {
      const Law l{law.ops, {0.15, sigma0, alpha}, 2, {0}, {}, false};
      EXPECT_GE(rules::worst_balance(l, 0.15 / sigma0, 200, false), -1e-12) << sigma0;
      rules::extremes(l, 0.15 / sigma0);
    }
}

TEST_F(Dahl, FallingNormalForce_CutsTheBristleFirst) {
  Contact k = rig::expect_cut_by_falling_force(law, 0.15);
  k.in.fn = 9.8;
  k.move(0, 0, 1e-3);
  EXPECT_NEAR(k.last.f[0], 0.15, 1e-15) << "what was lost does not come back with the normal force";
}

TEST_F(Dahl, HeldStill_KeepsItsBristleToTheBit) {
  Contact k(bent, 9.8);
  k.path(1e-4, 10, 0.1);
  const double z = k.in.state[0];
  for (int i = 0; i < 100000; ++i) k.move(0, 0, 1.0 / 60);
  EXPECT_EQ(k.in.state[0], z);
}

TEST_F(Dahl, SteadyCurve_MatchesTheReference) { rig::expect_steady_curve(law, "F_steady_dahl"); }

TEST_F(Dahl, PreslidingLoops_MatchTheReference) {
  const rig::Table t = rig::read("presliding.csv");
  for (int a : {1, 2}) {
    Contact k({law.ops, {0.15, 1e4, double(a)}, 2, {0}, {}, false}, 9.8);
    double worst = 0;
    for (size_t i = 2; i < t.size(); ++i) {
      const double f = k.path(t.at(i, "x") - t.at(i - 1, "x"), 200, 1e-3);
      worst = test::worse(worst, std::fabs(f - t.at(i, a == 1 ? "F_dahl_alpha1" : "F_dahl_alpha2")));
    }
    EXPECT_LT(worst, 1e-3) << a;
  }
}

}  // namespace
