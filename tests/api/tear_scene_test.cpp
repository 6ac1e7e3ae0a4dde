// The key "tear" of a material, through the command: a bar that is pulled apart.
#include <unistd.h>

#include <algorithm>

#include "support.h"

namespace {

// m, how far the middle of the bar's mass is below where it began, 0.6 s later; gravity alone makes it sag.
double fall(const char *limit) {
  const std::string out = test::scratch("tear scene " + std::to_string(getpid())) + "/" + limit;
  const test::CommandResult r =
      test::deform({"run", DEFORM_SOURCE_DIR "/examples/scenes/torn_dough.json", "--time", "0.6", "--quiet",
                    "--set", std::string("/materials/dough/tear=") + limit, "--out", out});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  auto rows = test::read_csv(out + "/bodies.csv");
  std::erase_if(rows, [](auto &row) { return row.at(1).find('.') != std::string::npos; });  // of its pieces
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

// Pieces are bodies that the scene does not name: tables, states and the summary have them all the same.
TEST(TearScene, PiecesOfAnOrange_AreInTheTablesAndStates) {
  const std::string out = test::scratch("pieces of an orange " + std::to_string(getpid()));
  const test::CommandResult r =
      test::deform({"run", DEFORM_SOURCE_DIR "/examples/scenes/orange.json", "--time", "0.4", "--quiet",
                    "--set", "/output/states=true", "--set", "/output/every=0.1", "--out", out});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto rows = test::read_csv(out + "/bodies.csv");
  for (const char *piece : {"orange", "orange.1", "orange.2"}) {
    const auto is = [&](const std::vector<std::string> &row) { return row.at(1) == piece; };
    EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), is)) << piece;
    EXPECT_NE(test::read_file(out + "/states/" + piece + "_surface_000004.vtu"), "") << piece;
    EXPECT_NE(test::read_file(out + "/summary.json").find('"' + std::string(piece) + '"'), std::string::npos);
  }
}

// Where they were one, a piece and its body lie on each other, which is no overlap.
TEST(TearScene, PartsOfALiver_AreNotReportedAsOverlapping) {
  const std::string out = test::scratch("parts of a liver " + std::to_string(getpid()));
  const test::CommandResult r = test::deform(
      {"run", DEFORM_SOURCE_DIR "/examples/scenes/liver.json", "--time", "1.1", "--quiet", "--out", out});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(out + "/summary.json");
  EXPECT_NE(summary.find("\"liver.1\""), std::string::npos);
  EXPECT_EQ(summary.find("overlap by"), std::string::npos) << summary;
}
