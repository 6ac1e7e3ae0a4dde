// The rig of `deform friction` on its own: closed forms of the cases in examples/friction, and which of
// several solutions a step takes.
#include <gtest/gtest.h>

#include <sstream>

#include "friction_rig.h"

namespace {

using test::rig::example;
using test::rig::Outcome;
using test::rig::run;

const double kPi = 3.14159265358979323846;
std::string tiny(const std::string &name) {
  return std::string(DEFORM_BINARY_DIR) + "/lib/tiny/" + name + ".so";
}

std::string file(const std::string &name, const std::string &text) {
  const std::string path = test::scratch("friction_rig") + "/" + name;
  test::write_file(path, text);
  return path;
}

// The numbers of `"KEY": [..]` in a line of JSON.
std::vector<double> list(const std::string &json, const std::string &key) {
  const size_t at = json.find("\"" + key + "\": [");
  if (at == std::string::npos) return {};
  std::istringstream text(json.substr(json.find('[', at) + 1));
  std::vector<double> out;
  for (double x; text >> x; text.get()) out.push_back(x);
  return out;
}

}  // namespace

TEST(FrictionRig, BrakedMass_StopsWhereEnergySays) {
  for (const char *law : {"coulomb", "karnopp"}) {
    const Outcome out = run(example("braked_mass"), {"--law", law, "--step", "1e-4"});
    const std::vector<double> t = out.rows.column("t"), v = out.rows.column("v"), f = out.rows.column("F");
    for (size_t i = 0; i < t.size(); ++i) {
      EXPECT_NEAR(v[i], std::max(0.0, 1 - t[i] / 0.3), 4e-4) << law;
      EXPECT_EQ(v[i] == 0, t[i] > 0.3) << law << ": a mass that rests rests exactly";
      EXPECT_NEAR(f[i], t[i] < 0.3 ? 20.0 / 3 : 0, 1e-12) << law;
    }
    EXPECT_NEAR(out.figure("x_end"), 0.15, 1e-4) << law;
  }
}

TEST(FrictionRig, SteadyPush_AcceleratesByTheNetForce) {
  const Outcome out = run(example("steady_push"));
  const std::vector<double> t = out.rows.column("t"), x = out.rows.column("x"), v = out.rows.column("v");
  for (size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(v[i], t[i], 1e-10);  // (2 - 1) N on 1 kg
    EXPECT_NEAR(x[i], 0.5 * t[i] * t[i], 0.51e-4 * t[i]);
  }
  EXPECT_EQ(out.rows.column("F")[0], 1.5);  // the limit that 2 N passes
}

// Plain Coulomb pulled by a spring: doc/laws/formulas.md (15).
TEST(FrictionRig, StickSlip_HasThePeriodOfTheClosedForm) {
  const double k = 4;
  const double V = 0.1;
  const double dF = 0.25;
  const double w = std::sqrt(k);
  const double period = 2 / w * (kPi - std::atan(dF * w / (k * V))) + 2 * dF / (k * V);
  double before = 0;
  for (const char *step : {"2e-3", "1e-3", "5e-4"}) {
    const Outcome out = run(example("stick_slip"), {"--step", step});
    const double error = std::fabs(out.figure("period") - period);
    EXPECT_LT(error, 1.5 * std::strtod(step, nullptr));
    EXPECT_NEAR(out.figure("spring_force_max"), 1 + std::sqrt(dF * dF + V * V * k), 2e-3);
    EXPECT_NEAR(out.figure("release_times"), (1 + dF) / (k * V), 2e-3);
    before = error;
  }
  EXPECT_LT(before, 5e-4);
}

// The stick-slip of Canudas de Wit et al. 1995, k 2 N/m, V 0.1 m/s. Times at which the speed passes V/100 are
// from an integration to 1e-8 (Radau). Speeds of a bristle are never 0: one release, at 0 s, and no
// stick were reported.
TEST(FrictionRig, StickSlipOfLuGre_IsReleasedAndSticks) {
  const std::string path = file("lugre_stick_slip.json", R"({"law": "lugre", "mass": 1, "gravity": 9.81,
    "params": {"F_C": 1, "F_S": 1.5, "v_s": 0.001, "sigma0": 1e5, "sigma1": 316.227766, "sigma2": 0.4},
    "input": {"kind": "spring_pull", "k": 2, "V": 0.1, "T": 20, "dt": 0.05}})");
  const Outcome out = run(path);
  const std::vector<double> release = list(out.figures, "release_times"),
                            stick = list(out.figures, "stick_times");
  ASSERT_EQ(release.size(), 2u) << out.figures;
  ASSERT_EQ(stick.size(), 2u) << out.figures;
  EXPECT_NEAR(release[0], 7.43761, 5e-4);
  EXPECT_NEAR(release[1], 13.80033, 5e-4);
  EXPECT_NEAR(stick[0], 10.26276, 5e-4);
  EXPECT_NEAR(stick[1], 16.62548, 5e-4);
}

// Set-valued laws break away at F_S at every rate, and the rig finds it between its steps.
TEST(FrictionRig, BreakawayOfCoulomb_DoesNotDependOnTheRate) {
  const Outcome out = run(example("breakaway"));
  const std::vector<double> rate = out.rows.column("rate");
  const std::vector<double> peak = out.rows.column("F_ba");
  const std::vector<double> t = out.rows.column("t_ba");
  for (size_t i = 0; i < rate.size(); ++i) {
    EXPECT_NEAR(peak[i], 1.5, 1e-6) << rate[i];
    EXPECT_GE(rate[i] * t[i], 1.5 * (1 - 1e-9)) << rate[i];
    // slip starts slowly: the force lies flat on F_S for a while
    EXPECT_LE(rate[i] * t[i], 1.51) << rate[i];
  }
  const Outcome lugre = run(example("breakaway"), {"--law", "lugre"});
  const Outcome ep = run(example("breakaway"), {"--law", "ep"});
  const std::vector<double> l = lugre.rows.column("F_ba"), e = ep.rows.column("F_ba");
  EXPECT_GT(l[0], l[1] + 0.1);
  EXPECT_GE(l[1], l[2] + 0.1);
  // Dupont et al. 2002: a little above at every rate
  for (size_t i = 0; i < 2; ++i) EXPECT_GT(e[i], l[i]);
  const Outcome dahl = run(example("breakaway"), {"--law", "dahl"});
  for (const double f : dahl.rows.column("F_ba")) EXPECT_NEAR(f, 1.0, 1e-6);
  for (const double inside : dahl.rows.column("interior_peak")) EXPECT_EQ(inside, 0);
}

// F = s F_C + (F_0 - s F_C) exp(-sigma |dx|/F_C), piece by piece.
TEST(FrictionRig, LoopsOfDahl_AreExponentials) {
  const Outcome out = run(example("loops"));
  const double corner[] = {0, 2e-4, 5e-5, 2e-4, -2e-4, 2e-4}, level = 1.5, sigma = 1e4;
  const std::vector<double> x = out.rows.column("x");
  const std::vector<double> segment = out.rows.column("segment");
  const std::vector<double> f = out.rows.column("F");
  double at_corner[6] = {};
  for (int k = 1; k < 6; ++k) {
    const double s = corner[k] > corner[k - 1] ? level : -level;
    at_corner[k] =
        s + (at_corner[k - 1] - s) * std::exp(-sigma * std::fabs(corner[k] - corner[k - 1]) / level);
  }
  ASSERT_EQ(x.size(), 101u);
  for (size_t i = 1; i < x.size(); ++i) {
    const int k = int(segment[i]);
    const double s = corner[k + 1] > corner[k] ? level : -level;
    ASSERT_NEAR(f[i], s + (at_corner[k] - s) * std::exp(-sigma * std::fabs(x[i] - corner[k]) / level), 1e-5)
        << i;
  }
}

// A third party's Prandtl element has its closed form at any step: F moves with the path by sigma0 dx and
// stays within mu fn.
TEST(FrictionRig, LoopsOfAThirdPartyLaw_AreExact) {
  const Outcome out = run(example("loops"), {"--law", tiny("tiny_bristle"), "--step", "1e-2"});
  const std::vector<double> x = out.rows.column("x"), f = out.rows.column("F");
  double held = 0;
  for (size_t i = 1; i < x.size(); ++i) {
    held = std::clamp(held + 1e4 * (x[i] - x[i - 1]), -1.5, 1.5);
    ASSERT_NEAR(f[i], held, 1e-11) << i;
  }
}

// A law without derivatives: viscous drag, v = (f/c)(1 - e^(-c t/m)).
TEST(FrictionRig, LawWithoutDerivatives_IsSolvedAllTheSame) {
  const std::string text =
      R"({"law": "drag", "mass": 2.0, "params": {"c": 3.0},
 "input": {"kind": "bias_sine_force", "bias": 6, "amp": 0, "freq": 1},
 "columns": ["t", "v", "F"], "output_times": [0, 0.2, 1, 3]})";
  const Outcome out = run(file("drag.json", text), {"--law", tiny("tiny_law"), "--step", "1e-4"});
  const std::vector<double> t = out.rows.column("t"), v = out.rows.column("v"), f = out.rows.column("F");
  for (size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(v[i], 2 * (1 - std::exp(-1.5 * t[i])), 1e-4);
    EXPECT_NEAR(f[i], 3 * v[i], 1e-11);
  }
  EXPECT_LT(out.figure("evaluations"), 12 * out.figure("steps"));  // of which each is a whole and two halves
}

// F_el = g/sqrt(1 + (g/(sigma0 R))^2), behind the slip by atan(g/(sigma0 R)).
TEST(FrictionRig, Circle_LagsByTheClosedForm) {
  const double g = 1.0 + 0.5 * std::exp(-0.25), ratio = g / (1e4 * 4e-4);
  const Outcome out = run(example("circle"));
  const std::vector<double> vx = out.rows.column("vx");
  const std::vector<double> vy = out.rows.column("vy");
  const std::vector<double> fx = out.rows.column("Fx");
  const std::vector<double> fy = out.rows.column("Fy");
  const size_t last = vx.size() - 1;
  EXPECT_NEAR(std::hypot(fx[last], fy[last]), g / std::sqrt(1 + ratio * ratio), 1e-3);
  const double lag =
      std::atan2(vx[last] * -fy[last] + vy[last] * fx[last], vx[last] * fx[last] + vy[last] * fy[last]);
  EXPECT_NEAR(lag, std::atan(ratio), 1e-3);
}

TEST(FrictionRig, LoadWave_StaysOnTheConeAndOpens) {
  const Outcome out = run(example("load_wave"));
  const std::vector<double> fn = out.rows.column("Fn");
  const std::vector<double> f = out.rows.column("F_elastic");
  const std::vector<double> closed = out.rows.column("closed");
  int open = 0;
  for (size_t i = 0; i < fn.size(); ++i) {
    EXPECT_EQ(closed[i], fn[i] > 0 ? 1 : 0);
    EXPECT_LE(std::fabs(f[i]), 0.2 * std::max(fn[i], 0.0) * (1 + 1e-12));
    open += closed[i] == 0;
  }
  EXPECT_GT(open, 20);
}

// The drift of a cycle between F1 and F2, quasi-static: doc/laws/formulas.md (12); the elasto-plastic law
// comes back to where it was.
TEST(FrictionRig, SlowShake_DriftsAsDahlMustAndNotAsElastoplastic) {
  const double level = 1.5, f1 = -0.5, f2 = 0.9;
  const double drift = level / 1e4 * std::log((1 - f1 * f1 / level / level) / (1 - f2 * f2 / level / level));
  const std::vector<double> dahl = run(example("slow_shake"), {"--step", "1e-3"}).rows.column("x");
  EXPECT_NEAR((dahl[8] - dahl[2]) / 6, drift, 0.02 * drift);
  const std::vector<double> ep =
      run(example("slow_shake"), {"--law", "ep", "--step", "1e-3"}).rows.column("x");
  EXPECT_NEAR(ep[8], ep[2], 1e-12);
  EXPECT_NEAR(ep[8], 0.2e-4, 1e-6);
}

// h = 0.02 s is 4.3 times the bound m v_s/(0.858 (F_S - F_C)) under which a step has one solution. What
// slides stays on the branch that slides, what starts does so by the slow one: each step is checked against
// the force balance, and the speed never jumps by more than the force allows.
TEST(FrictionRig, SeveralSolutions_TheMotionIsContinued) {
  const auto text = [](double bias, double v) {
    return R"({"law": "coulomb", "mass": 1.0, "params": {"F_C": 1.0, "F_S": 2.0, "v_s": 0.004, "delta": 2},
 "initial": {"v": )" +
           std::to_string(v) + R"(}, "input": {"kind": "bias_sine_force", "bias": )" + std::to_string(bias) +
           R"(, "amp": 0, "freq": 1}, "columns": ["t", "v", "F"], "T": 1,
 "output_times": [0, 0.02, 0.04, 0.06, 0.08, 0.1]})";
  };
  const double h = 0.02;
  for (const double bias : {2.005, 2.5}) {
    const Outcome out = run(file("start.json", text(bias, 0)), {"--step", "0.02"});
    const std::vector<double> v = out.rows.column("v"), f = out.rows.column("F");
    for (size_t i = 1; i < v.size(); ++i) {
      EXPECT_NEAR((v[i] - v[i - 1]) / h, bias - f[i], 1e-9);
      EXPECT_NEAR(f[i], 1 + std::exp(-v[i] * v[i] / 1.6e-5), 1e-9);
    }
    // The first step has three solutions: 1.17e-4 and 6.8e-4 m/s where the curve falls, 0.0201 m/s beyond it.
    if (bias == 2.005) {
      EXPECT_NEAR(v[1], 1.17e-4, 1e-6);
    }
  }
  const std::vector<double> slides =
      run(file("slide.json", text(0.9, 0.05)), {"--step", "0.02"}).rows.column("v");
  EXPECT_NEAR(slides[1], 0.048, 1e-6);
}

TEST(FrictionRig, SpringOfAnyStiffness_StaysBounded) {
  const std::string text =
      R"({"law": "coulomb", "mass": 1.0, "params": {"mu": 0.5},
 "input": {"kind": "spring_pull", "k": 1e10, "V": 0.1},
 "columns": ["t", "x", "v"], "output_times": [0, 0.5, 1]})";
  const Outcome out = run(file("stiff.json", text), {"--step", "0.01"});
  EXPECT_NEAR(out.rows.column("x").back(), 0.1, 2e-3);
  EXPECT_LT(out.figure("v_max"), 0.3);
}

// The table of libdeform/doc/laws/choosing.md; gms has its period of 6.554 s at half of the step taken here.
struct SideBySide {
  const char *law;
  double drift, breakaway[3], loop, period;
};
class FrictionLaws : public testing::TestWithParam<SideBySide> {};
TEST_P(FrictionLaws, SideBySide_ShowWhatThePageSays) {
  const SideBySide &row = GetParam();
  const std::vector<double> x = run(example("rig_below"), {"--law", row.law}).rows.column("x");
  EXPECT_NEAR(x[500] - x[400], row.drift, 5e-7);  // the last of five cycles
  const std::vector<double> peak = run(example("breakaway"), {"--law", row.law}).rows.column("F_ba");
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(peak[k], row.breakaway[k], 6e-4);
  const std::vector<double> f = run(example("loops"), {"--law", row.law, "--step", "1e-3"}).rows.column("F");
  // the same place before and after the inner loop
  EXPECT_NEAR(f[60] - f[20], row.loop, 6e-4);
  EXPECT_NEAR(run(example("pulled"), {"--law", row.law, "--step", "2e-4"}).figure("period"), row.period,
              1e-3);
}
INSTANTIATE_TEST_SUITE_P(All, FrictionLaws,
                         testing::Values(SideBySide{"coulomb", 0, {1.5, 1.5, 1.5}, 0, 6.512},
                                         SideBySide{"karnopp", 0, {1.5, 1.5, 1.5}, 0, 6.517},
                                         SideBySide{"dahl", 5.195e-5, {1, 1, 1}, -0.356, 4.443},
                                         SideBySide{"lugre", 3.366e-5, {1.432, 1.211, 1}, -0.425, 6.362},
                                         SideBySide{"elastoplastic", 0, {1.443, 1.310, 1}, -0.129, 6.376},
                                         SideBySide{"gms", 0, {1.500, 1.392, 1.014}, 0, 6.556}),
                         [](const auto &each) { return std::string(each.param.law); });
