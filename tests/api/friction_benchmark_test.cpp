// The friction benchmark (tests/bench/friction) as a stranger meets it: rows of CSV, judged, continued where they stopped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "support.h"

namespace {

std::string script(const char *name) { return std::string(DEFORM_SOURCE_DIR) + "/tests/bench/friction/" + name; }

}  // namespace

TEST(FrictionBenchmark, OurSlides_AreMeasuredJudgedAndNotRunTwice) {
  const std::string out = test::scratch("friction_benchmark") + "/rows.csv";
  std::remove(out.c_str());
  const std::vector<std::string> call = {"python3", script("run.py"), "deform", "--command", DEFORM_COMMAND, "--only", "slope_slide",
                                         "--configuration", "coulomb", "--out", out};
  const test::CommandResult first = test::run(call);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto rows = test::read_csv(out);
  ASSERT_EQ(rows.size(), 3u);   // header, mu 0.2 and 0.5
  const auto column = [&](const char *name) { return size_t(std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin()); };
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i][column("verdict")], "pass") << first.out;
    const double measured = std::stod(rows[i][column("measured")]), expected = std::stod(rows[i][column("expected")]);
    EXPECT_NEAR(measured, expected, 0.01 * expected);
  }
  EXPECT_NE(rows[1][column("parameters")], rows[2][column("parameters")]);
  const test::CommandResult again = test::run(call);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out, "");
  EXPECT_EQ(test::read_csv(out).size(), 3u);
}

