// `deform mesh from-labels` and `deform mesh phantom` as a user calls them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <regex>

#include "deform/deform.h"
#include "support.h"

namespace {

bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }

// In a folder with a space, as a stranger's may have.
std::string folder() {
  const std::string out = test::scratch("labels_command") + "/a folder";
  std::filesystem::create_directories(out);
  return out;
}

std::string phantom(const std::string &kind, const char *voxel) {
  const std::string out = folder() + "/" + kind + ".nrrd";
  const auto r = test::deform({"mesh", "phantom", kind, "--voxel", voxel, "--out", out, "--quiet"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  return out;
}

const char *const kTable = R"({
  "format": "deform-labels", "version": 1,
  "labels": {
    "1": {"name": "fat", "body": "trunk", "material": "fat"},
    "2": {"name": "liver", "body": "trunk", "material": "liver"},
    "3": {"skip": true},
    "4": {"name": "kidney_right", "material": "liver"},
    "5": {"name": "kidney_left", "body": "trunk", "material": "liver"},
    "6": {"name": "spine", "obstacle": true}
  },
  "materials": {"fat": {"density": 950, "young": 5e3, "poisson": 0.4},
                "liver": {"density": 1050, "young": 1e4, "poisson": 0.4}},
  "bodies": {"trunk": {"cells": 900, "model": {"type": "linear_fem"}}},
  "scene": {"gravity": [0, 0.5, 0], "time": {"duration": 0.02, "step": 0.01, "integrator": "implicit_euler"}}
})";

void expect_same(const std::string &a, const std::string &b) {
  const std::string text = test::read_file(a);
  EXPECT_FALSE(text.empty()) << a;
  EXPECT_EQ(text, test::read_file(b)) << a;
}

double number(const std::string &json, const std::string &pattern) {
  std::smatch m;
  if (!std::regex_search(json, m, std::regex(pattern + R"re(": ([-+.\deE]+))re"))) return NAN;
  return std::stod(m[1]);
}

// A cube of label 1; two voxels of label 2 touch it where asked for.
std::string cube(const std::string &out, const std::string &name, bool touched = false) {
  const std::string volume = out + "/scan.nrrd";
  std::string voxels;
  for (int i = 0; i < 512; ++i)
    voxels += char(std::min({i % 8, i / 8 % 8, i / 64}) > 0 && std::max({i % 8, i / 8 % 8, i / 64}) < 7);
  if (touched) voxels[7 + 8 * 3 + 64 * 3] = voxels[7 + 8 * 4 + 64 * 3] = 2;
  test::write_file(volume,
                   "NRRD0005\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 8 8 8\n"
                   "space directions: (5,0,0) (0,5,0) (0,0,5)\nencoding: raw\n"
                   "Segment0_LabelValue:=1\nSegment0_Name:=" +
                       name + "\n\n" + voxels);
  return volume;
}

}  // namespace

TEST(LabelsCommand, WithoutATable_MakesOneBodyOfRegionsThatRuns) {
  const std::string out = folder() + "/plain";
  std::filesystem::remove_all(out);
  const auto made =
      test::deform({"mesh", "from-labels", phantom("nodule", "4"), "--out", out, "--cells", "3000"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const char *word : {"gel", "nodule", "closed: yes", "cross: 0", "quality of cells 0.9"})
    EXPECT_TRUE(has(made.out, word)) << word << " not in\n" << made.out;
  EXPECT_TRUE(has(made.err, "no table of labels is given")) << made.err;
  const auto info = test::deform({"mesh", "info", out + "/body.vtk"});
  EXPECT_TRUE(has(info.out, "gel") && has(info.out, "nodule")) << info.out;
  const auto run =
      test::deform({"run", out + "/scene.json", "--time", "0.004", "--quiet", "--out", out + "/run"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // what it wrote is the table that gives the same scene
  const auto again = test::deform({"mesh", "from-labels", phantom("nodule", "4"), "--out", out + "/again",
                                   "--cells", "3000", "--table", out + "/labels.json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_FALSE(has(again.err, "no table")) << again.err;
  EXPECT_TRUE(has(again.err, "(nodule): its cells hold")) << again.err;  // few cells make a coarse ball
  for (const char *name : {"/scene.json", "/labels.json", "/body.vtk", "/body.obj"})
    expect_same(out + name, out + "/again" + name);
}

// What nothing holds falls onto a floor, whatever is called so already.
TEST(LabelsCommand, LabelNamedFloor_HasAFloorOfAnotherName) {
  const std::string out = test::scratch("labels_command_floor");
  std::filesystem::remove_all(out + "/made");
  const auto made =
      test::deform({"mesh", "from-labels", cube(out, "floor"), "--out", out + "/made", "--cells", "300"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto read = test::deform({"explain", out + "/made/scene.json"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST(LabelsCommand, TableThatTheUserHasChanged_IsNotReplaced) {
  const std::string out = test::scratch("labels_command_table"), made = out + "/made",
                    table = made + "/labels.json";
  std::filesystem::remove_all(made);
  std::vector<std::string> words = {"mesh",    "from-labels", cube(out, "liver"), "--out", made,
                                    "--cells", "300"};
  for (int i = 0; i < 2; ++i) EXPECT_EQ(test::deform(words).exit_code, 0);
  const std::string changed = test::read_file(table) + "\n\n";
  test::write_file(table, changed);
  const auto refused = test::deform(words);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, table + ": ") && has(refused.err, "--table")) << refused.err;
  EXPECT_EQ(test::read_file(table), changed);
  test::write_file(out + "/other.json", changed + "\n");
  words.insert(words.end(), {"--table", ""});
  for (const std::string &given : {table, out + "/other.json"}) {
    words.back() = given;
    const auto done = test::deform(words);
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_EQ(has(done.err, table + " differs and is left as it is"), given != table) << done.err;
    EXPECT_EQ(test::read_file(table), changed) << given;
  }
}

// Cells are too coarse for so small a border: no face of theirs lies at it.
TEST(LabelsCommand, BorderSmallerThanAFaceOfTheCells_HoldsNothing) {
  const std::string out = test::scratch("labels_command_border"), table = out + "/table.json";
  std::filesystem::remove_all(out + "/made");
  test::write_file(table, R"({"format": "deform-labels", "version": 1,
    "labels": {"1": {"name": "organ", "material": "gel"}, "2": {"name": "spine", "obstacle": true}},
    "materials": {"gel": {"density": 1000, "young": 1e4}},
    "bodies": {"organ": {"cells": 80, "surface": {"from": "boundary"}}}})");
  const auto made = test::deform(
      {"mesh", "from-labels", cube(out, "organ", true), "--table", table, "--out", out + "/made"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(has(made.err, "organ meets spine on less than a face of its cells")) << made.err;
  const auto read = test::deform({"explain", out + "/made/scene.json"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST(LabelsCommand, NamesInOtherLetters_StayApart) {
  const std::string out = test::scratch("labels_command_names"), table = out + "/table.json";
  std::filesystem::remove_all(out + "/made");
  const auto make = [&](const std::string &first, const std::string &second) {
    test::write_file(table, R"({"format": "deform-labels", "version": 1, "labels": {"1": )" + first +
                                R"(, "2": )" + second +
                                R"(}, "materials": {"gel": {"density": 1000, "young": 1e4}}})");
    return test::deform({"mesh", "from-labels", cube(out, "a", true), "--table", table, "--out",
                         out + "/made", "--cells", "300"});
  };
  const auto made = make(R"({"name": "a", "body": "肝臟", "material": "gel"})",
                         R"({"name": "b", "body": "腎臟", "material": "gel"})");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(out + "/made/肝臟.vtk") &&
              std::filesystem::exists(out + "/made/腎臟.vtk"));
  const auto read = test::deform({"explain", out + "/made/scene.json"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  const auto bodies = make(R"({"name": "a", "body": "left/lung", "material": "gel"})",
                           R"({"name": "b", "body": "left_lung", "material": "gel"})");
  EXPECT_EQ(bodies.exit_code, 2);
  EXPECT_TRUE(has(bodies.err, "\"left/lung\" and \"left_lung\"")) << bodies.err;
  const auto labels =
      make(R"({"name": "left/lung", "material": "gel"})", R"({"name": "left_lung", "material": "gel"})");
  EXPECT_EQ(labels.exit_code, 2);
  EXPECT_TRUE(has(labels.err, "/labels/2/name: label 1 has the name left_lung")) << labels.err;
}

TEST(LabelsCommand, SceneThatTheUserHasChanged_IsNotReplaced) {
  const std::string out = test::scratch("labels_command_scene"), made = out + "/made",
                    scene = made + "/scene.json";
  std::filesystem::remove_all(made);
  const std::vector<std::string> words = {"mesh",    "from-labels", cube(out, "liver"), "--out", made,
                                          "--cells", "300"};
  for (int i = 0; i < 2; ++i) EXPECT_EQ(test::deform(words).exit_code, 0);
  const std::string changed = test::read_file(scene) + "\n";
  test::write_file(scene, changed);
  const auto refused = test::deform(words);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, scene + ": ") && has(refused.err, "\"scene\"")) << refused.err;
  EXPECT_EQ(test::read_file(scene), changed);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(LabelsCommand, ManyTriangles_AreReportedAndTheCommandCanBePasted) {
  const std::string out = folder() + "/a folder's name";
  const auto fine =
      test::deform({"mesh", "from-labels", phantom("nodule", "4"), "--out", out, "--cells", "300"});
  ASSERT_EQ(fine.exit_code, 0) << fine.err;
  EXPECT_TRUE(has(fine.out, "a larger --spacing makes fewer")) << fine.out;
  EXPECT_TRUE(has(fine.out, "a folder'\\''s name/scene.json'\n")) << fine.out;
  EXPECT_TRUE(has(fine.out, "deform run '")) << fine.out;
  const auto coarse =
      test::deform({"mesh", "from-labels", phantom("nodule", "4"), "--out", out, "--cells", "20000"});
  ASSERT_EQ(coarse.exit_code, 0) << coarse.err;
  EXPECT_FALSE(has(coarse.out, "--spacing")) << coarse.out;
}

TEST(LabelsCommand, WithATable_MakesBodiesAnObstacleAndWhatHoldsThem) {
  const std::string table = folder() + "/table.json", out = folder() + "/organs";
  std::filesystem::remove_all(out);
  test::write_file(table, kTable);
  const auto made = test::deform(
      {"mesh", "from-labels", phantom("abdomen", "12"), "--table", table, "--out", out, "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(number(made.out, "open_edges"), 0);
  EXPECT_EQ(number(made.out, "crossing_pairs"), 0);
  EXPECT_LT(number(made.out, "largest_volume_change"), 1e-5);
  EXPECT_EQ(made.out, test::read_file(out + "/summary.json"));
  EXPECT_FALSE(has(made.out, "lesion"));
  const std::string scene = test::read_file(out + "/scene.json");
  for (const char *word : {"\"fix\": [{\"group\": \"to_spine\"}]", "\"shape\": \"voxels\"",
                           "\"to\": \"trunk\"", "\"linear_fem\"", "\"kidney_left\": \"liver\"",
                           "{\"between\": [\"trunk\", \"spine\"]}", "\"gravity\": [0, 0.5, 0]"})
    EXPECT_TRUE(has(scene, word)) << word << " not in\n" << scene;
  const auto run = test::deform({"run", out + "/scene.json", "--out", out + "/run", "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(number(test::read_file(out + "/run/summary.json"), "intersections_max"), 0);
  EXPECT_EQ(number(test::read_file(out + "/run/summary.json"), "inverted_max"), 0);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(LabelsCommand, BodiesThatAreCut_HaveCellsThatFollowTheirLabels) {
  const std::string table = folder() + "/cut_table.json", out = folder() + "/cut organs";
  std::filesystem::remove_all(out);
  std::string text = kTable;
  const auto put = [&text](const std::string &before, const std::string &words) {
    text.insert(text.find(before), words);
  };
  text.replace(text.find("\"linear_fem\"}"), 13,
               "\"corotational_fem\"}, \"surface\": {\"from\": \"boundary\"}");
  put("\"trunk\": {\"cells\"", "\"kidney_right\": {\"cells\": 200, \"surface\": {\"from\": \"boundary\"}}, ");
  put("\"gravity\"",
      R"("cuts": [{"body": "trunk", "t": 0.01, "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}],
            )");
  test::write_file(table, text);
  const auto made = test::deform(
      {"mesh", "from-labels", phantom("abdomen", "12"), "--table", table, "--out", out, "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string scene = test::read_file(out + "/scene.json");
  for (const char *word :
       {"\"surface\": {\"from\": \"boundary\"}", "\"group\": \"to_trunk\"", "\"group\": \"to_spine\""})
    EXPECT_TRUE(has(scene, word)) << word << " not in\n" << scene;
  EXPECT_FALSE(has(scene, "trunk.obj")) << scene;
  // as many cells as were asked for, with the volume of the labels, none flat
  for (const auto &[name, cells] : {std::pair<const char *, double>{"trunk", 900}, {"kidney_right", 200}}) {
    const auto info = test::deform({"mesh", "info", out + "/" + name + ".vtk", "--json"});
    ASSERT_EQ(info.exit_code, 0) << info.err;
    EXPECT_NEAR(number(info.out, "tets"), cells, 0.25 * cells) << name;
    EXPECT_GE(number(info.out, "quality\": \\{\"min"), 0.3 - 1e-9) << name;
    double wanted = 0;
    const std::regex label(R"re("body": ")re" + std::string(name) +
                           R"re("[^}]*?"voxel_volume": ([-+.\deE]+))re");
    for (std::sregex_iterator m(made.out.begin(), made.out.end(), label), end; m != end; ++m)
      wanted += std::stod((*m)[1]);
    EXPECT_NEAR(number(info.out, "volume") / wanted, 1, 0.02) << name;
  }
  const auto run = test::deform({"run", out + "/scene.json", "--out", out + "/run", "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(has(run.err, "met nothing")) << run.err;
  EXPECT_EQ(number(test::read_file(out + "/run/summary.json"), "inverted_max"), 0);
  // the table that was written makes the same bodies
  const auto again = test::deform({"mesh", "from-labels", phantom("abdomen", "12"), "--table",
                                   out + "/labels.json", "--out", out + "/again", "--quiet"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  for (const char *name : {"/scene.json", "/trunk.vtk", "/kidney_right.vtk"})
    expect_same(out + name, out + "/again" + name);
}

TEST(LabelsCommand, WrongInput_IsReportedInOneSentence) {
  const std::string volume = phantom("nodule", "6"), out = folder() + "/refused",
                    table = folder() + "/wrong.json";
  const auto refused = [&](const std::vector<std::string> &more, const std::string &words) {
    std::vector<std::string> args = {"mesh", "from-labels"};
    args.insert(args.end(), more.begin(), more.end());
    const auto r = test::deform(args);
    EXPECT_EQ(r.exit_code, 2) << r.out;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    EXPECT_TRUE(has(r.err, words)) << "no '" << words << "' in: " << r.err;
    EXPECT_FALSE(std::filesystem::exists(out)) << words;
  };
  const auto with_table = [&](const std::string &text, const std::string &words) {
    test::write_file(table, text);
    refused({volume, "--out", out, "--table", table}, words);
  };
  const std::string begin =
      R"({"format": "deform-labels", "version": 1, "materials": {"gel": {"density": 1000, "young": 1e4}}, )";
  with_table(begin + R"("labels": {"7": {"material": "gel"}}})",
             "/labels/7: the volume has no label 7; it has 1, 2");
  with_table(begin + R"("labels": {"1": {"material": "gle"}}})", "did you mean \"gel\"?");
  with_table(begin + R"("labels": {"1": {}}})", "\"material\" is missing");
  with_table(begin + R"("labels": {"1": {"colour": "red"}}})", "/labels/1/colour: no such key");
  with_table(begin + R"("labels": {"1": {"skip": true}, "2": {"skip": true}}})", "no label is left");
  with_table(begin + R"("labels": )", "wrong.json:1");
  for (const char *number : {"1e4Pa", "True", ".5", "0x10", "01", "1.", "NaN", "-"})
    with_table(R"({"format": "deform-labels", "version": 1, "materials": {"gel": {"young": )" +
                   std::string(number) + "}}}",
               "this is not JSON");
  with_table(begin + R"("labels": {"1": {"material": "gel", "name": "gel"}},)"
                     R"( "bodies": {"gel": {"surface": {"mesh": "a.obj"}}}})",
             "/bodies/gel/surface: expected {\"from\": \"boundary\"}, for a body that is cut or torn");
  with_table("[]", "expected an object");
  const std::string labels = begin + R"("labels": {"1": {"material": "gel", "name": "gel"}}, )";
  with_table(labels + R"("scene": {"obstacles": {"name": "wall"}}})", "/scene/obstacles: expected a list");
  with_table(labels + R"("scene": {"contact": [1, 2]}})", "/scene/contact: expected an object");
  with_table(labels + R"("scene": {"contact": {"filter": {}}}})", "/scene/contact/filter: expected a list");
  for (const std::string key : {"fix", "attach"})
    with_table(labels + R"("bodies": {"gel": {")" + key + R"(": {"group": "a"}}}})",
               "/bodies/gel/" + key + ": expected a list");
  const std::string whole = test::read_file(volume), cut = folder() + "/cut.nrrd",
                    none = folder() + "/none.nrrd";
  test::write_file(cut, whole.substr(0, whole.size() - 40));
  refused({cut, "--out", out}, "bytes too early");
  refused({none, "--out", out}, "none.nrrd");
  refused({volume, "--out", out, "--spacing", "wide"}, "--spacing: expected a length");
  refused({volume, "--out", out, "--unit", "parsec"}, "unknown unit of length \"parsec\"");
  refused({volume, "--out", out, "--unit", "m", "--cells", "0"}, "--cells: from 1");
  refused({volume}, "--out");
  const auto unknown = test::deform({"mesh", "phantom", "head", "--out", out});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_TRUE(has(unknown.err, "there are abdomen and nodule")) << unknown.err;
}
