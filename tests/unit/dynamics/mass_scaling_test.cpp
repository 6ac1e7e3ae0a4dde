// Mass that moves to the points of slivers: longer sub-steps, the same motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../world/inside.h"
#include "support.h"
#include "world.h"

namespace {

constexpr uint32_t kCells = 15000;
constexpr double kLength = 0.2;

// A free bar; slivers: how many cells have one of their points moved to 3 % of its altitude.
struct Bar {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0});
  std::vector<double> points;
  std::vector<uint32_t> tets;
  dfm_body_def def = dfm_body_def_default();
  dfm_body handle = 0;
  dfm_status status;

  explicit Bar(const char *model, uint32_t slivers, double scaling, double damping = 0, uint32_t n = kCells,
               int32_t integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER) {
    dfm_mesh_handle mesh = 0;
    const double size[3] = {kLength, 0.04, 0.04};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, n, &mesh));
    test::lend(mesh, def);
    points.assign(def.points, def.points + size_t{3} * def.npoint);
    tets.assign(def.tets, def.tets + size_t{4} * def.ntet);
    test::ok(dfm_mesh_destroy(mesh));
    uint32_t made = 0;
    for (uint32_t c = 101; made < slivers && c < def.ntet; c += 331) made += flatten(c);
    EXPECT_EQ(made, slivers);
    def.points = points.data();
    def.tets = tets.data();
    def.model = model;
    def.mass_scaling = scaling;
    def.integrator = integrator;
    test::BodyOptions o;
    o.damping_stiffness = damping;
    def.material = test::make_material(world, o);
    status = dfm_body_create(world, &def, &handle);
  }
  bool flatten(uint32_t cell) {
    const auto at = [&](int k) {
      return dfm::load3(&points[size_t{3} * tets[size_t{4} * cell + size_t(k)]]);
    };
    const std::vector<double> before = points;
    const dfm::Vec3 normal = normalized(cross(at(1) - at(0), at(2) - at(0)));
    dfm::store3(&points[size_t{3} * tets[size_t{4} * cell + 3]],
                at(3) - 0.97 * dot(at(3) - at(0), normal) * normal);
    for (size_t t = 0; t < tets.size(); t += 4)
      if (!(dfm::tet_volume(points.data(), 3, &tets[t]) > 0)) {
        points = before;
        return false;
      }
    return true;
  }
  dfm::Body &body() const { return *test::inside(world).bodies[0]; }
  dfm_body_info info() const {
    dfm_body_info out{};
    out.size = sizeof out;
    test::ok(dfm_body_get_info(handle, &out));
    return out;
  }
  double bound() const {  // s, not rounded to the sizes that are offered
    double offered = 0;
    test::ok(dfm_world_stable_step(world, &offered, nullptr, nullptr));
    return test::inside(world).bound.step;
  }
  // s, of the first bending mode between free ends: half periods of its displacement.
  double bending_period(double h) const {
    const dfm::Phyxels &p = body().p;
    const std::vector<double> start(p.x.begin(), p.x.end());
    const double k = 4.730040745 / kLength, end = 0.5 * k * kLength;
    const auto shape = [&](size_t i) {
      const double s = k * (p.rest[3 * i] - 0.5 * kLength);
      const double slope = k * (std::sinh(s) / std::cosh(end) - std::sin(s) / std::cos(end));
      return dfm::Vec3{-(p.rest[3 * i + 2] - 0.02) * slope, 0,
                       std::cosh(s) / std::cosh(end) + std::cos(s) / std::cos(end)};
    };
    for (size_t i = 0; i < p.n; ++i) dfm::store3(&body().p.v[4 * i], 1e-3 * shape(i));
    const auto displacement = [&] {
      double sum = 0;
      for (size_t i = 0; i < p.n; ++i)
        sum += dot(shape(i), dfm::load3(&p.x[4 * i]) - dfm::load3(&start[4 * i]));
      return sum;
    };
    std::vector<double> zeros;
    double last = displacement();
    for (uint32_t n = 1; zeros.size() < 3 && n < 20000; ++n) {
      test::ok(dfm_world_step(world, h, nullptr));
      const double now = displacement();
      if (n > 2 && last * now < 0) zeros.push_back((n - 1 + last / (last - now)) * h);
      last = now;
    }
    EXPECT_EQ(zeros.size(), 3u);
    return zeros.empty() ? 0 : zeros.back() - zeros.front();
  }
};

// Of all points: mass, first and second moments of the places at rest.
std::vector<double> moments(const dfm::Body &b) {
  std::vector<double> out(10);
  for (size_t i = 0; i < b.p.n; ++i) {
    const double *const x = &b.p.rest[3 * i], m = b.p.mass[i];
    const double terms[10] = {1,           x[0],        x[1],        x[2],        x[0] * x[0],
                              x[1] * x[1], x[2] * x[2], x[0] * x[1], x[1] * x[2], x[2] * x[0]};
    for (int k = 0; k < 10; ++k) out[size_t(k)] += m * terms[k];
  }
  return out;
}

// At least as long as was promised, and the moments of the mass are those before.
TEST(MassScaling, Slivers_TakeLongerSubSteps) {
  for (const char *model : {"corotational_fem", "linear_fem"}) {
    const Bar plain(model, 3, 0), scaled(model, 3, 0.02);
    const double before = plain.bound(), after = scaled.bound();
    const dfm_body_info info = scaled.info();
    std::printf("%s: %.3g s, with %.2g %% of the mass %.3g s; frequencies told %.2g %%\n", model, before,
                100 * info.mass_moved, after, 100 * info.frequency_change);
    EXPECT_GT(after, 1.9 * before) << model;
    EXPECT_GE(after, 0.9 * scaled.body().scaling.step * (1 - 1e-6)) << model;
    EXPECT_LE(info.mass_moved, 0.02 * (1 + 1e-9));
    EXPECT_GT(info.mass_moved, 0);
    const std::vector<double> was = moments(plain.body()), is = moments(scaled.body());
    for (size_t k = 0; k < was.size(); ++k) EXPECT_NEAR(is[k], was[k], 1e-12 * was[0]) << k;
    for (const double m : scaled.body().p.mass) EXPECT_GT(m, 0);
  }
}

// unsanitized: 40 s there; the step at the bound has the same accesses
TEST(MassScaling, FirstBendingMode_ChangesByNoMoreThanReported) {
  const char *const model = "corotational_fem";  // turned by little it is linear_fem
  const Bar plain(model, 3, 0);
  const double h = plain.bound(), period = plain.bending_period(h);
  int worth_it = 0;
  for (const double share : {0.005, 0.02}) {
    const Bar scaled(model, 3, share);
    if (scaled.info().mass_moved == 0) continue;
    ++worth_it;
    const double longer = scaled.bound() / h, change = scaled.bending_period(h) / period - 1;
    std::printf("%s %g: %.2g %% moved, sub-steps %.3g times as long, period %.2g, told %.2g\n", model, share,
                100 * scaled.info().mass_moved, longer, change, scaled.info().frequency_change);
    EXPECT_NE(change, 0);
    EXPECT_LE(std::fabs(change), scaled.info().frequency_change);
    EXPECT_LT(std::fabs(change), 0.01);
  }
  EXPECT_GE(worth_it, 1);
}

// At the longest sub-step, from noise: no energy comes, and momentum stays.
TEST(MassScaling, AtTheBound_EnergyAndMomentumStay) {
  const Bar bar("corotational_fem", 3, 0.05);
  dfm::Body &b = bar.body();
  ASSERT_GT(b.scaling.moved, 0);
  for (size_t i = 0; i < b.p.v.size(); ++i)
    if (i % 4 < 3) b.p.v[i] = 1e-4 * std::sin(double(i * i % 1009));
  const auto measured = [&] {
    dfm_body_measure m{};
    m.size = sizeof m;
    test::ok(dfm_body_get_measure(bar.handle, &m));
    return m;
  };
  const dfm_body_measure before = measured();
  const double h = bar.bound();
  double most = 0, early = 0;
  for (int n = 0; n < 600; ++n) {
    test::ok(dfm_world_step(bar.world, h, nullptr));
    if (n % 20) continue;
    const dfm_body_measure now = measured();
    most = std::max(most, now.kinetic + now.elastic);
    if (n < 300) early = most;
  }
  EXPECT_LT(most, 1.05 * early);
  EXPECT_LT(most, 3 * before.kinetic);  // symplectic Euler's energy differs from the sum by h w / 2 at most
  const dfm_body_measure after = measured();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-12 * b.mass * 1e-4 * 600);
}

// A mesh without slivers stays as it is, bit for bit.
TEST(MassScaling, WithoutSlivers_NothingChanges) {
  for (const char *model : {"msm", "corotational_fem", "linear_fem", "meshless"}) {
    const Bar plain(model, 0, 0, 0, 3000), requested(model, 0, 0.02, 0, 3000);
    EXPECT_EQ(requested.info().mass_moved, 0) << model;
    EXPECT_EQ(requested.body().p.mass, plain.body().p.mass) << model;
    for (const Bar *bar : {&plain, &requested}) {
      test::set_velocity(bar->handle, {0, 0, 1});
      for (int n = 0; n < 20; ++n) test::ok(dfm_world_step(bar->world, 1e-3, nullptr));
    }
    EXPECT_EQ(requested.body().p.x, plain.body().p.x) << model;
  }
}

// Dampers bound with their lag as stiffness does.
TEST(MassScaling, DampedSlivers_TakeLongerSubSteps) {
  const Bar plain("corotational_fem", 3, 0, 3e-3), scaled("corotational_fem", 3, 0.05, 3e-3);
  EXPECT_GT(plain.body().p.dampers.lag, 0);
  EXPECT_GT(scaled.bound(), 1.5 * plain.bound());
}

TEST(MassScaling, SnapshotsAndModels) {
  const Bar bar("corotational_fem", 3, 0.05), same("corotational_fem", 3, 0.05);
  const Bar plain("corotational_fem", 3, 0);
  EXPECT_EQ(bar.body().p.mass, same.body().p.mass);
  test::set_velocity(bar.handle, {0, 1, 2});
  test::run(bar.world, 1e-3, 1e-3);
  const std::string state = test::snapshot(bar.world);
  test::ok(dfm_world_restore(same.world, state.data(), state.size()));
  EXPECT_EQ(test::snapshot(same.world), state);
  EXPECT_LT(dfm_world_restore(plain.world, state.data(), state.size()), 0);
  const dfm::Array<double> mass = bar.body().p.mass;
  test::ok(dfm_body_set_model(bar.handle, "linear_fem", nullptr));
  EXPECT_EQ(bar.body().p.mass, mass);
}

TEST(MassScaling, WhatItCannotDo_IsRefused) {
  EXPECT_EQ(Bar("msm", 0, 0.2, 0, 60).status, DFM_E_ARG);
  test::says({"mass_scaling 0.2", "[0, 0.1]"});
  EXPECT_EQ(Bar("msm", 0, -1, 0, 60).status, DFM_E_ARG);
  EXPECT_EQ(Bar("shape_matching", 0, 0.01, 0, 60).status, DFM_E_UNSUPPORTED);
  test::says({"mass_scaling", "shape_matching"});
  EXPECT_EQ(Bar("msm", 0, 0.01, 0, 60, DFM_INTEGRATOR_IMPLICIT_EULER).status, DFM_E_UNSUPPORTED);
  const Bar bar("corotational_fem", 3, 0.05);
  const uint32_t cell = 0;
  EXPECT_EQ(dfm_body_remove_cells(bar.handle, 1, &cell, nullptr), DFM_E_UNSUPPORTED);
  test::says({"neither cut nor torn", "mass_scaling"});
}

}  // namespace
