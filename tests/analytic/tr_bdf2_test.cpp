// TR-BDF2 without contact: its stability function, order, energy and momentum. With contact it is backward
// Euler, which implicit_test.cpp and rest_compression_test.cpp run by both integrators. Source:
// doc/concepts/implicit.md.
#include <complex>

#include "world.h"

namespace {

constexpr double kFrame = 1.0 / 60;
constexpr int32_t kScheme = DFM_INTEGRATOR_TR_BDF2;

using test::State;

// Of y' = i hw y over a step of one: the trapezoidal rule to 2 - sqrt 2, then the second backward difference.
double amplification(double hw) {
  const double g = 2 - std::sqrt(2.0), d = g / 2, ahead = 1 / (g * (2 - g));
  const std::complex<double> z(0, hw), middle = (1.0 + d * z) / (1.0 - d * z);
  return std::abs((ahead * middle - (ahead - 1)) / (1.0 - d * z));
}

// A bar that is held at one end and falls. shaken: that end moves, and gravity and a load on the other vary.
State fallen(const char *model, bool shaken, int32_t integrator, double seconds, double h) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -9.81}, integrator);
  test::BodyOptions o;
  o.model = model;
  o.damping_stiffness = 1e-3;
  const dfm_body b = test::make_body(context, w, "beam", {0.4, 0.1, 0.1}, 60, o);
  const State start = State(b);
  std::vector<uint32_t> held, loaded;
  for (uint32_t i = 0; i < start.x.size() / 3; ++i) {
    if (start.x[3 * size_t{i}] < 1e-9) held.push_back(i);
    if (start.x[3 * size_t{i}] > 0.4 - 1e-9) loaded.push_back(i);
  }
  test::ok(dfm_body_hold(b, uint32_t(held.size()), held.data(), 7));
  if (shaken) {
    const dfm_sine motion{{0, 0.01, 0}, 10, 0}, scale{{0.8, 0, 0}, 15, 0};
    test::ok(dfm_body_move_held(b, uint32_t(held.size()), held.data(), 0, nullptr, &motion));
    const std::vector<double> force(3 * loaded.size(), 0.5);
    test::ok(dfm_body_add_load(b, uint32_t(loaded.size()), loaded.data(), force.data(), 0, nullptr, &scale,
                               nullptr));
    const dfm_vector_key keys[2] = {{0, {0, 0, -9.81}}, {1, {50, 0, 0}}};
    test::ok(dfm_world_set_gravity_keys(w, 2, keys));
  }
  test::run(w, seconds, h);
  State end = State(b);
  for (const uint32_t i : held)  // have the mean velocity of the last sub-step
    for (size_t k = 0; k < 3; ++k) end.v[3 * size_t{i} + k] = 0;
  return end;
}

double distance(const std::vector<double> &a, const std::vector<double> &b) {
  double sum = 0;
  for (size_t j = 0; j < a.size(); ++j) sum += (a[j] - b[j]) * (a[j] - b[j]);
  return std::sqrt(sum / double(a.size() / 3));
}

}  // namespace

// One cell with three points held: the fourth, of a quarter of the mass, has the frequency 2/L sqrt((lambda +
// 2 mu)/rho) along the edge that leads to it.
TEST(TrBdf2, Oscillator_KeepsTheAmplitudeOfItsStabilityFunction) {
  for (const double hw : {0.1, 1.0, 10.0, 1e3}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0}, kScheme);
    test::Tet tet("one");
    test::BodyOptions o;
    const uint8_t held[4] = {7, 0, 7, 7};
    tet.def.model = "linear_fem";
    tet.def.material = test::make_material(w, o);
    tet.def.fixed = held;
    dfm_body b = 0;
    test::ok(dfm_body_create(w, &tet.def, &b));
    const double stiff = o.young * (1 - o.poisson) / ((1 + o.poisson) * (1 - 2 * o.poisson));
    const double frequency = 2 / 0.1 * std::sqrt(stiff / o.density);
    State s = State(b);
    s.x[3] += 1e-3;
    test::ok(dfm_body_set_state(b, 4, s.x.data(), s.v.data()));
    double last = 1e-3;
    for (int step = 0; step < 3; ++step) {
      test::run(w, hw / frequency, hw / frequency);
      s = State(b);
      const double amplitude = std::hypot(s.x[3] - 0.1, s.v[3] / frequency);
      EXPECT_NEAR(amplitude / last, amplification(hw), 1e-6) << "h w " << hw << ", step " << step;
      EXPECT_LT(amplitude, last) << "h w " << hw;
      last = amplitude;
    }
  }
}

TEST(TrBdf2, HalvedStep_QuartersTheError) {
  const double seconds = 0.032, coarse = 2e-3;
  struct Way {
    const char *model;
    bool shaken;
  };
  for (const auto [model, shaken] :
       {Way{"msm", false}, {"corotational_fem", false}, {"linear_fem", false}, {"corotational_fem", true}}) {
    const State truth = fallen(model, shaken, kScheme, seconds, coarse / 128);
    const State other = fallen(model, shaken, DFM_INTEGRATOR_SYMPLECTIC_EULER, seconds, coarse / 128);
    EXPECT_LT(distance(other.x, truth.x), 3e-6) << model;  // its own error
    double x = 0, v = 0;
    for (int k = 0; k <= 4; ++k) {
      const State s = fallen(model, shaken, kScheme, seconds, coarse / (1 << k));
      const double dx = distance(s.x, truth.x), dv = distance(s.v, truth.v);
      if (k) {
        EXPECT_NEAR(std::log2(x / dx), 2, 0.1) << model << ", step " << coarse / (1 << k);
        EXPECT_NEAR(std::log2(v / dv), 2, 0.1) << model << ", step " << coarse / (1 << k);
      }
      x = dx;
      v = dv;
    }
  }
}

// What turns has an energy that the scheme neither keeps nor only lowers; it stays below that of the start.
TEST(TrBdf2, FreeBarThatTurns_GainsNoEnergyAndKeepsItsMomentum) {
  for (const char *model : {"msm", "corotational_fem"})
    for (const double young : {1e5, 1e7, 1e9})
      for (const double h : {1e-3, kFrame}) {
        const std::string what =
            std::string(model) + ", E " + std::to_string(young) + " Pa, step " + std::to_string(h) + " s";
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0}, kScheme);
        test::BodyOptions o;
        o.model = model;
        o.young = young;
        o.spin = {0, 5, 1};
        o.velocity = {0.3, -0.2, 1};
        const dfm_body b = test::make_body(context, w, "beam", {0.4, 0.1, 0.1}, 60, o);
        const auto energy = [&] { return test::measure(b).kinetic + test::measure(b).elastic; };
        const dfm_body_measure start = test::measure(b);
        const double first = energy();
        for (int step = 0; step < 100; ++step) {
          test::run(w, h, h);
          EXPECT_LE(energy(), first * (1 + 1e-6)) << what;
        }
        EXPECT_GT(energy(), 0.998 * first) << what;
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(test::measure(b).momentum[k], start.momentum[k], 1e-12) << what;
      }
}

// The bar of tests/stability/suite/spin_1000rpm.json, half a second.
TEST(TrBdf2, BarAt1000Rpm_KeepsMoreOfItsSpinThanByBackwardEuler) {
  const auto kept = [](int32_t integrator, double h) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0}, integrator);
    test::BodyOptions o;
    o.model = "corotational_fem";
    o.young = 1e7;
    o.spin = {0, 0, 104.72};
    const dfm_body b = test::make_body(context, w, "beam", {0.2, 0.05, 0.05}, 60, o);
    const double before = test::measure(b).angular[2];
    test::run(w, 0.5, h);
    return test::measure(b).angular[2] / before;
  };
  const double coarse = kept(kScheme, kFrame), fine = kept(kScheme, 1e-3);
  const double euler = kept(DFM_INTEGRATOR_IMPLICIT_EULER, kFrame);
  const double euler_fine = kept(DFM_INTEGRATOR_IMPLICIT_EULER, 1e-3);
  EXPECT_NEAR(coarse, 0.45, 0.02);
  EXPECT_GT(coarse, 4 * euler);
  EXPECT_NEAR(fine, 0.998, 0.001);
  EXPECT_GT(fine, 3 * euler_fine);
}

namespace {

// A cube that moves down at 2 m/s and touches the floor in its first step.
struct Landing {
  dfm_world world = 0;
  dfm_body cube = 0;
  Landing(dfm_context *context, int32_t integrator, double young, double h) {
    world = test::make_world(context, {0, 0, 0}, integrator);
    test::BodyOptions o;
    o.young = young;
    o.position = {0, 0, 0.3 * 2 * h};
    o.velocity = {0, 0, -2};
    cube = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
  }
};

}  // namespace

// Impulses of the second stage alone would have to undo the way of the first, and give back 2.4 times the
// speed; a sub-step in which a body touches is taken by backward Euler, the first one too.
TEST(TrBdf2, CubeThatLands_MovesByBackwardEulerAndGainsNoEnergy) {
  for (const double young : {1e5, 1e9})
    for (const double h : {1e-3, kFrame}) {
      const std::string what = "E " + std::to_string(young) + " Pa, step " + std::to_string(h) + " s";
      test::Context context;
      const Landing one(context, kScheme, young, h), other(context, DFM_INTEGRATOR_IMPLICIT_EULER, young, h);
      double last = test::measure(one.cube).kinetic;
      for (int step = 0; step * h < 0.1; ++step) {
        test::run(one.world, h, h);
        test::run(other.world, h, h);
        if (step < 2) {
          EXPECT_EQ(dfm_world_hash(one.world), dfm_world_hash(other.world)) << what;
        }
        const dfm_body_measure m = test::measure(one.cube);
        // at the end the energy is that of velocities within the tolerance of contact
        constexpr double kTolerance = 1e-6;  // m/s
        EXPECT_LE(m.kinetic + m.elastic, last * (1 + 1e-6) + 0.5 * m.mass * kTolerance * kTolerance) << what;
        last = m.kinetic + m.elastic;
      }
      EXPECT_GT(test::measure(one.cube).momentum[2], -1e-6) << what;
    }
}

// A body whose integrator nobody names must swing: by backward Euler this bar hangs still after one period.
// Undamped, so what is lost is the scheme's own; 19 steps are a period.
TEST(TrBdf2, BarLeftToAuto_StillSwingsAfterFivePeriods) {
  for (const char *model : {"msm", "linear_fem", "corotational_fem"}) {
    test::Context context;
    dfm_world_def d = dfm_world_def_default();
    d.gravity[2] = -9.81;
    d.step = kFrame;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &d, &w));
    test::BodyOptions o;
    o.model = model;
    o.young = 2e7;
    const dfm_body bar = test::make_body(context, w, "beam", {0.4, 0.02, 0.02}, 200, o);
    const State start = State(bar);
    std::vector<uint32_t> held;
    uint32_t tip = 0;
    for (uint32_t i = 0; i < start.x.size() / 3; ++i) {
      if (start.x[3 * size_t{i}] < 1e-9) held.push_back(i);
      if (start.x[3 * size_t{i}] > start.x[3 * size_t{tip}]) tip = i;
    }
    test::ok(dfm_body_hold(bar, uint32_t(held.size()), held.data(), 7));
    std::vector<double> z;  // of the tip, after each step
    for (int step = 0; step < 120; ++step) {
      test::run(w, kFrame, kFrame);
      z.push_back(State(bar).x[3 * size_t{tip} + 2]);
    }
    dfm_world_stats stats = {};
    stats.size = sizeof stats;
    test::ok(dfm_world_get_stats(w, &stats));
    EXPECT_EQ(stats.substeps, 120u) << model << ": explicit time would take more";
    const auto swing = [&](size_t from, size_t to) {
      const auto [low, high] = std::minmax_element(z.begin() + long(from), z.begin() + long(to));
      return *high - *low;
    };
    EXPECT_GT(swing(0, 24), 0.02) << model;
    EXPECT_GT(swing(96, 120), 0.8 * swing(0, 24)) << model;
  }
}
