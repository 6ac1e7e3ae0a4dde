// Dampers of Fig. 2.5: Voigt, Maxwell and the standard linear solid against their closed forms, on one spring
// and on a bar; what a branch stores and loses; its state; the step bound with it.
#include "msm_host.h"

namespace msm_test {
namespace {

enum { kVoigt, kMaxwell, kSls };
Params viscous(int damper, double time, double ratio = 1) {
  Params p = {1e5, 0.3, 0, 0, 0};
  p.damper = damper;
  p.time = time;
  p.ratio = ratio;
  return p;
}

// The spring from point 0 to point 1 of a cell of unit edges, k = 50 N/m, without mass: its length is what
// the pull of a step asks for.
struct OneSpring : Instance {
  static constexpr double k = 50;
  OneSpring(Host &lent, Params p) : Instance(lent, regular_tet(), stiff(p)) { mask({1, 2, 3, 4, 5}, false); }
  static Params stiff(Params p) {
    p.young = k / regular_tet().volume(0);
    return p;
  }
  double pull_at(double stretch) {
    set(x, 1, {1 + stretch, 0, 0});
    forces();
    return get(f, 0)[0];
  }
  double stretch_under(double force) {  // the pull is linear in the stretch
    const double at_rest = pull_at(0), slope = pull_at(1) - at_rest;
    return (force - at_rest) / slope;
  }
  void step_at(double stretch, double h) {
    set(x, 1, {1 + stretch, 0, 0});
    dt = h;
    forces_and_step();
  }
};

TEST(MsmDamper, MaxwellUnderConstantLoad_FlowsByTheClosedFormAtAnyStep) {
  for (double h : {1e-9, 1e-4, 0.03, 1.0, 1e4}) {
    Host host;
    OneSpring b(host, viscous(kMaxwell, 0.2));
    const double force = 3, c = 0.2 * OneSpring::k;
    for (int n = 0; n <= 50; ++n) {
      const double stretch = b.stretch_under(force), exact = force / OneSpring::k + force * (n * h) / c;
      // Steps far longer than the relaxation time leave little of a stretch in the pull: its rounding counts
      // h/tau times, each step.
      ASSERT_NEAR(stretch / exact, 1, 1e-12 + 4e-16 * n * h / 0.2) << h << " " << n;
      b.step_at(stretch, h);
    }
  }
}

TEST(MsmDamper, StandardLinearSolidUnderConstantLoad_CreepsByTheClosedFormToSecondOrder) {
  const double force = 3, r = 0.7, tau = 0.2, end = 0.5;
  double worst[2];
  for (int k = 0; k < 2; ++k) {
    Host host;
    OneSpring b(host, viscous(kSls, tau, r));
    const int steps = 100 << k;
    worst[k] = 0;
    for (int n = 0; n <= steps; ++n) {
      const double t = end * n / steps, stretch = b.stretch_under(force);
      const double exact = force / OneSpring::k * (1 - r / (1 + r) * std::exp(-t / (tau * (1 + r))));
      worst[k] = std::max(worst[k], std::abs(stretch / exact - 1));
      b.step_at(stretch, end / steps);
    }
  }
  EXPECT_LT(worst[0], 1e-5);
  EXPECT_NEAR(worst[0] / worst[1], 4, 0.2);
}

TEST(MsmDamper, VoigtOnItsClosedForm_CarriesTheConstantLoad) {
  Host host;
  Params p;
  p.damping_stiffness = 0.008;
  OneSpring b(host, p);
  const double force = 3, k = OneSpring::k, c = 0.008 * k;
  for (double t : {0.0, 1e-3, 0.01, 0.1}) {
    b.set(b.x, 1, {1 + force / k * (1 - std::exp(-k * t / c)), 0, 0});
    b.set(b.v, 1, {force / c * std::exp(-k * t / c), 0, 0});
    b.forces();
    EXPECT_NEAR(b.get(b.f, 0)[0], force, 1e-12) << t;
  }
}

TEST(MsmDamper, HeldStretch_RelaxesByTheExponentialAtAnyStep) {
  for (int damper : {kMaxwell, kSls})
    for (double h : {1e-7, 1e-3, 0.05, 3.0, 1e6}) {
      Host host;
      const double r = 2.5, tau = 0.1, stretch = 0.3, k = OneSpring::k;
      OneSpring b(host, viscous(damper, tau, r));
      for (int n = 0; n < 30; ++n) {
        const double branch = std::exp(-n * h / tau);
        const double exact = k * stretch * (damper == kMaxwell ? branch : 1 + r * branch);
        ASSERT_NEAR(b.pull_at(stretch), exact, 1e-12 * k) << h << " " << n;
        const double energy =
            0.5 * k * stretch * stretch * (damper == kMaxwell ? branch * branch : 1 + r * branch * branch);
        ASSERT_NEAR(b.energy(), energy, 1e-12 * k);
        b.step_at(stretch, h);
      }
    }
}

// Static answer of a body held at x = 0 to a small load, with the branches as they stand: conjugate gradients
// on differences of forces.
std::vector<double> settle(Instance &b, const std::vector<double> &load) {
  const size_t n = load.size();
  std::vector<double> u(n, 0), r(n), p, q(n);
  const auto forces_at = [&](const std::vector<double> &w) {
    for (size_t i = 0; i < n; ++i) b.x[4 * (i / 3) + i % 3] = b.mesh.rest[i] + w[i];
    b.forces();
    std::vector<double> f(n);
    for (size_t i = 0; i < n; ++i) f[i] = b.mesh.rest[3 * (i / 3)] < 1e-9 ? 0 : b.f[4 * (i / 3) + i % 3];
    return f;
  };
  const std::vector<double> f0 = forces_at(u);
  double rr = 0;
  for (size_t i = 0; i < n; ++i) {
    r[i] = b.mesh.rest[3 * (i / 3)] < 1e-9 ? 0 : load[i] + f0[i];
    rr += r[i] * r[i];
  }
  p = r;
  for (const double start = rr; rr > 1e-22 * start;) {
    double most = 0, pq = 0, next = 0;
    for (double a : p) most = std::max(most, std::abs(a));
    const double step = 1e-7 / most;
    std::vector<double> probe(n);
    for (size_t i = 0; i < n; ++i) probe[i] = step * p[i];
    const std::vector<double> f1 = forces_at(probe);
    for (double &a : probe) a = -a;
    const std::vector<double> f2 = forces_at(probe);
    for (size_t i = 0; i < n; ++i) {
      q[i] = (f2[i] - f1[i]) / (2 * step);
      pq += p[i] * q[i];
    }
    for (size_t i = 0; i < n; ++i) {
      u[i] += rr / pq * p[i];
      r[i] -= rr / pq * q[i];
      next += r[i] * r[i];
    }
    for (size_t i = 0; i < n; ++i) p[i] = r[i] + next / rr * p[i];
    rr = next;
  }
  return u;
}

TEST(MsmDamper, BarUnderEndLoad_CreepsAsItsSprings) {
  // One relaxation time everywhere: the bar's answer is the elastic one times the creep of a spring
  // (correspondence principle).
  const Mesh mesh = kuhn_bar(5, 1, 1, 0.1);
  std::vector<double> load(3 * mesh.npoint(), 0);
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    if (mesh.at(i)[0] > 0.45) {
      load[3 * i] = 2e-6;
      load[3 * i + 2] = 1e-6;  // so small that the bar stays linear
    }
  Host host;
  Instance elastic(host, mesh, viscous(kVoigt, 1));
  const std::vector<double> still = settle(elastic, load);
  const uint32_t tip = mesh.npoint() - 1;
  const double r = 1.5, tau = 0.2, h = 0.01;
  for (int damper : {kMaxwell, kSls}) {
    Instance b(host, mesh, viscous(damper, tau, r));
    for (int n = 0; n <= 30; ++n) {
      const std::vector<double> u = settle(b, load);
      const double t = n * h;
      const double creep =
          damper == kMaxwell ? 1 + t / tau : 1 - r / (1 + r) * std::exp(-t / (tau * (1 + r)));
      for (int a : {0, 2})
        ASSERT_NEAR(u[3 * tip + a] / still[3 * tip + a], creep, 2e-4 * creep) << damper << " " << n;
      for (size_t i = 0; i < u.size(); ++i) b.x[4 * (i / 3) + i % 3] = mesh.rest[i] + u[i];
      b.dt = h;
      b.forces_and_step();
    }
  }
}

Params full(int damper) {
  Params p = viscous(damper, 0.01, 1.5);
  p.damping_stiffness = 0.001;
  p.volume = 1;
  p.slope = 1;
  p.axis = {0, 1, 2};
  return p;
}
void pull_dashpots(Instance &b) {  // some state that is not rest
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-0.01, 0.01);
  for (size_t e = 0; e + 1 < b.state.size(); ++e) b.state[e] = u(random);
}

TEST(MsmDamper, AnyState_KeepsMomentumAndAngularMomentum) {
  Host host;
  for (int damper : {kMaxwell, kSls}) {
    Instance b(host, kuhn_bar(5, 4, 3, 0.1, 0.2), full(damper));
    b.shake(0.02, 3);
    pull_dashpots(b);
    b.state.back() = 0.6;
    b.forces();
    expect_no_force_or_torque(b, damper == kSls ? "sls" : "maxwell");
  }
}

TEST(MsmDamper, ForceAtFixedDashpots_IsMinusTheGradientOfTheEnergy) {
  Host host;
  for (int damper : {kMaxwell, kSls})
    for (double amount : {1e-4, 1e-3, 1e-2}) {
      Params p = full(damper);
      p.damping_stiffness = 0;
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
      b.shake(amount, 0);
      pull_dashpots(b);  // kept = 1: the branch's stretch follows the spring, its dashpot stands
      expect_force_is_gradient(b, 1e-6, 1e-6, "amount " + std::to_string(amount));
    }
}

double total(const Instance &b) {
  double e = b.energy();
  for (uint32_t i = 0; i < b.size(); ++i) e += 0.5 * b.mesh.mass[i] * dot(b.get(b.v, i), b.get(b.v, i));
  return e;
}
void advance(Instance &b, double h) {
  b.dt = h;
  b.forces_and_step();
  b.move(h);
}

TEST(MsmDamper, FreeMotion_LosesEnergyAtAnyRelaxationTime) {
  for (int damper : {kMaxwell, kSls})
    for (double over : {0.01, 1.0, 30.0}) {  // step over relaxation time
      Host host;
      Params p = viscous(damper, 1, 1.5);
      p.slope = 1;
      {
        Instance probe(host, kuhn_bar(4, 2, 2, 0.1, 0.2), p);
        p.time = 0.1 * probe.bound() / over;
      }
      Instance b(host, kuhn_bar(4, 2, 2, 0.1, 0.2), p);
      b.shake(0.01, 1);
      const double start = total(b), h = 0.1 * b.bound();
      for (int n = 0; n < 3000; ++n) {
        advance(b, h);
        // the symplectic ripple of a step
        ASSERT_LT(total(b), 1.02 * start) << damper << " " << over << " " << n;
      }
      EXPECT_LT(total(b), 0.7 * start) << damper << " " << over;
    }
}

// Small free vibration at a share of the bound: how fast it went over how fast it began. (A
// fluid may go far.)
double growth(const Params &p, double share, int steps, double time_over_step) {
  Host host;
  Params q = p;
  double h;
  {
    Instance probe(host, kuhn_bar(4, 2, 2, 0.1, 0.2), p);
    h = share * probe.bound();
  }
  q.time = time_over_step * h;
  Instance b(host, kuhn_bar(4, 2, 2, 0.1, 0.2), q);
  b.shake(1e-9, 0);
  double first = 0, most = 0;
  for (int n = 0; n < steps; ++n) {
    advance(b, h);
    double speed = 0;
    for (uint32_t i = 0; i < b.size(); ++i) speed = std::max(speed, norm(b.get(b.v, i)));
    if (!(speed < 1e6)) return 1e300;
    if (n < 10) first = std::max(first, speed);
    most = std::max(most, speed);
  }
  return most / first;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmDamper, StepBound_HoldsForEveryRelaxationTimeAndIsNoWasteForLongOnes) {
  for (int damper : {kMaxwell, kSls})
    for (double damping : {0.0, 0.002}) {
      Params p = viscous(damper, 1, 1.5);
      p.damping_stiffness = damping;
      p.volume = 0.5;
      p.slope = 1;
      for (double time_over_step : {1e-3, 0.1, 1.0, 10.0, 1e4})
        EXPECT_LT(growth(p, 0.99, 6000, time_over_step), 20) << damper << " " << time_over_step;
      // slow dashpots: the branch is a spring, and the bound near the truth
      EXPECT_GT(growth(p, 3, 1000, 1e4), 1e3) << damper;
    }
}

TEST(MsmDamper, Rows_AreThoseOfTheSpringWithTheSameForces) {
  // With its dashpot drawn out by q the element is a spring whose rest length is longer by its share of q: in
  // tension rows follow.
  Host host;
  Instance sls(host, regular_tet(), viscous(kSls, 0.1, 1)), plain(host, regular_tet(), {2e5});
  for (uint32_t i = 0; i < 4; ++i) {
    sls.set(sls.x, i, 1.4 * sls.mesh.at(i));
    plain.set(plain.x, i, 1.4 / 1.1 * plain.mesh.at(i));
  }
  for (size_t e = 0; e < 6; ++e) sls.state[e] = -0.2;  // half of it counts: rest length 1.1
  std::vector<double> a, b;
  sls.bound(&a);
  plain.bound(&b);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a[i] / b[i], 1, 1e-12);
}

TEST(MsmDamper, InstructionSetAndCut_NeverShowInForcesOrState) {
  const Mesh mesh = kuhn_bar(30, 9, 8, 0.05, 0.2);
  for (int damper : {kMaxwell, kSls}) {
    std::vector<double> first;
    for (const char *simd : {"sse2", "avx2", "avx512", "cut"}) {
      Host host;
      if (!std::strcmp(simd, "cut")) host.shuffle = 7;
      else setenv("DEFORM_SIMD", simd, 1);
      Instance b(host, mesh, full(damper));
      unsetenv("DEFORM_SIMD");
      if (!host.logged.empty()) continue;  // not on this processor
      b.shake(0.004, 2);
      pull_dashpots(b);
      b.forces_and_step();
      b.forces_and_step();
      std::vector<double> all(b.f, b.f + 4 * b.size()), k;
      all.insert(all.end(), b.state.begin(), b.state.end());
      all.push_back(b.energy());
      all.push_back(b.bound(&k));
      all.insert(all.end(), k.begin(), k.end());
      if (first.empty()) first = all;
      EXPECT_TRUE(first.size() == all.size() &&
                  !std::memcmp(first.data(), all.data(), all.size() * sizeof(double)))
          << simd;
    }
  }
}

TEST(MsmDamper, Voigt_HasNoStateAndCostsNoByte) {
  Host plain_host, host;
  const Mesh mesh = kuhn_bar(5, 3, 2, 0.1, 0.2);
  Instance a(plain_host, mesh, {1e5}), b(host, mesh, viscous(kVoigt, 0.5, 3));
  EXPECT_EQ(host.live, plain_host.live);
  EXPECT_TRUE(b.state.empty());
  a.shake(0.01, 1);
  b.shake(0.01, 1);
  a.forces();
  b.forces();
  EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
  Instance sls(host, mesh, viscous(kSls, 0.5, 3));
  EXPECT_EQ(sls.state.size(), mesh.edges.size() / 2 + 1);
}

TEST(MsmDamper, HostWithoutTheExtension_GetsTheNameOfTheExtension) {
  Host host;
  Instance b(host, irregular_tet(), viscous(kMaxwell, 1));
  b.state.clear();
  const dfm_kin k = b.kin();
  EXPECT_EQ(b.ops->add_forces(b.self, &k, b.f), DFM_E_STATE);
  EXPECT_NE(host.logged.find(DFM_EXT_SLOTS), std::string::npos);
}

TEST(MsmDamper, PureQuery_LeavesTheStateAlone) {
  Host host;
  Instance b(host, irregular_tet(), full(kSls));
  b.shake(0.02, 1);
  pull_dashpots(b);
  const std::vector<double> before = b.state;
  b.forces();
  const std::vector<double> f(b.f, b.f + 16);
  b.energy();
  b.bound();
  b.forces();
  EXPECT_EQ(b.state, before);
  EXPECT_EQ(f, std::vector<double>(b.f, b.f + 16));
}

}  // namespace
}  // namespace msm_test
