// What a scene says of a body's cells and surface: fields, materials by group, directions, surfaces of their
// own, filling; and every mistake in them, by file and JSON pointer.
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "support.h"
#include "world.h"

namespace {

// A column 0.1 x 0.1 x 0.2 m of 48 cells (MSH 2.2) whose halves along z are the groups "lower" and "upper";
// "base" is a group of triangles. The first cell stands twice in the file.
std::string grouped_mesh() {
  const int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  auto node = [](int i, int j, int k) { return 1 + i + 3 * (j + 3 * k); };
  std::string nodes, cells;
  int n = 0;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        nodes += std::to_string(node(i, j, k));
        for (double x : {0.05 * i, 0.05 * j, 0.1 * k}) nodes += " " + std::to_string(x);
        nodes += "\n";
      }
  auto add = [&](int k, const int *path) {
    return [&, k, path](int i, int j) {
      int at[3] = {i, j, k};
      cells += std::to_string(++n) + " 4 2 " + (k ? "2 2" : "1 1") + " " + std::to_string(node(i, j, k));
      for (int step = 0; step < 3; ++step) {
        ++at[path[step]];
        cells += " " + std::to_string(node(at[0], at[1], at[2]));
      }
      cells += "\n";
    };
  };
  add(0, paths[0])(0, 0);
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i)
        for (const auto &path : paths) add(k, path)(i, j);
  cells += std::to_string(++n) + " 2 2 7 7 1 4 2\n";
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n3 1 \"lower\"\n3 2 \"upper\"\n2 7 "
         "\"base\"\n$EndPhysicalNames\n$Nodes\n27\n" +
         nodes + "$EndNodes\n$Elements\n" + std::to_string(n) + "\n" + cells + "$EndElements\n";
}

// A closed box 0.1 x 0.1 x 0.2 m, its sides in two groups.
const char *kBoxObj = R"(v 0 0 0
v 0.1 0 0
v 0.1 0.1 0
v 0 0.1 0
v 0 0 0.2
v 0.1 0 0.2
v 0.1 0.1 0.2
v 0 0.1 0.2
g top
f 5 6 7 8
g bottom
f 1 4 3 2
g sides
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
)";

const char *kScene = R"({
  "format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
  "time": {"duration": 0.01, "step": 0.001},
  "materials": {"soft": {"density": 500, "young": 2e4}, "hard": {"density": 1000, "young": 8e4},
    "slow": {"relaxation_time": 2, "damper": "maxwell"}},
  "bodies": [{"name": "column", "mesh": "column.msh", "material": "soft"}]
})";

const std::string &folder() {
  static const std::string dir = [] {
    const std::string d = test::scratch("scene_carriers_" + std::to_string(getpid()));
    test::write_file(d + "/column.msh", grouped_mesh());
    test::write_file(d + "/box.obj", kBoxObj);
    test::write_file(d + "/scene.json", kScene);
    std::string values = "value\n", numbered = "cell,young\n", axes = "x,y,z\n";
    for (int c = 0; c < 49; ++c) {
      const std::string young = c < 25 ? "2e4" : "8e4";  // cell 0 is the double of cell 1
      values += young + "\n";
      numbered += std::to_string(48 - c) + "," + (48 - c < 25 ? "2e4" : "8e4") + "\n";
      axes += c % 2 ? "0,0,3\n" : "0, 0, 0.5\n";
    }
    test::write_file(d + "/values.csv", values);
    test::write_file(d + "/numbered.csv", numbered);
    test::write_file(d + "/axes.csv", axes);
    return d;
  }();
  return dir;
}

std::string scene() { return folder() + "/scene.json"; }

struct Loaded {
  test::Context context;
  dfm_scene s = 0;
  dfm_world world = 0;
  dfm_body body = 0;
  explicit Loaded(std::vector<const char *> set, const char *name = "column") {
    dfm_scene_options options = {sizeof options, uint32_t(set.size()), set.data(), 0};
    test::ok(dfm_scene_open(context, scene().c_str(), &options, &s));
    if (!s) return;
    test::ok(dfm_scene_world(s, &world));
    test::ok(dfm_world_find_body(world, name, &body));
  }
  dfm_body_info info() const {
    dfm_body_info i{};
    i.size = sizeof i;
    test::ok(dfm_body_get_info(body, &i));
    return i;
  }
  std::vector<double> points() const {
    const std::vector<double> x = test::State(body).x;
    return x;
  }
  std::string explain() const { return test::explain(world); }
  uint64_t hash_after(int steps) {
    for (int i = 0; i < steps; ++i) test::ok(dfm_world_step(world, 1e-3, nullptr));
    return dfm_world_hash(world);
  }
};

constexpr const char *kPush =
    R"(/bodies/0/forces=[{"box": [[-1, -1, 0.199], [1, 1, 1]], "total": [0.02, 0, -0.1]}])";

// The command's last word; warnings about the mesh (a double, turned cells) stand before it.
std::string verdict(const test::CommandResult &result) {
  std::string text = result.err;
  while (text.rfind("deform: warning: ", 0) == 0 && text.find('\n') != std::string::npos)
    text.erase(0, text.find('\n') + 1);
  return text;
}

void expect_refused(std::vector<const char *> sets, const std::vector<std::string> &parts) {
  std::vector<std::string> arguments = {"explain", scene()};
  for (const char *set : sets) arguments.insert(arguments.end(), {"--set", set});
  const test::CommandResult result = test::deform(arguments);
  const std::string text = verdict(result);
  EXPECT_EQ(result.exit_code, 2) << sets.back() << "\n" << text;
  EXPECT_EQ(text.find(folder() + "/scene.json: /"), 8u) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << sets.back() << ": one sentence, found\n"
                                                           << text;
  for (const std::string &part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << sets.back() << ": expected " << part << " in\n" << text;
}
void expect_refused(const char *set, const std::vector<std::string> &parts) {
  expect_refused(std::vector<const char *>{set}, parts);
}

}  // namespace

TEST(SceneFields, Table_IsReadInTheFilesOrder) {
  const uint64_t plain = Loaded({kPush, R"(/bodies/0/fields={"young": "values.csv"})"}).hash_after(20);
  EXPECT_EQ(plain, Loaded({kPush, R"(/bodies/0/fields={"young": "numbered.csv"})"}).hash_after(20))
      << "any order, by the cells' numbers";
  // The same moduli as materials of the two groups; a double that reading dropped does not shift the rows.
  EXPECT_EQ(plain, Loaded({kPush, "/materials/hard/density=500",
                           R"(/bodies/0/materials_by_group={"upper": "hard"})"})
                       .hash_after(20));
  EXPECT_NE(plain, Loaded({kPush}).hash_after(20));
}

TEST(SceneFields, Tables_AreCheckedWithTheirPlace) {
  const std::string path = folder() + "/bad.csv";
  std::string good(R"(value)");
  for (int c = 0; c < 49; ++c) good += "\n2e4";
  const std::vector<std::pair<std::string, std::vector<std::string>>> tables = {
      {"", {"bad.csv:1:", "value or cell,value"}},
      {"1e4\n", {"bad.csv:1:", "value or cell,value"}},
      {"x,y,z\n1,0,0\n", {"bad.csv:1:"}},
      {"value\n1e4\nsoft\n", {"bad.csv:3:", "found \"soft\""}},
      {"value\n1e4\nnan\n", {"bad.csv:3:", "finite"}},
      {"value\n1e4\n", {"bad.csv: cell 2 has no row", "49"}},
      {good + "\n2e4", {"bad.csv:51:", "more rows than the 49 tetrahedra"}},
      {"cell,value\n0,1e4\n49,1e4\n", {"bad.csv:3:", "no cell 49", "0 to 48"}},
      {"cell,value\n0.5,1e4\n", {"bad.csv:2:", "no cell 0.5"}},
      {"cell,value\n3,1e4\n3,1e4\n", {"bad.csv:3:", "cell 3 has a row already"}},
      {"cell,value\n3,1e4,7\n", {"bad.csv:2:", "2 columns"}},
      {"value\n-5" + good.substr(9), {"field 'young': cell", "-5", "Pa"}}};
  // spreadsheets begin a table with a byte order mark
  const char *const use = R"(/bodies/0/fields={"young": "bad.csv"})";
  test::write_file(path, good);
  const uint64_t plain = Loaded({use}).hash_after(1);
  test::write_file(path, "\xEF\xBB\xBF" + good);
  EXPECT_EQ(Loaded({use}).hash_after(1), plain);
  for (const auto &[text, parts] : tables) {
    test::write_file(path, text);
    std::vector<std::string> all = parts;
    all.push_back("/bodies/0");
    expect_refused(R"(/bodies/0/fields={"young": "bad.csv"})", all);
  }
  expect_refused(R"(/bodies/0/fields={"young": "missing.csv"})",
                 {"/bodies/0/fields/young", "missing.csv", "No such file"});
  expect_refused(R"(/bodies/0/fields={"young": "."})",
                 {"/bodies/0/fields/young", "is a directory", "value or cell,value"});
  expect_refused("/bodies/0/nodal_bc=.", {"/bodies/0/nodal_bc", "is a directory", "node,fixx"});
}

TEST(SceneFields, Keys_AreTheModels) {
  expect_refused(R"(/bodies/0/fields={"yuong": "values.csv"})",
                 {"/bodies/0/fields/yuong", "did you mean \"young\"?"});
  expect_refused(R"(/bodies/0/fields={"damper": "values.csv"})",
                 {"/bodies/0/fields/damper", "it has: young"});
  expect_refused(R"(/bodies/0/fields=["values.csv"])", {"/bodies/0/fields", "object of files"});
  expect_refused(R"(/bodies/0/fields={"young": 5})", {"/bodies/0/fields/young", "string"});
  expect_refused({R"(/bodies/0/fields={"young": "values.csv"})", R"(/bodies/0/model/params={"young": 3e4})"},
                 {"/bodies/0/fields/young: \"young\" is given in the model's params too"});
}

TEST(SceneMaterials, ByGroup_GoToTheirCells) {
  const Loaded one({}), two({R"(/bodies/0/materials_by_group={"upper": "hard"})"}),
      all({R"(/bodies/0/materials_by_group={"upper": "hard", "lower": "hard"})"});
  EXPECT_NEAR(test::measure(one.body).mass, 1.0, 1e-12);
  EXPECT_NEAR(test::measure(two.body).mass, 1.5, 1e-12);
  EXPECT_NEAR(test::measure(two.body).com[2], (0.5 * 0.05 + 1.0 * 0.15) / 1.5, 1e-12);
  EXPECT_NEAR(test::measure(all.body).mass, 2.0, 1e-12);
  EXPECT_NE(two.explain().find(
                "\"fields\":[{\"name\":\"young\",\"from\":\"materials\",\"min\":20000,\"max\":80000}]"),
            std::string::npos)
      << two.explain();
  EXPECT_NE(all.explain().find("\"fields\":[]"), std::string::npos) << "the same everywhere is no field";
  expect_refused(R"(/bodies/0/materials_by_group={"uper": "hard"})",
                 {"/bodies/0/materials_by_group/uper", "did you mean \"upper\"?"});
  expect_refused(R"(/bodies/0/materials_by_group={"base": "hard"})",
                 {"/bodies/0/materials_by_group/base", "of cells", "lower, upper"});
  expect_refused(R"(/bodies/0/materials_by_group={"upper": "hrad"})",
                 {"/bodies/0/materials_by_group/upper", "did you mean \"hard\"?"});
  expect_refused(R"(/bodies/0/materials_by_group="hard")",
                 {"/bodies/0/materials_by_group", "object of materials"});
  expect_refused(R"(/bodies/0/materials_by_group={"upper": "slow"})",
                 {"/bodies/0: ", "'soft'", "'slow'", "differ"});
}

TEST(SceneMaterials, Words_StandForEnumerations) {
  const uint64_t word = Loaded({kPush, "/bodies/0/material=slow"}).hash_after(20);
  EXPECT_EQ(word, Loaded({kPush, "/bodies/0/material=slow", "/materials/slow/damper=1"}).hash_after(20));
  EXPECT_NE(word, Loaded({kPush, "/bodies/0/material=slow", "/materials/slow/damper=sls"}).hash_after(20));
  EXPECT_EQ(word,
            Loaded({kPush, "/bodies/0/material=slow", R"(/bodies/0/model/params={"damper": "maxwell"})"})
                .hash_after(20));
  expect_refused("/materials/slow/damper=maxwel",
                 {"/materials/slow/damper", "expected one of: voigt, maxwell, sls"});
  expect_refused("/materials/slow/relaxation_time=soon",
                 {"/materials/slow/relaxation_time", "expected a number"});
  expect_refused(R"(/bodies/0/model/params={"damper": "maxwel"})",
                 {"/bodies/0/model/params/damper", "expected one of: voigt, maxwell, sls"});
}

TEST(SceneAnisotropy, KeysAndDirections_BecomeTheModels) {
  const uint64_t plain = Loaded({kPush}).hash_after(20);
  const uint64_t along =
      Loaded({kPush, R"(/bodies/0/model/params={"anisotropy_slope": 0.5, "anisotropy_kind": "stiffer", )"
                     R"("anisotropy_axis": [0, 0, 1]})"})
          .hash_after(20);
  EXPECT_NE(plain, along);
  EXPECT_EQ(
      along,
      Loaded(
          {kPush, R"(/bodies/0/anisotropy={"axis": [0, 0, 7], "params": {"slope": 0.5, "kind": "stiffer"}})"})
          .hash_after(20));
  EXPECT_EQ(along, Loaded({kPush, R"(/bodies/0/anisotropy={"field": "axes.csv", "params": )"
                                  R"({"anisotropy_slope": 0.5, "kind": "stiffer"}})"})
                       .hash_after(20))
      << "directions of any length";
  EXPECT_NE(
      along,
      Loaded(
          {kPush, R"(/bodies/0/anisotropy={"axis": [1, 0, 0], "params": {"slope": 0.5, "kind": "stiffer"}})"})
          .hash_after(20));
}

TEST(SceneAnisotropy, Mistakes_AreReported) {
  expect_refused("/bodies/0/anisotropy={}", {"/bodies/0/anisotropy", "either \"axis\" or \"field\""});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "field": "axes.csv"})",
                 {"/bodies/0/anisotropy", "either \"axis\" or \"field\""});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 0]})", {"/bodies/0/anisotropy/axis", "zero"});
  expect_refused(R"(/bodies/0/anisotropy={"axes": [0, 0, 1]})",
                 {"/bodies/0/anisotropy/axes", "did you mean \"axis\"?"});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "params": {"slpoe": 1}})",
                 {"/bodies/0/anisotropy/params/slpoe", "did you mean \"slope\"?"});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "params": {"kind": "stiff"}})",
                 {"/bodies/0/anisotropy/params/kind", "expected one of: "});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "params": {"slope": -1}})",
                 {"/bodies/0/anisotropy/params/slope", "number from 0"});
  expect_refused(R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "params": {"slope": "a"}})",
                 {"/bodies/0/anisotropy/params/slope", "expected a number, found \"a\""});
  expect_refused(R"(/bodies/0/anisotropy={"field": "values.csv"})",
                 {"/bodies/0/anisotropy/field", "values.csv:1:", "x,y,z"});
  expect_refused(R"(/bodies/0/anisotropy={"field": "missing.csv"})",
                 {"/bodies/0/anisotropy/field", "missing.csv"});
  expect_refused({R"(/bodies/0/model/params={"anisotropy_axis": [1, 0, 0]})",
                  R"(/bodies/0/anisotropy={"axis": [0, 0, 1]})"},
                 {"/bodies/0/anisotropy: the direction is given as"});
}

// The sentence that refuses the body points to the log, so --quiet keeps the log's errors.
TEST(SceneAnisotropy, WhatTheModelRefuses_IsReportedWithQuietToo) {
  const test::CommandResult result =
      test::deform({"explain", scene(), "--quiet", "--set",
                    R"(/bodies/0/model/params={"damper": "sls", "anisotropy_form": "A"})", "--set",
                    R"(/bodies/0/anisotropy={"axis": [0, 0, 1], "params": {"slope": 1}})"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("choose form B"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("warning"), std::string::npos) << result.err;
}

constexpr const char *kBox = "/bodies/0/mesh=box.obj";
constexpr const char *kFill = "/bodies/0/fill={\"cells\": 600}";

TEST(SceneFill, ClosedSurface_BecomesABodyOfItsVolume) {
  const Loaded l({kBox, kFill, "/bodies/0/material=hard", "/bodies/0/pose={\"scale\": 2}"});
  const dfm_body_info i = l.info();
  EXPECT_GT(i.ntet, 300u);
  EXPECT_LT(i.ntet, 1200u);
  EXPECT_GT(i.nsurfel, 8u) << "the file's surface, split where it is coarser than the cells";
  EXPECT_EQ(i.ntriangle, 2 * i.nsurfel - 4) << "closed";
  EXPECT_NEAR(i.rest_volume, 0.016, 0.0002) << "shares of the cells make up the volume, scaled";
  EXPECT_NEAR(i.mass, 1000 * i.rest_volume, 1e-9);
  EXPECT_NEAR(test::measure(l.body).volume, i.rest_volume, 1e-12);
  const char *const reported =
      R"("surface":"own, barycentric","filled":true,"fields":[{"name":"young","from":"share")";
  EXPECT_NE(l.explain().find(reported), std::string::npos) << l.explain();
  const std::vector<double> x = test::listed(dfm_surface_positions, l.body, 3);
  for (int s = 0; s < 8; ++s) {  // the file's points come first
    EXPECT_NEAR(std::fabs(x[size_t(3 * s)] - 0.1), 0.1, 1e-12);
    EXPECT_NEAR(std::fabs(x[size_t(3 * s + 2)] - 0.2), 0.2, 1e-12);
  }
}

// What a mesh has as cells, in a file or as it is made, goes where others are asked for.
// unsanitized: too slow there; shorter tests run the same code
TEST(SceneFill, MeshWithCells_KeepsItsShapeUnderOthers) {
  constexpr const char *kModel = "/bodies/0/model={\"type\": \"linear_fem\"}",
                       *kLattice = "/bodies/0/lattice={\"size\": 0.1}",
                       *kBall = R"(/bodies/0/mesh={"make": "ball", "radius": 0.1, "cells": 500})";
  constexpr double kBallVolume = 4e-3 / 3 * M_PI;
  struct Case {
    std::vector<const char *> set;
    double volume;
    uint32_t ntet;
  };
  for (const auto &[set, volume, ntet] :
       {Case{{kModel, kFill}, 0.002, 600}, Case{{kModel, kLattice}, 0.002, 12},
        Case{{kModel, kBall, kFill}, kBallVolume, 600}, Case{{kModel, kBall, kLattice}, kBallVolume, 48}}) {
    const Loaded l(set);
    EXPECT_NEAR(test::measure(l.body).volume, volume, 0.03 * volume) << set.back();
    EXPECT_NEAR(l.info().ntet, ntet, 0.1 * ntet) << set.back();
    EXPECT_EQ(l.info().ntriangle, 2 * l.info().nsurfel - 4) << "closed";
  }
  expect_refused({kModel, kLattice, R"(/bodies/0/materials_by_group={"upper": "hard"})"},
                 {"/bodies/0/materials_by_group/upper", "filled surface"});
  expect_refused({R"(/bodies/0/model={"type": "boundary"})", R"(/bodies/0/fill={"cells": 0})",
                  R"(/bodies/0/fix=[{"points": [0]}])"},
                 {"/bodies/0/fix/0/points", "nodes of the mesh are not its points"});
  for (const char *const size : {"10", "1e-09"})
    expect_refused({kModel, kBall, kLattice, (std::string("/bodies/0/lattice/size=") + size).c_str()},
                   {"/bodies/0/lattice: cells of " + std::string(size) + " m are"});
}

TEST(SceneFill, CellsBySize_AndByDefault) {
  EXPECT_GT(Loaded({kBox, "/bodies/0/fill/cells=4000"}).info().ntet, 2000u);
  const test::CommandResult said = test::deform({"explain", scene(), "--set", kBox, "--set", kFill});
  const test::CommandResult silent = test::deform({"explain", scene(), "--set", kBox});
  EXPECT_EQ(said.err.find("holds a surface and no cells"), std::string::npos) << said.err;
  EXPECT_NE(silent.err.find("body 'column': "), std::string::npos) << silent.err;
  EXPECT_NE(silent.err.find("holds a surface and no cells; it is filled with"), std::string::npos)
      << silent.err;
}

// box.obj is 0.2 m high.
TEST(SceneFill, FileOfManyMeters_IsSuspectedToBeInMillimetersUnlessTheSceneSaysItsScale) {
  std::string large = kBoxObj;
  for (size_t at = 0; (at = large.find("0.", at)) != std::string::npos;)
    large.replace(at, 3, large.substr(at + 2, 1) + "00");
  test::write_file(folder() + "/millimeters.obj", large);
  const auto reported = [](const std::string &mesh, const std::string &pose) {
    return test::deform({"explain", scene(), "--set", "/bodies/0/mesh=" + mesh, "--set", kFill, "--set",
                         "/bodies/0/pose=" + pose})
        .err;
  };
  const std::string hint = ": if millimeters.obj is in millimeters, set \"scale\": 0.001 in its \"pose\"";
  EXPECT_NE(reported("millimeters.obj", "{}").find(hint), std::string::npos)
      << reported("millimeters.obj", "{}");
  for (const char *scale : {"{\"scale\": 0.001}", "{\"scale\": 1}"})
    EXPECT_EQ(reported("millimeters.obj", scale).find("millimeters,"), std::string::npos) << scale;
  EXPECT_EQ(reported("box.obj", "{}").find("millimeters"), std::string::npos);
}

TEST(SceneFill, SurfacesMayBeOthers) {
  const Loaded boundary({kBox, kFill, R"(/bodies/0/surface={"from": "boundary"})"}),
      mls({kBox, kFill, R"(/bodies/0/surface={"coupling": "mls", "support": 2.5})"}),
      chosen({kBox, kFill, R"(/bodies/0/surface={"mesh": "box.obj"})"});
  EXPECT_GT(boundary.info().nsurfel, 8u);
  EXPECT_NE(boundary.explain().find("\"surface\":\"boundary\",\"filled\":true"), std::string::npos)
      << boundary.explain();
  EXPECT_GT(mls.info().nsurfel, 8u);
  EXPECT_EQ(chosen.info().nsurfel, 8u) << "what the scene names as surface is taken as it is";
  EXPECT_NE(mls.explain().find("\"surface\":\"own, mls\""), std::string::npos) << mls.explain();
  const Loaded tets({R"(/bodies/0/surface={"mesh": "box.obj"})"});
  EXPECT_EQ(tets.info().nsurfel, 8u);
  EXPECT_EQ(tets.info().ntet, 48u) << "cells from the file, with another skin";
}

// Force and torque are those of an even traction on the face, and what is held holds the face.
TEST(SceneFill, GroupsOfTheSurface_HoldAndLoad) {
  for (const char *where : {R"("group": "top")", R"("box": [[-1, -1, 0.1999], [1, 1, 0.2001]])"}) {
    const std::string set = std::string("/bodies/0/forces=[{") + where + R"(, "total": [0, 0, -2]}])";
    Loaded l({kBox, kFill, set.c_str()});
    test::ok(dfm_world_step(l.world, 1e-5, nullptr));
    const dfm_body_measure m = test::measure(l.body);
    EXPECT_NEAR(m.momentum[2], -2e-5, 1e-12) << where;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(m.angular[k], 0, 2e-8) << where << ": a push through the middle turns nothing";
  }
  for (const char *where : {R"("group": "bottom")", R"("box": [[-1, -1, -0.0001], [1, 1, 0.0001]])"}) {
    const std::string fix = std::string("/bodies/0/fix=[{") + where + "}]";
    Loaded l({kBox, kFill, fix.c_str(), R"(/bodies/0/forces=[{"group": "top", "total": [0.5, 0, -1]}])"});
    const std::vector<double> before = test::listed(dfm_surface_positions, l.body, 3);
    l.hash_after(30);
    const std::vector<double> after = test::listed(dfm_surface_positions, l.body, 3);
    for (size_t s = 0; 3 * s < before.size(); ++s) {
      const double moved = std::hypot(after[3 * s] - before[3 * s], after[3 * s + 1] - before[3 * s + 1],
                                      after[3 * s + 2] - before[3 * s + 2]);
      if (before[3 * s + 2] == 0) {
        EXPECT_EQ(moved, 0) << where;
      } else if (before[3 * s + 2] > 0.1) {
        EXPECT_GT(moved, 1e-4) << where;
      }
    }
  }
}

// What a cut asks for changes what is seen, by how much is said before the run.
TEST(SceneFill, BorderOfTheCells_IsReportedBeforeTheRun) {
  const std::string border = R"(/bodies/0/surface={"from": "boundary"})";
  for (const std::vector<std::string> &command :
       {std::vector<std::string>{"explain", scene()}, {"run", scene(), "--out", folder() + "/border"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--set", kBox, "--set", kFill});
    EXPECT_EQ(test::deform(arguments).err.find("is drawn and touches"), std::string::npos);
    arguments.insert(arguments.end(), {"--set", border});
    const std::string said = test::deform(arguments).err;
    for (const char *part : {"body 'column' is drawn and touches with the ", " triangles around its ",
                             " % more volume, not with the 12 triangles of box.obj"})
      EXPECT_NE(said.find(part), std::string::npos) << part << " in " << said;
  }
  const test::CommandResult cut = test::deform(
      {"explain", scene(), "--set", kBox, "--set", kFill, "--set",
       R"(/cuts=[{"body": "column", "t": 0, "shape": "plane", "point": [0, 0, 0.1], "normal": [0, 0, 1]}])"});
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_NE(cut.err.find("steps as large as its "), std::string::npos) << cut.err;
}

TEST(SceneFill, Probes_LieOnTheFillingCells) {
  Loaded l({kBox, kFill, R"(/probes=[{"name": "corner", "body": "column", "point": [0.1, 0.1, 0.2]}])",
            "/bodies/0/velocity=[1, 0, 0]"});
  const char *name = nullptr;
  double x[3], v[3];
  test::ok(dfm_scene_probe(l.s, 0, &name, x, v));
  EXPECT_NEAR(x[0], 0.1, 1e-14);
  EXPECT_NEAR(x[2], 0.2, 1e-14);
  EXPECT_NEAR(v[0], 1, 1e-14);
}

TEST(SceneFill, Outputs_AreOfTheFilesSurface) {
  const std::string out = folder() + "/out";
  const test::CommandResult result = test::deform(
      {"run", scene(), "--quiet", "--out", out, "--set", kBox, "--set", kFill, "--set",
       "/gravity=[0,0,-9.81]", "--set", "/output={\"nodes\": true, \"states\": true, \"every\": 0.01}"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto nodes = test::read_csv(out + "/nodes/column.csv");
  ASSERT_EQ(nodes.size(), 9u) << "a header and the eight points of the file";
  for (size_t i = 1; i < 9; ++i) {
    EXPECT_EQ(nodes[i][0], std::to_string(i - 1));
    EXPECT_NEAR(std::stod(nodes[i][3]), -0.5 * 9.81 * 0.01 * 0.011, 1e-9) << "free fall of ten steps";
  }
  EXPECT_NE(test::read_file(out + "/states/column_surface_000001.vtu")
                .find("NumberOfPoints=\"34\" NumberOfCells=\"64\""),
            std::string::npos)
      << "with those of split edges";
  EXPECT_EQ(test::read_file(out + "/states/column_000001.vtu").find("NumberOfPoints=\"8\""),
            std::string::npos)
      << "the cells' points";
}

TEST(SceneFill, Mistakes_AreReported) {
  expect_refused({kBox, "/bodies/0/fill={\"cells\": -1}"}, {"/bodies/0/fill/cells", "from 0"});
  expect_refused({kBox, "/bodies/0/fill={\"cells\": 100000001}"},
                 {"/bodies/0/fill/cells", "from 0 to 100000000, found 100000001"});
  expect_refused({kBox, "/bodies/0/fill={\"cells\": null}"}, {"/bodies/0/fill/cells", "found null"});
  expect_refused({kBox, "/bodies/0/fill={\"cells\": 10.5}"}, {"/bodies/0/fill/cells", "whole number"});
  expect_refused({kBox, "/bodies/0/fill={\"cell\": 10}"}, {"/bodies/0/fill/cell", "did you mean \"cells\"?"});
  expect_refused({kBox, "/bodies/0/fill={}"}, {"/bodies/0/fill", "\"cells\" is missing"});
  expect_refused({kBox, kFill, R"(/bodies/0/fields={"young": "values.csv"})"},
                 {"/bodies/0/fields/young", "not those of a file"});
  expect_refused({kBox, kFill, R"(/bodies/0/materials_by_group={"top": "hard"})"},
                 {"/bodies/0/materials_by_group/top", "no group"});
  expect_refused({kBox, kFill, "/bodies/0/nodal_bc=values.csv"}, {"/bodies/0/nodal_bc", "\"fix\""});
  expect_refused({kBox, kFill, R"(/bodies/0/fix=[{"group": "botom"}])"},
                 {"/bodies/0/fix/0/group", "did you mean \"bottom\"?"});
  expect_refused({kBox, kFill, R"(/bodies/0/forces=[{"group": "tpo", "total": [0, 0, 1]}])"},
                 {"/bodies/0/forces/0/group", "did you mean \"top\"?"});
  expect_refused(
      {kBox, kFill,
       R"(/bodies/0/forces=[{"box": [[-1, -1, 0.06], [1, 1, 0.09]], "total": [0, 0, 1], "by": "area"}])"},
      {"/bodies/0/forces/0/by", "no triangle of the surface"});
  expect_refused({kBox, kFill, R"(/bodies/0/fix=[{"box": [[5, 5, 5], [6, 6, 6]]}])"},
                 {"/bodies/0/fix/0/box", "no point"});
}

TEST(SceneSurface, Mistakes_AreReported) {
  expect_refused(R"(/bodies/0/surface={"mesh": "missing.obj"})", {"/bodies/0/surface/mesh", "missing.obj"});
  expect_refused(R"(/bodies/0/surface={"from": "boundary", "mesh": "box.obj"})",
                 {"/bodies/0/surface/mesh", "either"});
  expect_refused(R"(/bodies/0/surface={"coupling": "mls"})",
                 {"/bodies/0/surface/coupling", "needs \"mesh\""});
  expect_refused(R"(/bodies/0/surface={"from": "boundary", "coupling": "mls"})",
                 {"/bodies/0/surface/coupling", "boundary"});
  expect_refused(R"(/bodies/0/surface={"mesh": "box.obj", "coupling": "msl"})",
                 {"/bodies/0/surface/coupling", "did you mean \"mls\"?"});
  expect_refused(R"(/bodies/0/surface={"mesh": "box.obj", "support": 3})",
                 {"/bodies/0/surface/support", "mls and thesis"});
  expect_refused(R"(/bodies/0/surface={"mesh": "box.obj", "coupling": "mls", "support": 0})",
                 {"/bodies/0/surface/support", "from 0 (excluded) to 10"});
  expect_refused(R"(/bodies/0/surface={"mesh": "box.obj", "coupling": "mls", "support": 11})",
                 {"/bodies/0/surface/support", "to 10, found 11"});
  expect_refused(R"(/bodies/0/surface={"mseh": "box.obj"})",
                 {"/bodies/0/surface/mseh", "did you mean \"mesh\"?"});
  expect_refused(R"(/bodies/0/surface={"from": "inside"})", {"/bodies/0/surface/from", "boundary"});
}

TEST(FileCells, AreTheFilesNumbers_WhereADoubleWasDropped) {
  test::Context context;
  folder();
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_load(context, (folder() + "/column.msh").c_str(), DFM_MESH_CELLS, &mesh));
  const uint32_t *const cells = test::info_of(mesh).file_cell;
  ASSERT_NE(cells, nullptr);
  EXPECT_EQ(cells[0], 0u);
  EXPECT_EQ(cells[1], 2u) << "number 1 was a double of number 0";
  EXPECT_EQ(cells[47], 48u);
  const double size[3] = {1, 1, 1};
  dfm_mesh_handle whole = 0;
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 20, &whole));
  EXPECT_EQ(test::info_of(whole).file_cell, nullptr) << "none was dropped";
}
