// Rigid limits of reference/contact at the tolerances of its README, with stiff `msm` bodies. All
// rows, and the elastic cases with the model's own error, are printed by tests/bench/contact_reference.cpp
// (doc/reference/contact_reference.md). The spheres' rows and the oblique incline have tests of their own:
// ball_incline_test.cpp, oblique_test.cpp.
#include "contact_reference.h"

#include "support.h"

namespace {

namespace ref = test::reference;

struct Row {
  std::string name;
  std::vector<double> v;
};

std::vector<Row> table(const char *name) {
  std::vector<Row> rows;
  const auto text = test::read_csv(test::reference_dir() + "/contact/tables/" + name + ".csv");
  for (size_t i = 1; i < text.size(); ++i) {
    Row row;
    for (const std::string &cell : text[i]) {
      char *end = nullptr;
      const double x = std::strtod(cell.c_str(), &end);
      if (end == cell.c_str()) row.name = cell;
      else row.v.push_back(x);
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

TEST(ContactReference, InclineBlock_SlidesAndHoldsAsTheTableSays) {
  int slid = 0, held = 0;
  for (const Row &row : table("incline_block")) {  // theta mu slides a v x tan/mu
    const double theta = row.v[0], mu = row.v[1], ratio = row.v[6];
    // at the limit itself a is 0
    if ((mu != 0 && mu != 0.2 && mu != 0.5) || std::fabs(ratio - 1) < 0.01) continue;
    const ref::Incline got = ref::incline(theta, mu);
    (row.v[2] != 0 ? slid : held)++;
    if (row.v[2] != 0)
      EXPECT_NEAR(got.acceleration, row.v[3], 0.02 * row.v[3]) << theta << " degrees, mu " << mu;
    else EXPECT_LT(std::fabs(got.creep), 1e-3) << theta << " degrees, mu " << mu;
  }
  EXPECT_GE(slid, 15);
  EXPECT_GE(held, 6);
}

TEST(ContactReference, SlidingStop_TimeAndWayWithinTwoPercent) {
  int n = 0;
  for (const Row &row : table("sliding_stop")) {  // v0 mu distance time
    const ref::Slide got = ref::slide(row.v[0], row.v[1], false);
    EXPECT_NEAR(got.distance, row.v[2], 0.02 * row.v[2]) << row.v[0] << " m/s, mu " << row.v[1];
    EXPECT_NEAR(got.time, row.v[3], 0.02 * row.v[3]) << row.v[0] << " m/s, mu " << row.v[1];
    ++n;
  }
  EXPECT_EQ(n, 15);
}

TEST(ContactReference, Conveyor_SlipTimeAndWayWithinTwoPercent) {
  int n = 0;
  for (const Row &row : table("conveyor")) {  // belt mu time distance
    const ref::Slide got = ref::slide(row.v[0], row.v[1], true);
    EXPECT_NEAR(got.time, row.v[2], 0.02 * row.v[2]) << row.v[0] << " m/s, mu " << row.v[1];
    EXPECT_NEAR(got.distance, row.v[3], 0.02 * row.v[3]) << row.v[0] << " m/s, mu " << row.v[1];
    ++n;
  }
  EXPECT_EQ(n, 15);
}

TEST(ContactReference, Toppling_VerdictsMatchOutsideFivePercent) {
  int n = 0;
  for (const Row &row : table("incline_toppling")) {  // theta w/h topples
    const double slope = std::tan(row.v[0] * ref::kDegree);
    // at mu = 1 it slides from 45 degrees on
    if (std::fabs(slope / row.v[1] - 1) < 0.05 || slope > 0.95) continue;
    EXPECT_EQ(ref::topples(row.v[0], row.v[1]), row.v[2] != 0)
        << row.v[0] << " degrees, width/height " << row.v[1];
    ++n;
  }
  EXPECT_GE(n, 25);
}

// All angles, coefficients and speeds are run by `make bench`; here one of each body.
TEST(ContactReference, RoundBodiesOnIncline_RollOrSlipWithinFivePercent) {
  int n = 0;
  for (const ref::RoundShape &shape : ref::kRounds)
    for (const auto &line : test::read_csv(test::reference_dir() + "/contact/tables/rolling_incline.csv")) {
      if (line[0] != shape.name) continue;
      const double theta = std::stod(line[1]);
      const double mu = std::stod(line[2]);
      const double a = std::stod(line[5]);
      const double turning = std::stod(line[6]);
      if (theta != (shape.thin ? 20 : shape.ball ? 10 : 45) || mu != (shape.thin || shape.ball ? 0.3 : 0.1))
        continue;
      const ref::Roll got = ref::roll(shape, theta, mu);
      EXPECT_NEAR(got.acceleration, a, 0.05 * a) << shape.name << ", " << theta << " degrees, mu " << mu;
      EXPECT_NEAR(got.turning, turning, 0.05 * a) << shape.name << ", " << theta << " degrees, mu " << mu;
      ++n;
    }
  EXPECT_EQ(n, 4);
}

TEST(ContactReference, RoundBodiesThrownWithoutSpin_RollWithinFivePercent) {
  int n = 0;
  for (const ref::RoundShape &shape : ref::kRounds)
    for (const Row &row : table("skid_to_roll")) {  // v0 mu time speed distance loss
      if (row.name != shape.name || row.v[0] != 0.5 || row.v[1] != 0.8) continue;
      const ref::Skid got = ref::skid(shape, row.v[0], row.v[1]);
      EXPECT_NEAR(got.time, row.v[2], 0.05 * row.v[2])
          << shape.name << ", " << row.v[0] << " m/s, mu " << row.v[1];
      EXPECT_NEAR(got.speed, row.v[3], 0.05 * row.v[3])
          << shape.name << ", " << row.v[0] << " m/s, mu " << row.v[1];
      EXPECT_NEAR(got.distance, row.v[4], 0.05 * row.v[4])
          << shape.name << ", " << row.v[0] << " m/s, mu " << row.v[1];
      ++n;
    }
  EXPECT_EQ(n, 3);
}

TEST(ContactReference, StickSlip_PeriodAndAmplitudeWithinTwoPercent) {
  int n = 0;
  // m k Fs Fk V x_slip x_max x_restick x_min ts tslip period rate
  for (const Row &row : table("stick_slip")) {
    const std::vector<double> &v = row.v;
    const ref::StickSlip got =
        ref::stick_slip(v[0], v[1], v[2], v[3], v[4], 1e-4, 2.3 * v[11] + v[5] / v[4], 8e-4 * v[4]);
    ASSERT_GE(got.cycles, 1) << "m " << v[0];
    EXPECT_NEAR(got.period, v[11], 0.02 * v[11]) << "m " << v[0];
    EXPECT_NEAR(got.x_max - got.x_min, v[6] - v[8], 0.02 * (v[6] - v[8])) << "m " << v[0];
    ++n;
  }
  EXPECT_EQ(n, 3);
}
