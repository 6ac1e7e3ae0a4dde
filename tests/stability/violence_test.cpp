// Violence has a price that is known: spikes and tips, fast. Counted in units of work, not in seconds.
#include <algorithm>

#include "cells.h"
#include "shot.h"

namespace {

using test::Cells;
using test::Shot;

constexpr double kMax = 100;  // the worst step against the median one of the same run, in units of work

void add_cells(Shot &s, const Cells &cells, test::Vec at, test::Vec velocity, double young = 1e6) {
  test::BodyOptions o;
  const std::string name = "body" + std::to_string(s.bodies.size());
  o.name = name;
  o.young = young;
  o.damping_stiffness = 1e-4;
  o.position = at;
  o.velocity = velocity;
  s.bodies.push_back(test::make_body(s.world, cells, o));
  s.triangles.push_back(test::surface_triangles(s.bodies.back()));
}

// A ball of which some surface points are drawn out to 1.8 of its radius.
Cells spiked(dfm_context *c, double radius) {
  Cells cells = test::make_cells(c, "ball", {radius, 0, 0}, 300);
  std::vector<std::array<double, 3>> tips;
  for (uint32_t i = 0; i < cells.npoint(); ++i) {
    double *const p = &cells.points[3 * size_t(i)];
    if (std::hypot(p[0], p[1], p[2]) < 0.999 * radius) continue;
    if (std::any_of(tips.begin(), tips.end(), [&](auto &t) {
          return std::hypot(t[0] - p[0], t[1] - p[1], t[2] - p[2]) < 0.75 * radius;
        }))
      continue;
    tips.push_back({p[0], p[1], p[2]});
    for (int k = 0; k < 3; ++k) p[k] *= 1.8;
  }
  return cells;
}

// A cylinder that narrows to a fiftieth at its base: a tip that points down.
Cells tip(dfm_context *c) {
  Cells cells = test::make_cells(c, "cylinder", {0.02, 0.06, 0}, 150);
  for (uint32_t i = 0; i < cells.npoint(); ++i) {
    double *const p = &cells.points[3 * size_t(i)];
    const double s = 0.02 + 0.98 * p[2] / 0.06;
    p[0] *= s;
    p[1] *= s;
  }
  return cells;
}

void spikes(Shot &s, double speed) {
  const Cells cells = spiked(s.context, 0.05);
  add_cells(s, cells, {}, {});
  add_cells(s, cells, {0.02 + s.jitter(0.01), 0.01, 0.185}, {0, 0, -speed});
}
void tip_into_sheet(Shot &s, double speed) {
  s.add("beam", {0.12, 0.12, 0.01}, 100, {}, {});
  add_cells(s, tip(s.context), {0.06 + s.jitter(0.01), 0.06, 0.012}, {0, 0, -speed});
}
// A ball that two wedges press from below and above, from 10 cm to 1 cm: their edges stand across each other.
void between_wedges(Shot &s) {
  s.add("ball", {0.05, 0, 0}, 300, {s.jitter(0.005), 0, 0}, {});
  const double half = 0.06;
  const double edge = half * std::sqrt(2.0);
  const double near = 0.005 + edge;
  const double far = 0.0505 + edge;
  const double eighth = std::sin(std::acos(-1) / 8);
  for (const double side : {-1.0, 1.0}) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    dfm_pose_key keys[2] = {{0, {{0, 0, side * far}, {0, eighth, 0, std::sqrt(1 - eighth * eighth)}}},
                            {0.04, {}}};
    if (side > 0) std::swap(keys[0].pose.rotation[0], keys[0].pose.rotation[1]);
    keys[1].pose = keys[0].pose;
    keys[1].pose.position[2] = side * near;
    d.name = side < 0 ? "lower" : "upper";
    d.shape = DFM_SHAPE_BOX;
    d.half_size[0] = d.half_size[1] = d.half_size[2] = half;
    d.half_size[side < 0 ? 1 : 0] = 0.15;
    d.nkey = 2;
    d.keys = keys;
    d.pose = keys[0].pose;
    dfm_obstacle wedge = 0;
    test::ok(dfm_obstacle_create(s.world, &d, &wedge));
  }
}
void costs_little(const std::function<void(Shot &)> &setup, int steps, double dt,
                  uint32_t self = DFM_SELF_OFF) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    Shot s(true, seed, 1, self);
    setup(s);
    std::vector<double> work;
    for (int i = 0; i < steps; ++i) {
      uint32_t trouble = 0;
      ASSERT_EQ(dfm_world_step(s.world, dt, &trouble), DFM_OK)
          << "seed " << seed << ", step " << i << ": " << dfm_last_error();
      work.push_back(double(test::stats(s.world).work));
      const crossing::Found found = s.count();
      EXPECT_EQ(found.between, 0u) << "seed " << seed << ", step " << i;
      EXPECT_EQ(self == DFM_SELF_OFF ? 0u : found.within, 0u) << "seed " << seed << ", step " << i;
    }
    std::nth_element(work.begin(), work.begin() + long(work.size() / 2), work.end());
    const double median = work[work.size() / 2], worst = *std::max_element(work.begin(), work.end());
    EXPECT_LE(worst, kMax * median) << "seed " << seed;
    const dfm_world_stats now = test::stats(s.world);
    std::printf("%u: worst %g, median %g, factor %.1f; %g sub-steps, %g cuts, %g cheapened\n", seed, worst,
                median, worst / median, double(now.substeps), double(now.guard_cuts), double(now.cheapened));
  }
}

}  // namespace

TEST(Violence, SpikedBallsAt5MetersPerSecond_WorstStepIsBounded) {
  costs_little([](Shot &s) { spikes(s, 5); }, 40, 1e-3);
}
TEST(Violence, SpikedBallsAt50MetersPerSecond_WorstStepIsBounded) {
  costs_little([](Shot &s) { spikes(s, 50); }, 8, 1e-3);
}
TEST(Violence, TipIntoSheetAt50MetersPerSecond_WorstStepIsBounded) {
  costs_little([](Shot &s) { tip_into_sheet(s, 50); }, 8, 1e-3);
}
TEST(Violence, BallPressedBetweenWedgesWithSelfAuto_WorstStepIsBounded) {
  costs_little(between_wedges, 50, 1e-3, DFM_SELF_AUTO);
}
TEST(Violence, TipIntoSheetAt50MetersPerSecondWithSelfAuto_WorstStepIsBounded) {
  costs_little([](Shot &s) { tip_into_sheet(s, 50); }, 8, 1e-3, DFM_SELF_AUTO);
}
