// Plastic cells of org.deform.corotational_fem: elastic below yield, forces as the gradient of the potential
// of the step, the flow in closed form, its limit and its rate, dissipation, the tangent.
#include "corot_host.h"
#include "model_tangent.h"

namespace corot_test {
namespace {

constexpr double kYoung = 1e5, kYield = 2e3, kHardening = 3e4, kDt = 1e-3;

Params soft(Params more = {}) {
  Params p = {{"young", {kYoung}}, {"poisson", {0.3}}, {"yield", {kYield}}};
  for (const auto &[key, value] : more) p[key] = value;
  return p;
}
void stretch(Instance &b, Vec by) {
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, rotate({by[0] * x[0], by[1] * x[1], by[2] * x[2]}, {0, 0.6, 0.8}, 1.1));
  }
}
double mises(const double *s) {
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}
double largest_length(const Instance &b) {
  double most = 0;
  for (size_t n = 6; n < b.state.size(); n += 7) most = std::max(most, b.state[n]);
  return most;
}

const std::vector<Params> &kinds() {
  static const std::vector<Params> all = {soft(),
                                          soft({{"hardening", {kHardening}}}),
                                          soft({{"creep", {300}}, {"hardening", {kHardening}}}),
                                          soft({{"plastic_limit", {0.05}}}),
                                          soft({{"creep", {300}}, {"plastic_limit", {0.05}}}),
                                          soft({{"locking", {1}}, {"poisson", {0.45}}}),
                                          soft({{"damping_stiffness", {0.01}}})};
  return all;
}

TEST(CorotPlastic, BelowYield_IsTheElasticBodyBitForBit) {
  Host host;
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1, 0.2);
  const Params elastic = {{"young", {kYoung}}, {"damping_stiffness", {1e-3}}};
  Params strong = elastic;
  strong["yield"] = {1e9};
  Instance a(host, mesh, elastic), b(host, mesh, strong);
  for (Instance *i : {&a, &b}) {
    i->shake(0.01, 1);
    for (int n = 0; n < 50; ++n) {
      i->forces_and_step();
      i->move(1e-4);
    }
  }
  for (size_t n = 0; n < 4 * a.size(); ++n) EXPECT_EQ(a.x[n], b.x[n]) << n;
  EXPECT_EQ(a.energy(), b.energy());
  EXPECT_EQ(a.bound(), b.bound());
  EXPECT_EQ(largest_length(b), 0);
}

TEST(CorotPlastic, Force_IsTheGradientOfThePotentialOfTheStep) {
  for (const Params &p : kinds()) {
    Host host;
    Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
    b.work(0.01);
    EXPECT_GT(largest_length(b), 0);
    b.shake(0.01, 0, 9);
    expect_force_is_gradient(b, 1e-7, 1e-5, p.rbegin()->first);
    EXPECT_NEAR(energy_of_cells(b), b.energy(), 1e-12 * b.energy());
    b.shake(0, 1);
    b.forces();
    expect_no_force_or_torque(b, p.rbegin()->first);
  }
}

// What a commit takes from the energy has dissipated; at rest in its new state the body keeps what it has.
TEST(CorotPlastic, Commit_NeverRaisesTheEnergy) {
  for (const Params &p : kinds()) {
    Host host;
    Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
    const bool creeps = p.count("creep");
    double dissipated = 0;
    for (unsigned seed = 1; seed < 20; ++seed) {
      b.shake(0.004, 0, seed);
      const double before = b.energy();
      b.forces_and_step();
      const double after = b.energy();
      EXPECT_LE(after, before * (1 + 1e-12)) << seed;
      dissipated += before - after;
      b.forces_and_step();
      if (!creeps) {
        EXPECT_NEAR(b.energy(), after, 1e-9 * before);
      }
    }
    EXPECT_GT(dissipated, 0.01 * b.energy());
  }
}

// Isochoric to first order: the stress in the frame is 2 mu (dev e - p).
TEST(CorotPlastic, HeldStrain_FlowsToTheYieldSurfaceWithHardening) {
  Host host;
  Instance b(host, kuhn_bar(2, 2, 2, 0.1), soft({{"hardening", {kHardening}}}));
  stretch(b, {1.1, 0.95, 0.95});
  b.forces_and_step();
  const double mu = kYoung / 2.6, trial = 2 * mu * std::sqrt(1.5 * (0.01 + 2 * 0.0025));
  const double length = (trial - kYield) / (3 * mu + kHardening);
  for (size_t n = 0; n < b.state.size(); n += 7) {
    EXPECT_NEAR(b.state[n + 6], length, 1e-12);
    EXPECT_NEAR(b.state[n] + b.state[n + 1] + b.state[n + 2], 0, 1e-14);
  }
  // Cauchy's stress in the axes of the stretches
  const double part = 1 - 3 * mu * length / trial, volume = 1.1 * 0.95 * 0.95;
  const double along = 2 * mu * 0.1 * part * 1.1 / volume, across = -2 * mu * 0.05 * part * 0.95 / volume;
  const std::vector<double> stress = stress_of_cells(b);
  for (size_t n = 0; n < stress.size(); n += 6) EXPECT_NEAR(mises(&stress[n]), along - across, 1e-9 * kYoung);
}

TEST(CorotPlastic, HeldStrain_RelaxesInTheTimeOfCreepAtAnyStep) {
  for (const double dt : {1e-3, 1e-2}) {
    Host host;
    Instance b(host, regular_tet(), soft({{"creep", {20}}}));
    b.dt = dt;
    stretch(b, {1.1, 0.95, 0.95});
    for (int n = 0; n < std::lround(0.05 / dt); ++n) b.forces_and_step();
    const double mu = kYoung / 2.6, trial = 2 * mu * std::sqrt(1.5 * (0.01 + 2 * 0.0025));
    EXPECT_NEAR(b.state[6], (trial - kYield) / (3 * mu) * (1 - std::exp(-1.0)), 1e-12) << dt;
  }
}

TEST(CorotPlastic, Limit_EndsTheFlowAndLeavesTheRestElastic) {
  Host host;
  Instance b(host, regular_tet(), soft({{"plastic_limit", {0.02}}}));
  stretch(b, {1.1, 0.95, 0.95});
  b.forces_and_step();
  EXPECT_NEAR(b.state[6], 0.02, 1e-15);
  EXPECT_NEAR(b.state[0] * b.state[0] + b.state[1] * b.state[1] + b.state[2] * b.state[2], 1.5 * 4e-4, 1e-12);
  const std::vector<double> before = b.state;
  for (const double by : {1.2, 0.8, 1.0}) {
    stretch(b, {by, 1, 1});
    b.forces_and_step();
    EXPECT_EQ(b.state, before);
  }
}

// Small strain, where the turning of the axes is small against the moduli.
TEST(CorotPlastic, Tangent_IsThatOfTheFlow) {
  for (Params p : kinds())
    for (const double tangent_kind : {0.0, 1.0}) {
      Host host;
      p["yield"] = {1e-4 * kYield};
      p["tangent"] = {tangent_kind};
      p.erase("damping_stiffness");
      if (p.count("plastic_limit")) p["plastic_limit"] = {3e-6};
      Instance b(host, kuhn_bar(2, 2, 1, 0.1), p);
      b.work(1e-6);
      stretch(b, {1, 1, 1});
      b.shake(1e-6, 0, 11);
      const Dense k = tangent(b, 1, 0);
      EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-10)), 2e-3 * largest(k)) << p.rbegin()->first;
      Instance elastic(host, b.mesh, {{"young", p["young"]}, {"poisson", p["poisson"]}});
      std::copy(b.x, b.x + 4 * b.size(), elastic.x);
      if (!p.count("plastic_limit") && !p.count("locking")) {
        EXPECT_GT(largest_difference(k, tangent(elastic, 1, 0)), 0.03 * largest(k));
      }
    }
}

TEST(CorotPlastic, TangentOfEveryShape_IsNegativeSemidefiniteAndFinite) {
  for (Params p : kinds())
    for (const double tangent_kind : {0.0, 1.0})
      for (const double size : {1.0, 0.3, 0.0, -1.0, 10.0}) {
        Host host;
        p["tangent"] = {tangent_kind};
        Instance b(host, kuhn_bar(2, 2, 1, 0.1, 0.2), p);
        b.work(0.02);
        for (uint32_t i = 0; i < b.size(); ++i) {
          const Vec x = b.mesh.at(i);
          b.set(b.x, i, {size * x[0], x[1], std::sqrt(std::abs(size)) * x[2]});
        }
        if (size != 0) b.shake(0.03, 1);
        const Dense m = tangent(b, 1, 0.3);
        for (const double x : m.value) ASSERT_TRUE(std::isfinite(x)) << size;
        EXPECT_TRUE(below(m, 1e-10 * largest(m))) << size;
        b.forces_and_step();
        for (const double x : b.state) ASSERT_TRUE(std::isfinite(x)) << size;
      }
}

TEST(CorotPlastic, Refusals_GiveTheReason) {
  const auto refused = [](const Params &p, const char *word) {
    Host host;
    Instance b(host, regular_tet(), p);
    EXPECT_EQ(b.status, DFM_E_ARG) << word;
    EXPECT_NE(host.logged.find(word), std::string::npos) << host.logged;
  };
  refused(soft({{"energy", {1}}}), "yield excludes anisotropy and energies other than corotational");
  refused(soft({{"anisotropy_young", {1e6}}}),
          "yield excludes anisotropy and energies other than corotational");
  refused(soft({{"creep", {-0.5}}}), "creep");
  Host host;
  Instance elastic(host, regular_tet());
  const std::vector<double> values = Instance::row(soft());
  EXPECT_EQ(elastic.ops->set_params(elastic.self, values.data()), DFM_E_ARG);
  EXPECT_NE(host.logged.find("created without yield"), std::string::npos);
  Instance b(host, regular_tet(), soft());
  dfm_kin k = b.kin();
  k.state = nullptr;
  EXPECT_EQ(b.ops->add_forces(b.self, &k, b.f), DFM_E_STATE);
  // Yield may change, and end: then the plastic strain stays.
  stretch(b, {1.1, 0.95, 0.95});
  b.forces_and_step();
  const std::vector<double> before = b.state;
  b.set_params(soft({{"yield", {0}}}));
  stretch(b, {1.4, 0.8, 0.8});
  b.forces_and_step();
  EXPECT_EQ(b.state, before);
}

}  // namespace
}  // namespace corot_test
