// The law gms: return-point memory, the reference histories, passivity in its own form, and the rules of
// every law (doc/laws/gms.md).
#include "bristle_rig.h"

using rig::Contact;
using rules::In;
using rules::Law;
using rules::Out;

namespace {

constexpr double kPi = 3.14159265358979323846;

// mu_C mu_S v_s delta sigma2 C, then as many k as nu: the law's table has sixteen of each, the unused 0.
std::vector<double> wide(const std::vector<double> &p) {
  const size_t n = (p.size() - 6) / 2;
  std::vector<double> out(6 + 32, 0.0);
  std::copy_n(p.begin(), 6 + n, out.begin());
  std::copy_n(p.begin() + 6 + static_cast<std::ptrdiff_t>(n), n, out.begin() + 22);
  return out;
}

struct Gms : testing::Test {
  tiny::Context c;
  dfm_law handle = 0;
  Law dev, maxwell;
  void SetUp() override {
    handle = rules::open(c, "friction_gms");
    // mu_C mu_S v_s delta sigma2 C k[4] nu[4]: F_C 1.47 N, F_S 1.96 N at 9.8 N
    dev = make({0.15, 0.20, 0.01, 2, 0.4, 60, 4000, 3000, 2000, 1000, 0.2, 0.3, 0.3, 0.2});
    // one level: Maxwell-slip
    maxwell = make({0.20, 0.20, 0.01, 2, 0, 60, 4000, 3000, 2000, 1000, 0.2, 0.3, 0.3, 0.2});
  }
  Law make(const std::vector<double> &params) const { return rules::law_of(handle, wide(params)); }
  rules::Draw draw() const { return {std::mt19937(11), 2e-5}; }
  static double g(double w) { return 9.8 * (0.15 + 0.05 * std::exp(-w * w / 1e-4)); }
};

TEST_F(Gms, SelfDescription_NamesItsKind) {
  const dfm_type *type = nullptr;
  ASSERT_EQ(dfm_law_type(handle, &type), DFM_OK);
  EXPECT_STREQ(type->id, "org.deform.gms");
  const char *keys[] = {"mu_C", "mu_S", "v_s", "delta", "sigma2", "C", "k", "nu"};
  ASSERT_EQ(type->nparam, 8u);
  for (int i = 0; i < 8; ++i) EXPECT_STREQ(type->params[i].key, keys[i]);
  EXPECT_EQ(type->params[6].width, 16u);
  EXPECT_EQ(type->params[7].width, 16u);
  EXPECT_TRUE(type->params[6].flags & type->params[7].flags & DFM_PARAM_LIST);
  EXPECT_EQ(dev.nstate, 13u);
  EXPECT_EQ(dev.pairs, (std::vector<uint32_t>{0, 2, 4, 6}));
  EXPECT_EQ(dev.flags, (std::vector<uint32_t>{8, 9, 10, 11, 12}));
}

TEST_F(Gms, RulesOfEveryLaw_AreKept) {
  for (const Law &l : {dev, maxwell}) {
    rules::of_every_bristle(l, draw(), 2e-5);
    EXPECT_GE(rules::worst_balance(l, 2e-5, 300, false), -1e-13);
    EXPECT_GE(rules::worst_balance(l, 2e-5, 300, true), -1e-13);
  }
}

TEST_F(Gms, Derivatives_MatchDifferences) {
  for (const Law &l : {dev, maxwell})
    rules::derivatives(l, draw(), 1000, 1e-6, [](const In &) { return false; });
}

// A contact whose area grows from one step to the next, as in a patch whose load moves, has no more energy
// for it: all bristles are let go first, so that only the budget is stored.
TEST_F(Gms, GrowingArea_BringsNoEnergy) {
  std::vector<double> state(dev.nstate, 0.0);
  state[dev.nstate - 1] = 1e-9;  // J: below what the law keeps at most at these forces and areas
  double last = 0;
  for (const double area : {1.0, 1.5, 3.0, 10.0}) {
    alignas(64) double fn[8] = {9.8}, vt[16] = {}, stop[16] = {}, a[8] = {area}, in_state[8 * 16] = {},
                       out_state[8 * 16] = {}, stored[8] = {};
    for (uint32_t s = 0; s < dev.nstate; ++s) in_state[8 * s] = state[s];
    dfm_friction_in in{};
    in.size = sizeof in;
    in.n = 1;
    in.stride = 8;
    in.dt = 1e-3;
    in.params = dev.params.data();
    in.fn = fn;
    in.vt = vt;
    in.ft_stop = stop;
    in.area = a;
    in.state = in_state;
    dfm_friction_out out{};
    out.size = sizeof out;
    out.state = out_state;
    out.stored = stored;
    ASSERT_EQ(dev.ops->eval(&in, &out), DFM_OK);
    for (uint32_t s = 0; s < dev.nstate; ++s) state[s] = out_state[8 * s];
    if (last > 0) {
      EXPECT_LE(stored[0], last) << area;
    }
    last = stored[0];
  }
  EXPECT_GT(last, 0);
}

TEST_F(Gms, Bits_MatchTheRecordedHash) {
  EXPECT_EQ(rules::hash_of_bits(dev, 2e-5), 4747621922367920675u);
  EXPECT_EQ(rules::hash_of_bits(maxwell, 2e-5), 7314650396550818082u);
}

TEST_F(Gms, ParametersThatDoNotFit_AreRefused) {
  const auto refusal = [&](const std::vector<double> &p) {
    char why[256] = "";
    EXPECT_EQ(dev.ops->check(wide(p).data(), why, sizeof why), DFM_E_ARG);
    return std::string(why);
  };
  EXPECT_NE(refusal({0.15, 0.20, 0.01, 2, 0, 60, 4000, 3000, 2000, 1000, 0.2, 0.3, 0.3, 0.3})
                .find("the 4 nu must add up to 1; their sum is 1.1"),
            std::string::npos);
  EXPECT_NE(
      refusal({0.15, 0.20, 0.01, 2, 0, 60, 4000, 0, 2000, 1000, 0.2, 0.3, 0.3, 0.2}).find("for element 2"),
      std::string::npos);
  EXPECT_NE(refusal({0.25, 0.20, 0.01, 2, 0, 60, 0, 0, 0, 0, 0, 0, 0, 0}).find("mu_S (0.2)"),
            std::string::npos);
  EXPECT_NE(refusal({0.15, 0.20, 0.01, 2, 0, 60, 5, 4, 3, 2, 1, 0, 0, 0, 0, 0})
                .find("k has 5 values and nu has none"),
            std::string::npos);
  EXPECT_NE(refusal({0.15, 0.20, 0.01, 2, 0, 60, 0, 0, 0, 0, 0, 0.2, 0.2, 0.2, 0.2, 0.2})
                .find("nu has 5 values and k has none"),
            std::string::npos);
  EXPECT_NE(
      refusal({0.15, 0.20, 0.01, 2, 0, 60, 5, 4, 3, 0, 0.5, 0.5, 0, 0}).find("k has 3 values and nu has 2 "),
      std::string::npos);
  EXPECT_NE(
      refusal({0.15, 0.20, 0.01, 2, 0, 60, 5, 0, 0, 0, 0.5, 0.5, 0, 0}).find("k has 1 value and nu has 2 "),
      std::string::npos);
  EXPECT_NE(
      refusal({0.15, 0.20, 0.01, 2, 0, 60, 5, 4, 3, 0, 0, 0, 0, 0}).find("k has 3 values and nu has none"),
      std::string::npos);
  EXPECT_NE(refusal({0.15, 0.20, 0.01, 2, 0, 60, 0, 0, 0, 0, 0.5, 0.5, 0, 0})
                .find("nu has 2 values and k has none"),
            std::string::npos);
  char why[256] = "";
  const std::vector<double> usual{0.5, 0.5, 0.01, 2, 0, 1e5, 0, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(dev.ops->check(wide(usual).data(), why, sizeof why), DFM_OK);
  Contact k(make(usual));
  EXPECT_NEAR(k.path(1e-10, 1, 1e-3), 1e8 * 1e-10, 1e-15) << "the usual four stiffnesses together";
}

// An inner loop closes where it began, to rounding: the force at a displacement depends on the extremes
// before it, not on the way between.
TEST_F(Gms, InnerLoops_CloseAtTheirReturnPoints) {
  Contact k(maxwell, 9.8);
  const double outer = k.path(2e-4, 200, 1e-3);
  k.path(-1.2e-4, 120, 1e-3);
  const double inner = k.path(4e-5, 40, 1e-3);
  k.path(-3e-5, 30, 1e-3);
  EXPECT_NEAR(k.path(3e-5, 30, 1e-3), inner, 1e-12) << "the loop within the loop";
  EXPECT_NEAR(k.path(8e-5, 80, 1e-3), outer, 1e-12) << "the loop";
}

TEST_F(Gms, OneLevel_IsMaxwellSlipInAnyStep) {
  const double stiffness[] = {4000, 3000, 2000, 1000}, share[] = {0.2, 0.3, 0.3, 0.2};
  Contact k(maxwell, 9.8);
  double f[4] = {};
  std::mt19937 random(2);
  for (int n = 0; n < 500; ++n) {
    const double dx = std::normal_distribution<double>(0, 1e-4)(random), h = n % 2 ? 1e-3 : 1.0 / 30;
    double sum = 0;
    for (int e = 0; e < 4; ++e) {
      f[e] = std::clamp(f[e] + stiffness[e] * dx, -share[e] * 1.96, share[e] * 1.96);
      sum += f[e];
    }
    EXPECT_NEAR(k.move(dx / h, 0, h).f[0], sum, 1e-12) << n;
  }
}

// At a crawl after sliding the elements rise to the static level, as published; the energy for that is what
// sliding has paid, and it is paid once.
TEST_F(Gms, CrawlAfterSliding_RisesOnWhatSlidingHasPaid) {
  Contact k(dev, 9.8);
  k.path(0.05, 500, 0.1);
  EXPECT_NEAR(k.last.f[0], g(0.1) + 0.04, 1e-9);
  Contact poor = k;
  poor.in.state[12] = 0;  // nothing in the budget
  for (int i = 0; i < 10000; ++i) {
    k.move(1e-12, 0, 1e-3);
    poor.move(1e-12, 0, 1e-3);
  }
  EXPECT_NEAR(k.last.f[0], 1.96, 0.05) << "10 s at 1e-12 m/s";
  EXPECT_NEAR(poor.last.f[0], 1.47, 1e-6);
  EXPECT_LT(k.in.state[12], 2.5e-4) << "the budget is bounded by the elastic energy at the static level";
}

TEST_F(Gms, SlidingForLong_IsTheSteadyCurveAtAnyStep) {
  for (double w = 1e-5; w < 1e3; w *= 7)
    for (double h : {1e-3, 1.0 / 30}) {
      Contact k(dev, 9.8);
      for (int i = 0; i < 100; ++i) k.move(w, 0, 1e-4 / w);
      for (int i = 0; i < 1000; ++i) k.move(w, 0, h);
      EXPECT_NEAR(k.last.f[0], g(w) + 0.4 * w, 1e-10 * (g(w) + 0.4 * w)) << w << " " << h;
      EXPECT_EQ(k.last.mode, 2) << w;
    }
}

TEST_F(Gms, BiasedLoadBelowBreakaway_DoesNotDriftAfterTheFirstCycle) {
  for (const Law &l : {maxwell, dev}) {
    Contact k(l, 9.8);
    std::vector<double> ends;
    for (int cycle = 0; cycle < 60; ++cycle) {
      for (int i = 1; i <= 100; ++i) k.carry(0.5 + 0.9 * std::sin(2 * kPi * i / 100.0), 1.0);
      ends.push_back(k.x);
    }
    EXPECT_LT(std::fabs(ends.back() - ends[10]), 1e-12);
  }
}

TEST_F(Gms, HeldAtAnyLoad_KeepsItsElementsToTheBit) {
  Contact k(dev, 9.8);
  k.path(1e-4, 1000, 1e-4);
  k.move(0, 0, 1e-3);
  const In held = k.in;
  for (int i = 0; i < 100000; ++i) k.move(0, 0, 1.0 / 60);
  for (int e = 0; e < 8; ++e) EXPECT_EQ(k.in.state[e], held.state[e]);
}

TEST_F(Gms, NearlyRigidElements_StayBoundedAndPassiveAtEveryStep) {
  for (double k : {1e9, 1e12, 1e15}) {
    const Law l =
        make({0.15, 0.20, 0.01, 2, 0.4, k / 100, 0.4 * k, 0.3 * k, 0.2 * k, 0.1 * k, 0.2, 0.3, 0.3, 0.2});
    EXPECT_GE(rules::worst_balance(l, 0.20 / k, 200, false), -1e-12) << k;
    rules::extremes(l, 0.20 / k);
  }
}

TEST_F(Gms, FallingNormalForce_CutsTheElementsFirst) { rig::expect_cut_by_falling_force(dev, 0.20); }

TEST_F(Gms, PreslidingLoops_MatchTheReference) {
  const rig::Table t = rig::read("presliding.csv");
  Contact a(
      make({0.20, 0.20, 0.01, 2, 0, 60, 4900, 2450, 1633.3333333333333, 1225, 980, 0.2, 0.2, 0.2, 0.2, 0.2}),
      9.8);
  for (size_t i = 2; i < t.size(); ++i)
    EXPECT_NEAR(a.path(t.at(i, "x") - t.at(i - 1, "x"), 1, 1e-3), t.at(i, "F_maxwell_slip"), 1e-11) << i;
}

// ---- any number of elements -------------------------------------------------------------------------------

std::vector<double> spread(uint32_t n, double mu_s = 0.20) {
  std::vector<double> p{0.15, mu_s, 0.01, 2, 0.4, 60};
  if (mu_s == 0.15) p[4] = 0;
  for (uint32_t e = 0; e < n; ++e) p.push_back(1e4 * 2 * (n - e) / (n * (n + 1.0)));
  for (uint32_t e = 0; e < n; ++e) p.push_back(1.0 / n);
  return p;
}

TEST_F(Gms, OneToSixteenElements_KeepTheStateThatTheyNeedAndTheRules) {
  for (const uint32_t n : {1u, 2u, 5u, 16u}) {
    const Law l = make(spread(n));
    EXPECT_EQ(l.nstate, 3 * n + 1);
    EXPECT_EQ(l.pairs.size(), n);
    EXPECT_GE(rules::worst_balance(l, 2e-5, 60, true), -1e-13) << n;
    rules::derivatives(l, draw(), 200, 1e-6, [](const In &) { return false; });
    rules::turns_with_the_frame(l, draw());
    rules::odd_to_the_bit(l, draw());
  }
}

TEST_F(Gms, SixteenElementsWithOneLevel_AreMaxwellSlipInAnyStep) {
  for (const uint32_t n : {1u, 5u, 16u}) {
    const std::vector<double> p = spread(n, 0.15);
    Contact k(make(p), 9.8);
    std::vector<double> f(n, 0.0);
    std::mt19937 random(2);
    for (int step = 0; step < 300; ++step) {
      const double dx = std::normal_distribution<double>(0, 1e-4)(random), h = step % 2 ? 1e-3 : 1.0 / 30;
      double sum = 0;
      for (uint32_t e = 0; e < n; ++e) {
        f[e] = std::clamp(f[e] + p[6 + e] * dx, -p[6 + n + e] * 1.47, p[6 + n + e] * 1.47);
        sum += f[e];
      }
      EXPECT_NEAR(k.move(dx / h, 0, h).f[0], sum, 1e-12) << n << " " << step;
    }
  }
}

TEST_F(Gms, NumberOfElements_IsThatOfTheValuesGiven) {
  const double k[17] = {5e7, 4e7, 3e7, 2e7, 1e7}, nu[5] = {0.2, 0.2, 0.2, 0.2, 0.2};
  const auto packed = [&](uint32_t nk, uint32_t nnu) {
    const dfm_param_value values[] = {{"k", k, nk}, {"nu", nu, nnu}};
    const dfm_params params{sizeof params, 2, values};
    std::vector<double> out(38, -1.0);
    uint32_t n = 0;
    const dfm_status status = dfm_law_pack(handle, &params, 38, out.data(), &n);
    return status == DFM_OK ? out : std::vector<double>();
  };
  const std::vector<double> five = packed(5, 5);
  ASSERT_EQ(five.size(), 38u) << dfm_last_error();
  EXPECT_EQ(five[10], 1e7);
  EXPECT_EQ(five[11], 0.0);
  EXPECT_EQ(rules::law_of(handle, five).nstate, 16u);
  EXPECT_TRUE(packed(17, 5).empty());
  EXPECT_NE(std::string(dfm_last_error()).find("\"k\" has 17 values, 1 to 16 expected"), std::string::npos)
      << dfm_last_error();
}

TEST_F(Gms, CaseWithFiveElements_RunsOnTheRig) {
  const std::string dir = tiny::folder("gms_case");
  test::write_file(dir + "/five.json",
                   R"({"scenario": "sinvel", "law": "gms", "columns": [{"name": "t"}, {"name": "F"},
      {"name": "f1"}, {"name": "f5"}],
    "params": {"F_C": 1.47, "F_S": 1.96, "v_s": 0.01, "delta": 2, "sigma2": 0.4, "C": 60,
      "k": [4000, 3000, 2000, 1000, 500], "nu": [0.2, 0.3, 0.2, 0.2, 0.1]},
    "initial": {}, "input": {"kind": "sine_velocity", "V": 0.01, "freq": 1, "T": 0.5},
    "output_times": [0, 0.1, 0.2]})");
  const test::CommandResult r = test::deform({"friction", dir + "/five.json", "--csv", dir + "/five.csv"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(test::read_file(dir + "/five.csv").substr(0, 10), "t,F,f1,f5\n");
}

}  // namespace
