// The law lugre against closed forms (doc/laws/lugre.md), passivity, reference files, and common rules.
#include "bristle_rig.h"

using rig::Contact;
using rules::In;
using rules::Law;
using rules::Out;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Lugre : testing::Test {
  tiny::Context c;
  dfm_law handle = 0;
  Law dev, constant, falling, published;
  void SetUp() override {
    handle = rules::open(c, "friction_lugre");
    // mu_C mu_S v_s delta sigma0 sigma1 form v_d sigma2: F_C 1.47 N, F_S 1.96 N at 9.8 N
    dev = make({0.15, 0.20, 0.01, 2, 1e4, 20, 0, 0.01, 0.4});
    constant = make({0.15, 0.20, 0.01, 2, 1e4, 20, 1, 0.01, 0.4});
    falling = make({0.15, 0.20, 0.01, 1.3, 1e4, 20, 2, 0.03, 0.4});
    published = make({1, 1.5, 0.001, 2, 1e5, 316.22776601683796, 1, 0.01, 0.4});
  }
  Law make(std::vector<double> params) const { return rules::law_of(handle, std::move(params)); }
  rules::Draw draw() const { return {std::mt19937(11), 0.20 / 1e4}; }
  static double g(double w) { return 9.8 * (0.15 + 0.05 * std::exp(-w * w / 1e-4)); }
};

TEST_F(Lugre, SelfDescription_NamesItsKind) {
  const dfm_type *type = nullptr;
  ASSERT_EQ(dfm_law_type(handle, &type), DFM_OK);
  EXPECT_STREQ(type->id, "org.deform.lugre");
  EXPECT_EQ(dev.ops->flags, uint32_t(DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN));
  const char *keys[] = {"mu_C", "mu_S", "v_s", "delta", "sigma0", "sigma1", "sigma1_form", "v_d", "sigma2"};
  ASSERT_EQ(type->nparam, 9u);
  for (int i = 0; i < 9; ++i) EXPECT_STREQ(type->params[i].key, keys[i]);
  EXPECT_STREQ(type->params[6].names[0], "passive");
  EXPECT_EQ(type->params[6].def, 0) << "the form that cannot push is what one gets";
  EXPECT_EQ(dev.nstate, 2u);
}

TEST_F(Lugre, RulesOfEveryLaw_AreKept) {
  for (const Law &l : {dev, constant, falling}) {
    rules::of_every_bristle(l, draw(), 2e-5);
  }
}

TEST_F(Lugre, Derivatives_MatchDifferences) {
  const auto kink = [](const In &in) {
    return std::fabs(rules::norm(in.state) * 1e4 * in.area / (0.20 * in.fn) - 1) < 1e-3;
  };
  for (const Law &l : {dev, constant, falling}) rules::derivatives(l, draw(), 1000, 1e-6, kink);
}

TEST_F(Lugre, Bits_MatchTheRecordedHash) {
  EXPECT_EQ(rules::hash_of_bits(dev, 2e-5), 15086323913255929209u);
  EXPECT_EQ(rules::hash_of_bits(constant, 2e-5), 1731567456786764915u);
  EXPECT_EQ(rules::hash_of_bits(falling, 2e-5), 5274140658457432186u);
}

// Random speeds, steps to 1/60 s, normal forces, also 0: the default form is passive for all parameters.
TEST_F(Lugre, PassiveForm_CreatesNoWork) {
  for (double sigma1 : {20.0, 316.0, 1e6})
    for (double sigma2 : {0.0, 0.4}) {
      EXPECT_GE(
          rules::worst_balance(make({0.15, 0.20, 0.01, 2, 1e4, sigma1, 0, 0.01, sigma2}), 2e-5, 300, false),
          -1e-13)
          << sigma1;
      EXPECT_GE(
          rules::worst_balance(make({0.15, 0.20, 0.01, 2, 1e4, sigma1, 0, 0.01, sigma2}), 2e-5, 300, true),
          -1e-13)
          << sigma1;
    }
}

// Mutation: the published parameters with constant sigma1 create work, with the passive form they do not.
TEST_F(Lugre, PublishedParametersWithConstantSigma1_FailThatTest) {
  EXPECT_LT(rules::worst_balance(published, 1.5e-5, 300, false), -0.01);
  Law passive = published;
  passive.params[6] = 0;
  EXPECT_GE(rules::worst_balance(passive, 1.5e-5, 300, false), -1e-13);
  // bristle at F_S, jump to 0.05 m/s: it pushes with 6.4 N
  In in;
  in.h = 1e-9;
  in.v[0] = 0.05;
  in.state[0] = 1.5e-5;
  EXPECT_NEAR(rules::evaluate(published, in).f[0], -6.4, 0.1);
  EXPECT_GT(rules::evaluate(passive, in).f[0], -0.1) << "no more than the stored energy pays for";
}

TEST_F(Lugre, ConstantSigma1_WarnsWithTheNumbersOfTheInequality) {
  const auto evaluate_once = [&](const Law &l) {
    c.log.clear();
    tiny::Batch b(1, l.params, 2);
    ASSERT_EQ(dfm_law_eval(handle, &b.in, &b.out), DFM_OK) << dfm_last_error();
  };
  evaluate_once(published);
  EXPECT_TRUE(c.logged("sigma2 mu_C >= sigma1 (mu_S - mu_C), and 0.4 < 158.114"));
  evaluate_once(dev);
  EXPECT_FALSE(c.logged("sigma1"));
  evaluate_once(make({0.5, 0.5, 0.01, 2, 1e4, 20, 1, 0.01, 0}));
  EXPECT_FALSE(c.logged("sigma1")) << "one level: constant sigma1 is passive";
  evaluate_once(make({0.15, 0.20, 0.01, 2, 1e4, 20, 2, 0.03, 0.4}));
  EXPECT_TRUE(c.logged("above a contact pressure p of 0.42"));
}

TEST_F(Lugre, StaticLevelBelowTheKineticOne_IsRefused) {
  const std::vector<double> p{0.5, 0.4, 0.01, 2, 1e4, 20, 0, 0.01, 0.4};
  char why[256] = "";
  EXPECT_EQ(dev.ops->check(p.data(), why, sizeof why), DFM_E_ARG);
  EXPECT_NE(std::string(why).find("mu_S (0.4)"), std::string::npos);
}

TEST_F(Lugre, SlidingForLong_IsTheSteadyCurveAtAnyStep) {
  for (double w = 1e-6; w < 1e3; w *= 7)
    for (double h : {1e-6, 1e-3, 1.0 / 30}) {
      Contact k(dev, 9.8);
      for (int i = 0; i < 30; ++i) k.move(w, 0, 1e-3 / w);
      for (int i = 0; i < 100; ++i) k.move(w, 0, h);
      EXPECT_NEAR(k.last.f[0], g(w) + 0.4 * w, 1e-12 * (g(w) + 0.4 * w)) << w;
      EXPECT_EQ(k.last.mode, 2) << w;
    }
}

TEST_F(Lugre, VanishingNormalForce_LeavesTheSlopeOfTheCone) {
  rig::expect_cone_at_vanishing_force(make({0.15, 0.20, 0.01, 2, 1e4, 20, 0, 0.01, 0}));
  rig::expect_cone_at_vanishing_force(make({0.15, 0.20, 0.01, 2, 1e9, 0, 0, 0.01, 0}));
}

TEST_F(Lugre, NearlyRigidBristles_StayBoundedAndPassiveAtEveryStep) {
  for (double sigma0 : {1e9, 1e12, 1e15}) {
    const Law l = make({0.15, 0.20, 0.01, 2, sigma0, 1e-3 * sigma0, 0, 0.01, 0.4});
    EXPECT_GE(rules::worst_balance(l, 0.20 / sigma0, 200, false), -1e-12) << sigma0;
    rules::extremes(l, 0.20 / sigma0);
  }
}

// A step so long that h sigma0 w / g = 1e12 ends on the level, as every shorter one.
TEST_F(Lugre, HugeStep_EndsOnTheLevel) {
  Contact k(make({0.15, 0.20, 0.01, 2, 1e9, 20, 0, 0.01, 0.4}), 9.8);
  k.move(44.1, 0, 1.0 / 30);  // 1e9 * 44.1 / 30 / 1.47 = 1e9
  EXPECT_NEAR(k.last.f[0], 1.47 + 0.4 * 44.1, 1e-7);
  k.move(-44.1e3, 0, 1.0 / 30);
  EXPECT_NEAR(k.last.f[0], -(1.47 + 0.4 * 44.1e3), 1e-6);
}

// While the load stays far below the level the contact is a spring sigma0 with a damper sigma1 + sigma2.
TEST_F(Lugre, SmallMotion_IsASpringAndADamper) {
  In in;
  in.fn = 9.8;
  in.v[0] = 1e-9;
  in.h = 1e-3;
  in.state[0] = 1e-9;
  const Out o = rules::evaluate(dev, in);
  EXPECT_NEAR(o.f[0], 1e4 * (1e-9 + 1e-12) + 20.4 * 1e-9, 1e-12);
  EXPECT_NEAR(o.dv[0], 1e4 * 1e-3 + 20 + 0.4, 1e-3);
  EXPECT_NEAR(o.dv[3], 1e4 * 1e-3 + 20 + 0.4, 1e-3);
  EXPECT_EQ(o.mode, 1);
  EXPECT_NEAR(o.limit, 1.96, 1e-6);
  EXPECT_NEAR(o.stored, 0.5e4 * o.state[0] * o.state[0], 1e-20);
}

TEST_F(Lugre, HeldStill_KeepsItsBristleToTheBit) {
  Contact k(dev, 9.8);
  k.path(1e-4, 10, 0.1);
  const double z = k.in.state[0];
  for (int i = 0; i < 100000; ++i) k.move(0, 0, 1.0 / 60);
  EXPECT_EQ(k.in.state[0], z);
  EXPECT_EQ(k.last.mode, 1);
}

// As Dahl with F_S: quasi-static cycles far below v_s.
TEST_F(Lugre, BiasedLoadBelowTheLevel_DriftsByTheClosedForm) {
  const double fs = 1.96, f1 = -0.5, f2 = 0.9;
  const double expected = fs / 1e4 * std::log((1 - f1 * f1 / fs / fs) / (1 - f2 * f2 / fs / fs));
  Contact k(dev, 9.8);
  double x0 = 0;
  for (int cycle = 0; cycle < 3; ++cycle) {
    x0 = k.x;
    for (int i = 1; i <= 2000; ++i) {
      const double t = i / 2000.0;
      k.carry(f1 + (f2 - f1) * (t < 0.5 ? 2 * t : 2 - 2 * t), 1.0);
    }
  }
  EXPECT_NEAR(k.x - x0, expected, 0.005 * expected);
}

TEST_F(Lugre, FallingNormalForce_CutsTheBristleFirst) {
  rig::expect_cut_by_falling_force(dev, 0.20);  // 1.94 N where the projection comes last
}

// The loop of force over speed widens with the frequency: the frictional lag.
TEST_F(Lugre, FasterChangeOfSpeed_LagsMore) {
  double width[2];
  int n = 0;
  for (double frequency : {1.0, 10.0}) {
    Contact k(dev, 9.8);
    const double h = 1e-4 / frequency;
    double up = 0, down = 0;
    for (int i = 0; i < 30000; ++i) {
      const double before = 0.01 + 0.008 * std::sin(2 * kPi * frequency * i * h);
      const double v = 0.01 + 0.008 * std::sin(2 * kPi * frequency * (i + 1) * h);
      k.move(v, 0, h);
      if (i > 15000 && before < 0.01 && v >= 0.01) up = k.last.f[0];
      if (i > 15000 && before > 0.01 && v <= 0.01) down = k.last.f[0];
    }
    width[n++] = up - down;
  }
  EXPECT_GT(width[1], 2 * width[0]);
  EXPECT_GT(width[0], 0);
}

TEST_F(Lugre, SteadyCurve_MatchesTheReference) {
  rig::expect_steady_curve(dev, "F_steady_lugre_ep_coulomb", "z_steady_lugre");
}

}  // namespace
