// The key "tear" of a material, through the command: a bar that is pulled apart.
#include <unistd.h>

#include "support.h"

namespace {

// m, how far the middle of the bar's mass is below where it began, 0.6 s later; gravity alone makes it sag.
double fall(const char *limit) {
  const std::string out = test::scratch("tear scene " + std::to_string(getpid())) + "/" + limit;
  const test::CommandResult r =
      test::deform({"run", DEFORM_SOURCE_DIR "/tests/bench/torn_dough.json", "--time", "0.6", "--quiet",
                    "--set", std::string("/materials/dough/tear=") + limit, "--out", out});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const auto rows = test::read_csv(out + "/bodies.csv");
  size_t z = 0;
  for (size_t i = 0; i < rows.at(0).size(); ++i)
    if (rows[0][i] == "com_z") z = i;
  return std::stod(rows.at(1).at(z)) - std::stod(rows.back().at(z));
}

}  // namespace

TEST(TearScene, BarBetweenJaws_FallsWhereItTearsAndHangsWhereItDoesNot) {
  EXPECT_GT(fall("0.35"), 0.08) << "on the table";
  EXPECT_LT(fall("10"), 0.05) << "between the jaws";
}
