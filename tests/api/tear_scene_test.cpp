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

// unsanitized: too slow there; shorter tests run the same code
TEST(TearScene, BarBetweenJaws_FallsWhereItTearsAndHangsWhereItDoesNot) {
  EXPECT_GT(fall("0.35"), 0.08) << "on the table";
  EXPECT_LT(fall("10"), 0.05) << "between the jaws";
}

// Pieces are bodies that the scene does not name: tables, states and the summary have them all the same.
// unsanitized: too slow there; shorter tests run the same code
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
// unsanitized: too slow there; shorter tests run the same code
TEST(TearScene, PartsOfALiver_AreNotReportedAsOverlapping) {
  const std::string out = test::scratch("parts of a liver " + std::to_string(getpid()));
  const test::CommandResult r = test::deform(
      {"run", DEFORM_SOURCE_DIR "/examples/scenes/liver.json", "--time", "1.1", "--quiet", "--out", out});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(out + "/summary.json");
  EXPECT_NE(summary.find("\"liver.1\""), std::string::npos);
  EXPECT_EQ(summary.find("overlap by"), std::string::npos) << summary;
}

namespace {

// A ball of glass that strikes a floor at this speed (m/s) and falls into many parts; what the command says.
test::CommandResult shattered(const std::string &name, const std::string &duration, const std::string &speed,
                              const std::string &separate, const std::vector<std::string> &more = {}) {
  const std::string folder = test::scratch(name + " " + std::to_string(getpid()));
  test::write_file(folder + "/scene.json", R"({"format": "deform-scene", "version": 1,
    "time": {"duration": )" + duration + R"(, "step": 0.001}, "contact": {"untangle": true},
    "materials": {"glass": {"density": 1000, "young": 1e5, "poisson": 0.3, "tear": 0.08,
                            "damping": {"mass": 0.5, "stiffness": 0.001}}},
    "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.1, "cells": 500}, "material": "glass",
      "model": {"type": "corotational_fem"}, )" +
                                               separate + R"(
      "pose": {"position": [0, 0, 0.12]}, "velocity": [0, 0, -)" +
                                               speed + R"(]}],
    "obstacles": [{"name": "floor", "shape": "plane"}], "output": {"every": 0.002}})");
  std::vector<std::string> command{"run", folder + "/scene.json", "--out", folder + "/out"};
  command.insert(command.end(), more.begin(), more.end());
  const test::CommandResult r = test::deform(command);
  EXPECT_EQ(r.exit_code, 0) << r.err;
  return r;
}

constexpr const char *kTeeth = "teeth of a cut or tear are as large as the cells";

}  // namespace

// soak: 20 s; CutBodyThatCrossesItself has the sentence of teeth, PartsOfALiver that nothing overlaps
// Nobody has put pieces in each other, and nothing of them can be moved: one sentence says what they are.
TEST(TearScene, PiecesOfABallThatShatters_AreReportedOnceAndNotToBeMoved) {
  const test::CommandResult r =
      shattered("pieces of a ball", "0.03", "3.2", R"("separate": {"least_cells": 1, "crumbs": "stay"},)");
  const std::string &log = r.err;
  const std::string said = "parts of body 'ball' came off with their faces in each other, by up to ";
  size_t times = 0;
  for (size_t at = log.find(said); at != std::string::npos; at = log.find(said, at + 1)) ++times;
  EXPECT_GE(times, 1u) << log;
  EXPECT_LE(times, 4u) << "again only where they are twice as deep\n" << log;
  EXPECT_NE(log.find(kTeeth), std::string::npos) << log;
  EXPECT_NE(log.find("did not converge"), std::string::npos) << log;
  EXPECT_NE(log.find("material stiffness damping"), std::string::npos) << log;
  for (const char *not_to_be_done : {"move one of them", "untangle", "overlap by", "max_sweeps"})
    EXPECT_EQ(log.find(not_to_be_done), std::string::npos) << log;
  EXPECT_NE(r.out.find("body \"ball\" has come apart into "), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("\"least_cells\" above 1 with \"crumbs\": \"remove\""), std::string::npos) << r.out;
}

// Without the guard: loads of faces that interlock cancel each other, and grow.
// unsanitized: too slow there; shorter tests run the same code
TEST(TearScene, TornBodyThatCrossesItself_IsAdvisedToSeparate) {
  const std::string log = shattered("torn ball", "0.06", "3", "",
                                    {"--set", "/contact/guard=false", "--set", "/time/max_work=1000000"})
                              .err;
  EXPECT_NE(log.find("a surface crosses itself"), std::string::npos) << log;
  EXPECT_NE(log.find("set \"separate\" of body 'ball'"), std::string::npos) << log;
}

// The same of a rough cut in a scene that separates: what is left to be done is another mesh.
// unsanitized: too slow there; shorter tests run the same code
TEST(TearScene, CutBodyThatCrossesItself_IsNotAdvisedToSeparateWhereItDoes) {
  const std::string out = test::scratch("rough cut " + std::to_string(getpid()));
  const std::string mesh = R"(/bodies/0/mesh={"make": "ball", "radius": 0.04, "cells": 2500})";
  const test::CommandResult r =
      test::deform({"run", DEFORM_SOURCE_DIR "/examples/scenes/orange.json", "--time", "0.35", "--set",
                    "/output/every=0.01", "--set", mesh, "--out", out});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.err.find("a surface crosses itself"), std::string::npos) << r.err;
  EXPECT_NE(r.err.find("triangle pairs of body 'orange"), std::string::npos) << r.err;
  EXPECT_NE(r.err.find(kTeeth), std::string::npos) << r.err;
  EXPECT_EQ(r.err.find("set \"separate\""), std::string::npos) << r.err;
}
