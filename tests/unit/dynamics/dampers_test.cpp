// Dampers that see the velocity with a lag: the damping that they give, the energy that they keep, and what
// has no lag.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "../world/inside.h"
#include "obstacle.h"
#include "support.h"
#include "world.h"

namespace {

struct Bar {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0});
  dfm_body handle = 0;
  dfm::Body *body = nullptr;
  Bar(const std::string &model, double damping, double drag = 0, uint32_t cells = 3000) {
    test::BodyOptions o;
    o.model = model;
    o.damping_stiffness = damping;
    o.damping_mass = drag;
    handle = test::make_body(context, world, "beam", {0.2, 0.04, 0.04}, cells, o);
    body = test::inside(world).bodies[0].get();
  }
  void without_lag() const {
    body->p.dampers.lag = 0;
    body->p.dampers.v.clear();
    body->bound.known = false;
  }
  double stable() const {
    double h = 0;
    test::ok(dfm_world_stable_step(world, &h, nullptr, nullptr));
    return h;
  }
  // A stretch of all of it, 1/s.
  void stretch(double rate) const {
    dfm::Phyxels &p = body->p;
    for (size_t i = 0; i < p.n; ++i) p.v[4 * i] = rate * (p.x[4 * i] - 0.1);
    body->relax_dampers();
  }
  double momentum() const {  // along the stretch, kg m2/s
    double sum = 0;
    for (size_t i = 0; i < body->p.n; ++i)
      sum += body->p.mass[i] * body->p.v[4 * i] * (body->p.rest[3 * i] - 0.1);
    return sum;
  }
  // The peaks of one swing: s, and what is measured after each step.
  template <class Measure>
  std::vector<std::pair<double, double>> peaks_of(double h, const Measure &measure) const {
    std::vector<std::pair<double, double>> peaks;
    double last[3] = {measure(), 0, 0};
    for (uint32_t n = 1; peaks.size() < 3 && n < 100000; ++n) {
      test::ok(dfm_world_step(world, h, nullptr));
      last[2] = last[1];
      last[1] = last[0];
      last[0] = measure();
      if (n < 3) continue;
      const double a = last[2], b = last[1], c = last[0];  // a parabola through three
      if ((b - a) * (c - b) >= 0) continue;
      const double at = 0.5 * (a - c) / (a - 2 * b + c);
      peaks.emplace_back((n - 1 + at) * h, b - 0.25 * (a - c) * at);
    }
    EXPECT_EQ(peaks.size(), 3u);
    return peaks;
  }
};
using Peaks = std::vector<std::pair<double, double>>;
double decrement(const Peaks &p) { return std::log(p[0].second / p[2].second); }
double period(const Peaks &p) { return p[2].first - p[0].first; }

constexpr const char *kModels[] = {"msm", "corotational_fem", "linear_fem", "meshless"};

// unsanitized: 36 s there; the tests below have the same accesses
// Damping of the first stretch within 2 %, its period within 0.5 %, in sub-steps that are at least four times
// as long: with a lag those that stiffness allows; without, as short as damping asks for.
TEST(Dampers, WithALag_TheFirstModeIsDampedAsByRayleigh) {
  for (const char *model : kModels) {
    const Bar lagged(model, 3e-3), direct(model, 3e-3);
    direct.without_lag();
    const double h = lagged.stable();
    const double shorter = direct.stable();
    const auto swing = [](const Bar &bar, double step) {
      bar.stretch(0.05);
      return bar.peaks_of(step, [&] { return bar.momentum(); });
    };
    const Peaks with = swing(lagged, h), without = swing(direct, shorter);
    std::printf("%s: sub-step %.2g s for %.2g, decrement %.3f for %.3f, period %.4f s for %.4f\n", model, h,
                shorter, decrement(with), decrement(without), period(with), period(without));
    EXPECT_GT(h, 4 * shorter) << model;
    EXPECT_NEAR(decrement(with), decrement(without), 0.02 * decrement(without)) << model;
    EXPECT_NEAR(period(with), period(without), 0.005 * period(without)) << model;
  }
}

// Eigenvalues of a symmetric matrix, left in its diagonal, and its eigenvectors as rows, by Jacobi.
std::vector<double> turn_to_diagonal(std::vector<double> &a, size_t n) {
  std::vector<double> v(n * n, 0);
  for (size_t i = 0; i < n; ++i) v[i * (n + 1)] = 1;
  for (int sweep = 0; sweep < 12; ++sweep)
    for (size_t p = 0; p < n; ++p)
      for (size_t q = p + 1; q < n; ++q) {
        const double off = a[p * n + q], half = 0.5 * (a[q * (n + 1)] - a[p * (n + 1)]);
        if (off == 0) continue;
        const double t = std::copysign(1.0, half) * off / (std::fabs(half) + std::hypot(half, off));
        const double c = 1 / std::sqrt(1 + t * t), s = c * t;
        const auto turn = [&](double &x, double &y) {
          const double was = x;
          x = c * was - s * y;
          y = s * was + c * y;
        };
        for (size_t k = 0; k < n; ++k) turn(a[k * n + p], a[k * n + q]);
        for (size_t k = 0; k < n; ++k) turn(a[p * n + k], a[q * n + k]);
        for (size_t k = 0; k < n; ++k) turn(v[p * n + k], v[q * n + k]);
      }
  return v;
}

// The slowest modes of the matrix of a free bar, some faster than its slowest uniform strain: each swings
// alone, with a damping ratio of half of its frequency times `damping_stiffness` within 2 %, up to 0.12.
// unsanitized: 10 s there; the tests below have the same accesses
TEST(Dampers, WithALag_EachSlowModeIsDampedAsByRayleigh) {
  constexpr size_t kModes = 9, kRigid = 6;
  constexpr uint32_t kCells = 100;
  const Bar still("linear_fem", 0, 0, kCells);
  dfm::Body &b = *still.body;
  const size_t n = size_t{3} * b.p.n;
  const auto at = [](size_t i) { return 4 * (i / 3) + i % 3; };
  const auto root_mass = [&](size_t i) { return std::sqrt(b.p.mass[i / 3]); };
  std::vector<double> matrix(n * n);  // of stiffness, over the roots of both masses
  for (size_t j = 0; j < n; ++j) {
    const double eps = 1e-4, x = b.p.x[at(j)];
    b.p.x[at(j)] += eps;
    ASSERT_TRUE(b.dynamics->add_forces({0, 1e-4, {}, HUGE_VAL, {}}, true));
    b.p.x[at(j)] = x;
    for (size_t i = 0; i < n; ++i) matrix[j * n + i] = -b.p.f[at(i)] / eps / (root_mass(i) * root_mass(j));
  }
  const std::vector<double> vectors = turn_to_diagonal(matrix, n);
  std::vector<size_t> order(n);
  for (size_t i = 0; i < n; ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](size_t i, size_t j) { return matrix[i * (n + 1)] < matrix[j * (n + 1)]; });
  const auto frequency = [&](size_t mode) { return std::sqrt(matrix[order[kRigid + mode] * (n + 1)]); };
  const double damping = 0.24 / frequency(kModes - 1);
  for (size_t mode = 0; mode < kModes; ++mode) {
    const Bar bar("linear_fem", damping, 0, kCells);
    dfm::Phyxels &p = bar.body->p;
    ASSERT_GT(p.dampers.lag, 0);
    const double *const shape = &vectors[order[kRigid + mode] * n];
    for (size_t i = 0; i < n; ++i) p.v[at(i)] = 1e-3 * shape[i] / root_mass(i);
    bar.body->relax_dampers();
    const Peaks peaks = bar.peaks_of(bar.stable(), [&] {
      double sum = 0;
      for (size_t i = 0; i < n; ++i) sum += root_mass(i) * shape[i] * p.v[at(i)];
      return sum;
    });
    ASSERT_EQ(peaks.size(), 3u);
    const double ratio = 0.5 * damping * frequency(mode);
    const double turn = 2 * std::numbers::pi / std::sqrt(1 - ratio * ratio);  // of its phase, while it decays
    std::printf("mode %zu, ratio %.3f: %.4f of its decrement, %.4f of its period\n", mode, ratio,
                decrement(peaks) / (turn * ratio), period(peaks) / (turn / frequency(mode)));
    EXPECT_NEAR(decrement(peaks), turn * ratio, 0.02 * turn * ratio) << mode;
    EXPECT_NEAR(period(peaks), turn / frequency(mode), 0.005 * period(peaks)) << mode;
  }
}

// Kinetic and elastic energy as the scheme keeps them, and what is stored in the dampers, only fall, whatever
// moves, at the longest sub-step.
// unsanitized: too slow there; shorter tests run the same code
TEST(Dampers, WithALag_EnergyOnlyFalls) {
  for (const char *model : {"linear_fem", "corotational_fem"}) {
    const Bar bar(model, 3e-3, 2, 200);
    dfm::Body &b = *bar.body;
    // cells that turn within a sub-step gain some of that
    const double rounding = std::string(model) == "linear_fem" ? 1e-13 : 1e-6;
    std::mt19937 random(7);
    const double h = bar.stable();
    for (size_t i = 0; i < b.p.v.size(); ++i)
      if (i % 4 < 3) b.p.v[i] = 1e-2 * (double(random()) / 2147483648.0 - 1);
    const auto energy = [&] {
      const dfm::SubStep now{0, h, {}, HUGE_VAL, {}};
      double kept = 0, kinetic = 0;
      EXPECT_TRUE(b.dynamics->add_forces(now, true) && b.dynamics->free_motion(now, kinetic));
      const dfm_kin k = b.dynamics->kin(0, 0);
      test::ok(b.model.ops->energy(b.model.self, &k, &kept));
      for (size_t at = 0; at < b.p.v.size(); ++at)
        kept += 0.5 * b.p.mass[at / 4] * b.p.v[at] * b.p.v_free[at];
      return kept + b.dynamics->damper_energy(0);
    };
    double last = energy(), first = last, stored = 0;
    for (int n = 0; n < 300; ++n) {
      test::ok(dfm_world_step(bar.world, h, nullptr));
      const double now = energy();
      EXPECT_LE(now, last + rounding * first) << model << ", " << n;
      stored = std::max(stored, b.dynamics->damper_energy(0));
      last = now;
    }
    EXPECT_LT(last, 0.5 * first);
    EXPECT_GT(stored, 1e-2 * first);
  }
}

// Drag sees no lag: a body that falls through it is as fast as one without other dampers, bit for bit but for
// rounding.
TEST(Dampers, Drag_SeesNoLag) {
  const auto fall = [](double damping) {
    const Bar bar("msm", damping, 40, 200);
    EXPECT_EQ(bar.body->p.dampers.lag > 0, damping > 0);
    test::set_velocity(bar.handle, {1, -2, 3});
    for (int n = 0; n < 200; ++n) test::ok(dfm_world_step(bar.world, 1e-4, nullptr));
    return std::vector<double>(bar.body->p.v.begin(), bar.body->p.v.end());
  };
  const std::vector<double> with = fall(5e-3), without = fall(0);
  for (size_t i = 0; i < with.size(); ++i) EXPECT_NEAR(with[i], without[i], 1e-12) << i;
  EXPECT_NEAR(without[0], std::pow(1 - 40 * 1e-4, 200), 1e-9);
}

// A spin strains nothing: angular momentum stays, and the lag gives it no damping.
TEST(Dampers, ASpin_KeepsItsMomentum) {
  const Bar bar("corotational_fem", 3e-3, 0, 200);
  dfm::Phyxels &p = bar.body->p;
  for (size_t i = 0; i < p.n; ++i) {
    p.v[4 * i] = -6 * (p.x[4 * i + 1] - 0.02);
    p.v[4 * i + 1] = 6 * (p.x[4 * i] - 0.1);
  }
  bar.body->relax_dampers();
  const auto spin = [&] {
    double sum = 0;
    for (size_t i = 0; i < p.n; ++i)
      sum += p.mass[i] * ((p.x[4 * i] - 0.1) * p.v[4 * i + 1] - (p.x[4 * i + 1] - 0.02) * p.v[4 * i]);
    return sum;
  };
  const double before = spin();
  const double h = bar.stable();
  for (int n = 0; n < 2000; ++n) test::ok(dfm_world_step(bar.world, h, nullptr));
  EXPECT_NEAR(spin(), before, 1e-9 * before);
}

// The strain that bounds the lag is the same however the body lies, also for a model that does not turn.
TEST(Dampers, ATurnedBody_HasTheSameSubStep) {
  for (const char *model : {"linear_fem", "corotational_fem"}) {
    double h[2];
    for (int turned = 0; turned < 2; ++turned) {
      const test::Context context;
      const dfm_world world = test::make_world(context, {0, 0, 0});
      test::BodyOptions o;
      o.model = model;
      o.damping_stiffness = 12e-3;
      if (turned) o.rotation = {0, 0, std::sin(0.6), std::cos(0.6)};
      test::make_body(context, world, "beam", {0.2, 0.04, 0.04}, 300, o);
      test::ok(dfm_world_stable_step(world, &h[turned], nullptr, nullptr));
    }
    EXPECT_NEAR(h[1], h[0], 1e-6 * h[0]) << model;
  }
}

// An impact that explicit sub-steps would take too long for stays implicit: the step does not fail.
// unsanitized: too slow there; shorter tests run the same code
TEST(Dampers, AnImpactThatIsTooDear_StaysImplicit) {
  for (const double young : {3e7, 3.5e7}) {
    const test::Context context;
    dfm_world_def def = dfm_world_def_default();
    def.step = 1.0 / 60;
    dfm_world world = 0;
    test::ok(dfm_world_create(context, &def, &world));
    test::add_plane(world, "floor");
    test::BodyOptions o;
    o.model = "corotational_fem";
    o.young = young;
    o.damping_stiffness = 3e-3;
    o.position = {0, 0, 0.01};
    o.velocity = {0, 0, -2};
    test::make_body(context, world, "beam", {0.2, 0.04, 0.04}, 300, o);
    for (int k = 0; k < 8; ++k)
      EXPECT_EQ(dfm_world_step(world, 1.0 / 120, nullptr), DFM_OK) << dfm_last_error();
  }
}

// The lag follows a damping that changes during the run, and a restore brings back both.
TEST(Dampers, DampingThatChanges_AndARestore) {
  const Bar bar("corotational_fem", 0, 5, 200);
  const double more = 4e-3;
  const dfm_param_value value{"damping_stiffness", &more, 1};
  const dfm_params params{sizeof(dfm_params), 1, &value};
  bar.stretch(0.5);
  const auto run = [&] {
    for (int n = 0; n < 50; ++n) test::ok(dfm_world_step(bar.world, 5e-4, nullptr));
    return test::snapshot(bar.world);
  };
  const std::string before = test::snapshot(bar.world);
  EXPECT_EQ(bar.body->p.dampers.lag, 0);
  const std::string without = run();
  test::ok(dfm_body_set_params(bar.handle, &params));
  EXPECT_GT(bar.body->p.dampers.lag, 0);
  EXPECT_EQ(bar.body->p.dampers.v.size(), bar.body->p.v.size());
  const std::string middle = test::snapshot(bar.world);
  const std::string with = run();
  test::ok(dfm_world_restore(bar.world, before.data(), before.size()));
  EXPECT_EQ(bar.body->p.dampers.lag, 0);
  EXPECT_EQ(run(), without);
  test::ok(dfm_world_restore(bar.world, middle.data(), middle.size()));
  EXPECT_EQ(run(), with);
}

}  // namespace
