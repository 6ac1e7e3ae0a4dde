// dfm_toi_* as a host calls them: what is refused, what is written, defaults.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "deform/deform.h"

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const dfm_motion kFalling = {{0.25, 0.25, 1}, {0.25, 0.25, -1}};
const dfm_motion kTriangle[3] = {{{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {1, 0, 0}}, {{0, 1, 0}, {0, 1, 0}}};
const dfm_motion kAbove[2] = {{{0, -1, 1}, {0, -1, -1}}, {{0, 1, 1}, {0, 1, -1}}},
                 kBelow[2] = {{{-1, 0, 0}, {-1, 0, 0}}, {{1, 0, 0}, {1, 0, 0}}};

void expect_refused(const dfm_toi_options &options, const std::string &word) {
  double t = 7, at[3] = {7, 7, 7};
  EXPECT_EQ(dfm_toi_point_triangle(&kFalling, kTriangle, &options, &t, at), DFM_E_ARG) << word;
  EXPECT_NE(std::string(dfm_last_error()).find(word), std::string::npos) << dfm_last_error();
  EXPECT_EQ(dfm_toi_edge_edge(kAbove, kBelow, &options, &t, at), DFM_E_ARG) << word;
  EXPECT_EQ(t, 7);
  EXPECT_EQ(at[0], 7);
}

}  // namespace

TEST(ToiApi, NoOptions_MeansConservative) {
  double t = -1, bary[3], ab[2], same = -1;
  ASSERT_EQ(dfm_toi_point_triangle(&kFalling, kTriangle, nullptr, &t, bary), DFM_OK);
  const uint32_t work = dfm_toi_evaluations();
  EXPECT_GT(work, 0u);
  EXPECT_LE(t, 0.5);
  EXPECT_NEAR(t, 0.5, 1e-11);
  EXPECT_NEAR(bary[0], 0.5, 1e-11);
  const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, 0, 0};
  ASSERT_EQ(dfm_toi_point_triangle(&kFalling, kTriangle, &options, &same, nullptr), DFM_OK);
  EXPECT_EQ(same, t);
  EXPECT_EQ(dfm_toi_evaluations(), work);
  ASSERT_EQ(dfm_toi_edge_edge(kAbove, kBelow, nullptr, &t, ab), DFM_OK);
  EXPECT_NEAR(t, 0.5, 1e-11);
  EXPECT_NEAR(ab[0], 0.5, 1e-11);
  EXPECT_NEAR(ab[1], 0.5, 1e-11);
}

TEST(ToiApi, ShortOptions_AreCompletedWithDefaults) {
  dfm_toi_options options = {};
  // what a host that knows of the method alone would say
  options.size = offsetof(dfm_toi_options, tolerance);
  options.method = DFM_TOI_BRENT;
  options.tolerance = -5;
  double t = -1;
  ASSERT_EQ(dfm_toi_point_triangle(&kFalling, kTriangle, &options, &t, nullptr), DFM_OK);
  EXPECT_NEAR(t, 0.5, 1e-11);
}

TEST(ToiApi, Miss_IsInfinityAndLeavesWeightsAlone) {
  const dfm_motion rising = {{0.25, 0.25, 1}, {0.25, 0.25, 2}};
  for (int32_t method = DFM_TOI_BISECTION; method <= DFM_TOI_CONSERVATIVE; ++method) {
    const dfm_toi_options options = {sizeof options, method, 0, 0, 0};
    double t = 0, bary[3] = {7, 8, 9};
    ASSERT_EQ(dfm_toi_point_triangle(&rising, kTriangle, &options, &t, bary), DFM_OK);
    EXPECT_EQ(t, kInf);
    EXPECT_EQ(bary[0], 7);
    EXPECT_EQ(bary[2], 9);
  }
}

TEST(ToiApi, BadArguments_AreRefusedAndNothingIsWritten) {
  expect_refused({4, 0, 0, 0, 0}, "size is 4");
  expect_refused({sizeof(dfm_toi_options), 4, 0, 0, 0}, "options.method is 4");
  expect_refused({sizeof(dfm_toi_options), -1, 0, 0, 0}, "options.method is -1");
  expect_refused({sizeof(dfm_toi_options), 0, -1, 0, 0}, "options.tolerance");
  expect_refused({sizeof(dfm_toi_options), 0, 1, 0, 0}, "options.tolerance");
  expect_refused({sizeof(dfm_toi_options), 0, std::nan(""), 0, 0}, "options.tolerance");
  expect_refused({sizeof(dfm_toi_options), 0, 0, -1, 0}, "options.min_separation");
  expect_refused({sizeof(dfm_toi_options), 0, 0, kInf, 0}, "options.min_separation");
  expect_refused({sizeof(dfm_toi_options), 0, 0, 0, -1}, "options.max_iterations");

  double t = 7;
  dfm_motion bad[3] = {kTriangle[0], kTriangle[1], kTriangle[2]};
  bad[2].p1[1] = std::nan("");
  EXPECT_EQ(dfm_toi_point_triangle(&kFalling, bad, nullptr, &t, nullptr), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("tri[2].p1[1]"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(dfm_toi_edge_edge(bad + 1, kBelow, nullptr, &t, nullptr), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("a[1].p1[1]"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(dfm_toi_point_triangle(nullptr, kTriangle, nullptr, &t, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_toi_point_triangle(&kFalling, nullptr, nullptr, &t, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_toi_edge_edge(kAbove, nullptr, nullptr, &t, nullptr), DFM_E_ARG);
  EXPECT_EQ(t, 7);
  EXPECT_EQ(dfm_toi_point_triangle(&kFalling, kTriangle, nullptr, nullptr, nullptr), DFM_E_ARG);
}

TEST(ToiApi, LargeSeparation_TouchesFromTheStart) {
  const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, 1e300, 0};
  double t = -1;
  ASSERT_EQ(dfm_toi_edge_edge(kAbove, kBelow, &options, &t, nullptr), DFM_OK);
  EXPECT_EQ(t, 0);
}
