// `deform ccd` as a user calls it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "support.h"

namespace {

std::string folder() { return test::scratch("ccd_command"); }

std::string header() {
  std::string text = "id,kind";
  for (int end = 0; end < 2; ++end)
    for (int p = 0; p < 4; ++p)
      for (const char *axis : {"x", "y", "z"})
        text += ",p" + std::to_string(p) + "_t" + std::to_string(end) + "_" + axis;
  return text + "\n";
}
// A point that falls on a triangle at t = 0.25, an edge that crosses one at 0.5, a miss.
const char *const kFalls = "7,vf,0.25,0.25,0x1p-1,0,0,0,1,0,0,0,1,0,0.25,0.25,-1.5,0,0,0,1,0,0,0,1,0\n";
const char *const kCrosses = "b,ee,0,-1,1,0,1,1,-1,0,0,1,0,0,0,-1,-1,0,1,-1,-1,0,0,1,0,0\r\n";
const char *const kMisses = "9,vf,0.25,0.25,1,0,0,0,1,0,0,0,1,0,0.25,0.25,2,0,0,0,1,0,0,0,1,0\n";

std::string file(const std::string &name, const std::string &text) {
  test::write_file(folder() + "/" + name, text);
  return folder() + "/" + name;
}
std::string good() { return file("good.csv", header() + kFalls + "\n" + kCrosses + kMisses); }

}  // namespace

TEST(CcdCommand, EveryRoot_WritesOneRowPerQuery) {
  const std::string queries = good(), out = folder() + "/out.csv";
  for (const char *root : {"", "bisection", "regula_falsi", "brent", "conservative"}) {
    std::vector<std::string> args = {"ccd", queries, "--csv", out, "--quiet"};
    if (*root) args.insert(args.end(), {"--root", root});
    std::filesystem::remove(out);
    const test::CommandResult r = test::deform(args);
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_EQ(r.out, "");
    const std::vector<std::vector<std::string>> rows = test::read_csv(out);
    ASSERT_EQ(rows.size(), 4u);
    EXPECT_EQ(rows[0], (std::vector<std::string>{"id", "hit", "t", "evaluations"}));
    EXPECT_EQ(rows[1][0], "7");
    EXPECT_EQ(rows[1][1], "1");
    EXPECT_NEAR(std::strtod(rows[1][2].c_str(), nullptr), 0.25, 1e-10);
    EXPECT_EQ(rows[2][0], "b");
    EXPECT_NEAR(std::strtod(rows[2][2].c_str(), nullptr), 0.5, 1e-10);
    EXPECT_GT(std::atoi(rows[2][3].c_str()), 0);
    EXPECT_EQ(rows[3][1], "0");
    EXPECT_EQ(rows[3][2], "inf");
  }
}

TEST(CcdCommand, Summary_CountsAndComparesWithLabels) {
  std::string text = header();
  text.insert(text.find('\n'), ",hit,toi_hi");
  const auto labeled = [](std::string row, const std::string &label) {
    return row.substr(0, row.find_first_of("\r\n")) + label + "\n";
  };
  // The exact time of the second is said to be earlier than it is, the third is said to touch.
  text += labeled(kFalls, ",1,0.25") + labeled(kCrosses, ",1,0.25") + labeled(kMisses, ",1,0.5");
  const test::CommandResult table = test::deform({"ccd", file("labeled.csv", text)});
  const test::CommandResult json = test::deform({"ccd", folder() + "/labeled.csv", "--json"});
  ASSERT_EQ(table.exit_code, 0) << table.err;
  for (const char *word :
       {"conservative", "3 (2 point-triangle, 1 edge-edge)", "missed 1", "false alarms 0", "late 1"})
    EXPECT_NE(table.out.find(word), std::string::npos) << word << " in " << table.out;
  for (const char *word : {"\"queries\": 3", "\"hits\": 2", "\"missed\": 1", "\"false\": 0", "\"late\": 1"})
    EXPECT_NE(json.out.find(word), std::string::npos) << word << " in " << json.out;
}

TEST(CcdCommand, Separation_MovesTheTouchForward) {
  const std::string out = folder() + "/apart.csv";
  ASSERT_EQ(test::deform({"ccd", good(), "--csv", out, "--quiet", "--separation", "0.25"}).exit_code, 0);
  EXPECT_NEAR(std::strtod(test::read_csv(out)[1][2].c_str(), nullptr), 0.125, 1e-10);
}

TEST(CcdCommand, BadFiles_AreRefusedWithTheirLine) {
  std::string no_column = header();
  no_column.replace(no_column.find("p2_t1_z"), 7, "p2_t1_Z");
  std::string word(kFalls), nan(kFalls), kind(kFalls);
  word.replace(word.find("0x1p-1"), 6, "half");
  nan.replace(nan.find("0x1p-1"), 6, "nan");
  kind.replace(kind.find("vf"), 2, "fv");
  test::expect_refused({"ccd", folder() + "/none.csv"}, {"none.csv"});
  test::expect_refused({"ccd", file("empty.csv", "")}, {"empty.csv", "empty"});
  test::expect_refused({"ccd", file("column.csv", no_column + kFalls)},
                       {"column.csv:1:", "p2_t1_z", "p2_t1_Z"});
  test::expect_refused({"ccd", file("word.csv", header() + kCrosses + word)},
                       {"word.csv:3:", "p0_t0_z", "half"});
  test::expect_refused({"ccd", file("nan.csv", header() + nan)}, {"nan.csv:2:", "p0_t0_z", "finite"});
  test::expect_refused({"ccd", file("kind.csv", header() + kind)}, {"kind.csv:2:", "fv", "vf"});
  test::expect_refused({"ccd", file("short.csv", header() + "1,vf,0,0\n")},
                       {"short.csv:2:", "4 cells", "26"});
  test::expect_refused({"ccd", good(), "--root", "brant"}, {"--root", "brant", "did you mean \"brent\""});
  test::expect_refused({"ccd", good(), "--separation", "-1"}, {"min_separation"});
  test::expect_refused({"ccd", good(), "--csv", folder() + "/no/such/folder.csv"}, {"no/such/folder.csv"});
  test::expect_refused({"ccd", good(), "--csv", good()}, {"would be overwritten"});
  test::expect_refused({"ccd"}, {"QUERIES"});
}

TEST(CcdCommand, ReferenceQueries_NoneMissedNoneLate) {
  const test::CommandResult r = test::deform({"ccd", test::reference_dir() + "/ccd/queries.csv", "--json"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("\"missed\": 0"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("\"late\": 0"), std::string::npos) << r.out;
}
