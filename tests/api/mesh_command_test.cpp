// `deform mesh` as a user calls it, and the mesh functions of the C API.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <thread>

#include "deform/deform.h"
#include "logged_context.h"
#include "support.h"

namespace {

std::string folder() { return test::scratch("mesh_command"); }
std::string own(const std::string &name) {
  return std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/" + name;
}
bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }

}  // namespace

TEST(MeshCommand, Info_PrintsCountsGroupsAndWarnings) {
  const auto r = test::deform({"mesh", "info", own("cube_msh41_ascii.msh")});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word :
       {"points            8", "tetrahedra        6", "surface triangles 12", "edges             19",
        "volume            1 m3", "skin (triangles, 8 points)", "high end (cells, 6 points)",
        "explicit sub-step about 0.4082 m", "m: least altitude 0.707 m, alone 0.408 m",
        "warning: 1 point that no cell uses was dropped"})
    EXPECT_TRUE(has(r.out, word)) << word << " not in\n" << r.out;
}

TEST(MeshCommand, InfoAsJson_HoldsTheSame) {
  const auto r = test::deform({"mesh", "info", "--json", own("cube_msh22_bin_be.msh")});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word : {"\"points\": 8", "\"tets\": 6", "\"surface_triangles\": 12", "\"edges\": 19",
                           "\"pieces\": 1", "\"dropped_points\": 1", "\"name\": \"high end\""})
    EXPECT_TRUE(has(r.out, word)) << word << " not in\n" << r.out;
}

// Two cubes, the second moved by half a side, as a surface and as cells; apart they do not cross.
TEST(MeshCommand, Info_CountsWhereTheSurfaceCrossesItself) {
  const auto corner = [](int k, double by) {
    char text[80];
    std::snprintf(text, sizeof text, "%g %g %g\n", (k & 1) + by, (k >> 1 & 1) + by, (k >> 2) + by);
    return std::string(text);
  };
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const bool apart : {false, true}) {
    std::string surface = "OFF\n16 24 0\n";
    std::string cells =
        "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n";
    for (int k = 0; k < 16; ++k) surface += corner(k % 8, k < 8 ? 0 : apart ? 2 : 0.3);
    for (int k = 0; k < 24; ++k) {
      surface += "3";
      for (const int p : faces[k % 12]) surface += " " + std::to_string(p + (k < 12 ? 0 : 8));
      surface += "\n";
    }
    for (const double by : {0.0, apart ? 2.0 : 0.1})
      for (const int k : {0, 1, 2, 4}) cells += corner(k, by);
    cells += "CELLS 2 10\n4 0 1 2 3\n4 4 5 6 7\nCELL_TYPES 2\n10\n10\n";
    test::write_file(folder() + "/two.off", surface);
    test::write_file(folder() + "/two.vtk", cells);
    for (const char *const name : {"/two.off", "/two.vtk"}) {
      const auto r = test::deform({"mesh", "info", folder() + name});
      EXPECT_EQ(r.exit_code, 0) << r.err;
      EXPECT_EQ(has(r.out, "warning: the surface crosses itself in "), !apart) << r.out;
      const auto json = test::deform({"mesh", "info", "--json", folder() + name});
      EXPECT_EQ(has(json.out, "\"self_crossings\": 0"), apart) << json.out;
    }
  }
}

// Ctrl-C in work that would take long: the command ends by the signal, and what lay under the name that it
// was to write is still there, alone.
TEST(MeshCommand, InterruptedWork_EndsAndLeavesTheOldFile) {
  const std::string dir = folder() + "/interrupted", ball = folder() + "/interrupted_ball.obj";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--surface", "--cells", "2000", "--quiet", "--out", ball})
                .exit_code,
            0);
  const std::string out = dir + "/old.msh";
  const std::vector<std::vector<std::string>> work = {
      {DEFORM_COMMAND, "mesh", "fill", ball, "--cells", "50000000", "--quiet", "--out", out},
      {DEFORM_COMMAND, "mesh", "make", "ball", "--cells", "50000000", "--quiet", "--out", out}};
  for (const auto &arguments : work) {
    std::filesystem::remove_all(dir);
    std::filesystem::create_directories(dir);
    test::write_file(out, "mine");
    const pid_t child = test::start(arguments, "/dev/null", dir + ".err");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    kill(child, SIGINT);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) << arguments[2] << ": status " << status;
    EXPECT_EQ(test::read_file(dir + ".err"),
              "deform: interrupted before its work was done; no unfinished file is left\n");
    EXPECT_EQ(test::read_file(out), "mine");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir), {}), 1);
  }
}

TEST(MeshCommand, Make_WritesEachShape) {
  const std::vector<std::vector<std::string>> shapes = {
      {"cylinder", "--radius", "0.2", "--length", "1"},
      {"beam", "--size", "1", "0.1", "0.2"},
      {"ball", "--radius", "0.05"},
      {"tube", "--inner", "0.1", "--radius", "0.2", "--length", "0.5"}};
  for (const auto &shape : shapes)
    for (const char *ending : {".msh", ".msh2", ".vtk", ".vtu", ".mesh"}) {
      const std::string out = folder() + "/" + shape[0] + ending;
      std::vector<std::string> args = {"mesh", "make"};
      args.insert(args.end(), shape.begin(), shape.end());
      args.insert(args.end(), {"--cells", "600", "--out", out});
      const auto made = test::deform(args);
      EXPECT_EQ(made.exit_code, 0) << made.err;
      EXPECT_EQ(test::deform({"mesh", "info", out}).exit_code, 0);
    }
}

// A ball has 20 n^3 cells: 160 are nearest to 100. What is near enough to "about" is not spoken of.
TEST(MeshCommand, MakeOfAnotherNumberOfCells_SaysSo) {
  const auto said = [](const char *cells) {
    const auto r = test::deform({"mesh", "make", "ball", "--cells", cells, "--out", folder() + "/about.vtu"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return r.err;
  };
  EXPECT_TRUE(has(said("100"), "160 tetrahedra are made where 100 were asked for: the lattice of a ball"));
  EXPECT_EQ(said("500"), "");
}

TEST(MeshCommand, MakeOfSecondOrder_IsOfCells) {
  const std::string obj = folder() + "/second.obj", vtu = folder() + "/second.vtu";
  const auto made = [](const std::string &out, const char *order) {
    return test::deform({"mesh", "make", "beam", "--cells", "50", "--out", out, "--order", order});
  };
  EXPECT_TRUE(has(made(obj, "2").err, "--order 2 is of cells, and this is a surface"));
  EXPECT_EQ(made(vtu, "3").exit_code, 2);
  const std::string bricks = folder() + "/bricks.vtk", msh = folder() + "/bricks.msh";
  ASSERT_EQ(
      test::deform({"mesh", "make", "bricks", "--cells", "10", "--order", "2", "--out", bricks}).exit_code,
      0);
  ASSERT_EQ(test::deform({"mesh", "convert", bricks, msh}).exit_code, 0);
  EXPECT_TRUE(has(test::deform({"mesh", "info", msh}).out, "10 hexahedra of 27 points"));
  EXPECT_EQ(made(vtu, "2").exit_code, 0);
  const auto info = test::deform({"mesh", "info", vtu});
  EXPECT_TRUE(has(info.out, "second-order tetrahedra"));
  EXPECT_FALSE(has(info.out, "explicit sub-step"));
}

TEST(MeshCommand, Convert_ThereAndBackKeepsTheBytes) {
  const std::string a = folder() + "/a.msh", b = folder() + "/b.vtk", c = folder() + "/c.msh";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--out", a, "--cells", "300", "--quiet"}).exit_code, 0);
  ASSERT_EQ(test::deform({"mesh", "convert", a, b}).exit_code, 0);
  ASSERT_EQ(test::deform({"mesh", "convert", b, c}).exit_code, 0);
  EXPECT_EQ(test::read_file(a), test::read_file(c));
}

TEST(MeshCommand, MakeSurface_ByEndingOrByFlag) {
  const std::vector<std::vector<std::string>> shapes = {{"cylinder", "--radius", "0.2", "--length", "1"},
                                                        {"beam", "--size", "1", "0.1", "0.2"},
                                                        {"ball", "--radius", "0.05"},
                                                        {"tube", "--inner", "0.1", "--radius", "0.2"},
                                                        {"torus", "--ring", "0.3", "--radius", "0.1"}};
  for (const auto &shape : shapes)
    for (const char *ending : {".obj", ".ply", ".stl", ".off", ".vtk", ".vtu"}) {
      const std::string out = folder() + "/" + shape[0] + "_surface" + ending;
      std::vector<std::string> args = {"mesh", "make"};
      args.insert(args.end(), shape.begin(), shape.end());
      args.insert(args.end(), {"--surface", "--cells", "500", "--out", out});
      const auto made = test::deform(args);
      EXPECT_EQ(made.exit_code, 0) << made.err;
      const auto reported = test::deform({"mesh", "info", "--json", out});
      EXPECT_EQ(reported.exit_code, 0) << reported.err;
      EXPECT_TRUE(has(reported.out, "\"kind\": \"surface\"") && has(reported.out, "\"open_edges\": 0"))
          << reported.out;
    }
  const auto plain =
      test::deform({"mesh", "make", "ball", "--out", folder() + "/plain.obj", "--cells", "100"});
  EXPECT_TRUE(has(plain.out, "plain.obj: 42 points, 80 triangles, closed, least quality")) << plain.out;
}

TEST(MeshCommand, InfoOfASurface_ReportsHolesGroupsAndRepairs) {
  const std::string file = folder() + "/open.obj";
  test::write_file(
      file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\ng sole\nf 1 3 2\ng side\nf 1 2 4\nf 1 3 4\n");
  const auto r = test::deform({"mesh", "info", file});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word :
       {"points            4", "triangles         3", "pieces            1",
        "group             sole (1 triangles)",
        "closed            no, 3 open edges around 1 hole, 0 edges of more than two triangles",
        "area              1.5 m2", "0.8 to 0.9      3         ########",
        "warning: 1 of 3 triangles faced the wrong way and was turned",
        "warning: 1 point that no triangle uses was dropped"})
    EXPECT_TRUE(has(r.out, word)) << word << " not in\n" << r.out;
  const auto json = test::deform({"mesh", "info", "--json", file});
  for (const char *word :
       {"\"kind\": \"surface\"", "\"triangles\": 3", "\"turned\": 1", "\"holes\": 1", "\"open_edges\": 3",
        "\"dropped_points\": 1", "\"name\": \"side\"", "\"triangles\": 2"})
    EXPECT_TRUE(has(json.out, word)) << word << " not in\n" << json.out;
}

// A file of triangles names no unit: a part of 68 mm is read as one of 68 m.
TEST(MeshCommand, MeshOfManyMeters_IsSuspectedToBeInMillimeters) {
  const std::string large = folder() + "/millimeters.stl", small = folder() + "/meters.stl";
  for (const auto &[file, radius] : {std::pair{large, "34"}, {small, "0.034"}})
    ASSERT_EQ(
        test::deform({"mesh", "make", "ball", "--surface", "--radius", radius, "--out", file}).exit_code, 0);
  const std::string hint = "if the file is in millimeters, ", cells = folder() + "/millimeters.vtu";
  const auto reported = test::deform({"mesh", "info", large});
  EXPECT_TRUE(has(reported.out, "warning: it is 67.7 m long: " + hint)) << reported.out;
  const auto filled = test::deform({"mesh", "fill", large, "--cells", "300", "--out", cells});
  EXPECT_TRUE(has(filled.out, "warning: it is 67.7 m long: " + hint)) << filled.out;
  EXPECT_TRUE(has(filled.out, "}, \"pose\": {\"scale\": 0.001}\n")) << filled.out;
  EXPECT_FALSE(has(test::deform({"mesh", "info", small}).out, hint));
  EXPECT_FALSE(has(test::deform({"mesh", "fill", small, "--cells", "300", "--out", cells}).out, hint));
}

TEST(MeshCommand, ConvertCellsToASurface_WritesAndReportsTheBoundary) {
  const std::string ball = folder() + "/body.msh", skin = folder() + "/skin.stl";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--out", ball, "--cells", "160", "--quiet"}).exit_code, 0);
  const auto r = test::deform({"mesh", "convert", ball, skin});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.err, "not kept: 160 tetrahedra, of which .stl holds the boundary alone")) << r.err;
  EXPECT_TRUE(has(r.err, "not kept: digits beyond the first 7 (STL stores single precision)")) << r.err;
  EXPECT_TRUE(has(r.out, "skin.stl: 42 points, 80 triangles, closed")) << r.out;
  EXPECT_EQ(test::read_file(skin).size(), 84u + 50 * 80);
  const auto json = test::deform({"mesh", "convert", "--json", ball, skin});
  EXPECT_TRUE(has(json.out, "\"lost\": [")) << json.out;
}

TEST(MeshCommand, ConvertSurfaces_ThereAndBackKeepsTheBytes) {
  const std::string a = folder() + "/s.ply";
  const std::string b = folder() + "/s.obj";
  const std::string c = folder() + "/s.vtu";
  const std::string d = folder() + "/s.off";
  const std::string e = folder() + "/t.ply";
  ASSERT_EQ(test::deform({"mesh", "make", "torus", "--out", a, "--cells", "300", "--quiet"}).exit_code, 0);
  for (const auto &[from, to] : {std::pair{a, b}, {b, c}, {c, d}, {d, e}})
    ASSERT_EQ(test::deform({"mesh", "convert", from, to}).exit_code, 0);
  EXPECT_EQ(test::read_file(a), test::read_file(e));
}

TEST(MeshCommand, ConvertIntoItsInput_IsRefused) {
  const std::string mesh = std::string(DEFORM_SOURCE_DIR) + "/examples/data/block.msh";
  const test::CommandResult r = test::deform({"mesh", "convert", mesh, mesh});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("would be overwritten"), std::string::npos) << r.err;
}

TEST(MeshCommand, ConvertWithGroups_ReportsWhatIsLost) {
  const std::string file = folder() + "/groups.obj";
  test::write_file(file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ng a\nf 1 2 3\ng b\nf 2 4 3\n");
  EXPECT_TRUE(has(test::deform({"mesh", "convert", file, folder() + "/groups.off"}).err,
                  "not kept: 2 groups of triangles"))
      << "OFF has none";
  EXPECT_TRUE(
      has(test::deform({"mesh", "convert", file, folder() + "/groups.ply"}).err, "not kept: names of groups"))
      << "PLY has numbers";
  const auto kept = test::deform({"mesh", "convert", file, folder() + "/groups.vtu"});
  EXPECT_FALSE(has(kept.err, "not kept")) << kept.err;
  EXPECT_TRUE(
      has(test::deform({"mesh", "info", folder() + "/groups.vtu"}).out, "group             b (1 triangles)"));
}

// A triangle in glTF: read where the command is built with assimp, else a sentence that says how.
TEST(MeshCommand, ConvertForeignFormat_ReadsItOrExplainsHow) {
  const std::string file = folder() + "/triangle.gltf", out = folder() + "/triangle.obj";
  test::write_file(file,
                   R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],
    "buffers":[{"byteLength":44,
      "uri":"data:application/octet-stream;base64,AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAA)"
                   R"(AAAAAAAAAAAAACAPwAAAAA="}],
    "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":6,"target":34963},
      {"buffer":0,"byteOffset":8,"byteLength":36,"target":34962}],
    "accessors":[{"bufferView":0,"byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR",
      "max":[2],"min":[0]},
      {"bufferView":1,"byteOffset":0,"componentType":5126,"count":3,"type":"VEC3",
      "max":[1,1,0],"min":[0,0,0]}]})");
  const auto r = test::deform({"mesh", "convert", file, out});
  if (has(r.err, "built without")) {
    test::expect_refused({"mesh", "convert", file, out}, {"triangle.gltf", ".gltf is read through assimp",
                                                          "libassimp-dev", "DEFORM_ASSIMP=ON"});
    EXPECT_FALSE(std::filesystem::exists(out));
  } else {
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(has(r.out, "triangle.obj: 3 points, 1 triangles")) << r.out;
    EXPECT_TRUE(has(r.err, "not kept: materials")) << r.err;
    test::write_file(file, "{\"asset\": ");
    test::expect_refused({"mesh", "convert", file, out}, {"triangle.gltf"});
  }
}

TEST(MeshCommand, SurfaceWithASpaceInItsName_IsFilledByTheCommandThatTheErrorNames) {
  const std::string ball = folder() + "/a ball.stl";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--quiet", "--out", ball}).exit_code, 0);
  const std::string cells = folder() + "/a ball.vtu";
  test::expect_refused({"mesh", "convert", ball, folder() + "/a ball.msh"},
                       {"deform mesh fill '" + ball + "' --out '" + cells + "'"});
}

TEST(MeshCommand, Fill_PrintsTheBodyOfAScene) {
  const auto here = [](const std::string &path) {
    return std::filesystem::proximate(path, std::filesystem::current_path()).string();
  };
  const std::string ball = folder() + "/to fill.obj", cells = folder() + "/cells.vtu";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--surface", "--out", ball}).exit_code, 0);
  const auto r = test::deform({"mesh", "fill", here(ball), "--cells", "300", "--out", here(cells)});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "\"mesh\": \"" + cells + "\", \"surface\": {\"mesh\": \"" + ball + "\"}"))
      << r.out << cells;
}

TEST(MeshCommand, BadInput_ExitsTwoWithOneSentence) {
  test::write_file(folder() + "/flat.vtk",
                   "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 "
                   "0\n1 0 0\n0 1 0\n1 1 0\n"
                   "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n");
  test::write_file(folder() + "/points.obj", "v 0 0 0\n");
  test::write_file(folder() + "/sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  test::write_file(folder() + "/line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  const std::string ball = folder() + "/never.msh", sheet = folder() + "/sheet.obj";
  test::expect_refused({"mesh", "info", folder() + "/none.msh"}, {"none.msh", "No such file"});
  test::expect_refused({"mesh", "info", folder()}, {"directory"});
  test::expect_refused({"mesh", "info", folder() + "/flat.vtk"}, {"flat.vtk", "flat"});
  test::expect_refused({"mesh", "info", folder() + "/points.obj"}, {"points.obj"});
  test::expect_refused({"mesh", "info", folder() + "/line.obj"}, {"line.obj", "without area"});
  test::expect_refused({"mesh", "convert", sheet, ball}, {"sheet.obj is a surface", "deform mesh fill"});
  EXPECT_FALSE(std::filesystem::exists(ball));
  test::expect_refused({"mesh", "convert", sheet, folder() + "/x.xyz"}, {".xyz", ".obj"});
  test::expect_refused({"mesh", "convert", own("cube_vtk20_ascii.vtk"), folder() + "/x.xyz"},
                       {"x.xyz", ".msh"});
  test::expect_refused({"mesh", "make", "torus", "--out", ball}, {"torus", "surface", "fill"});
  test::expect_refused({"mesh", "make", "ball", "--surface", "--out", ball}, {"never.msh", ".obj"});
  test::expect_refused({"mesh", "make", "tube", "--inner", "0.3", "--radius", "0.2", "--out", ball},
                       {"inner radius is 0.3 m"});
  test::expect_refused(
      {"mesh", "make", "torus", "--ring", "0.1", "--radius", "0.2", "--out", folder() + "/t.obj"},
      {"torus", "0.2 m"});
  test::expect_refused({"mesh", "make", "ball", "--out", folder() + "/none/b.msh"},
                       {"none/b.msh", "No such file"});
  test::expect_refused({"mesh", "make", "ball", "--out", ball, "--radius", "-1"},
                       {"radius", "-1", "above 0"});
  test::expect_refused({"mesh", "make", "ball", "--out", ball, "--radius", "nan"}, {"radius"});
  test::expect_refused({"mesh", "make", "ball", "--out", ball, "--cells", "0"}, {"cells is 0"});
  test::expect_refused({"mesh", "make", "ball", "--out", folder() + "/b.obj", "--cells", "0"},
                       {"triangles is 0"});
  for (const char *wrong : {"-5", "1e9", "1.5", "many", "99999999999999999999"})
    for (const std::vector<std::string> &call :
         {std::vector<std::string>{"mesh", "make", "ball"}, {"mesh", "fill", sheet}}) {
      std::vector<std::string> args = call;
      args.insert(args.end(), {"--out", ball, "--cells", wrong});
      test::expect_refused(args, {"--cells", "whole number", std::string("found \"") + wrong + "\""});
    }
  test::expect_refused({"mesh", "make", "ball", "--out", ball, "--radius", "wide"},
                       {"--radius", "expected a number, found \"wide\""});
  test::expect_refused({"mesh", "make", "ball"}, {"--out"});
  test::expect_refused({"mesh", "make", "bal", "--out", ball}, {"bal", "ball"});
  test::expect_refused({"mesh", "inof", ball}, {"inof", "info"});
  test::expect_refused({"mesh"}, {"info"});
}

TEST(MeshApi, Read_ReportsWarningsAndLendsArrays) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 0;
  ASSERT_EQ(dfm_mesh_load(c.context, own("cube_msh41_bin_be.msh").c_str(), DFM_MESH_CELLS, &mesh), DFM_OK)
      << dfm_last_error();
  EXPECT_TRUE(has(c.log, "cube_msh41_bin_be.msh: 1 point that no cell uses was dropped")) << c.log;
  dfm_mesh_info info = {};
  info.size = sizeof info;
  ASSERT_EQ(dfm_mesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.npoint, 8u);
  EXPECT_EQ(info.ngroup, 3u);
  EXPECT_STREQ(info.warnings, "1 point that no cell uses was dropped\n");
  EXPECT_EQ(info.file_point[2], 3u);
  EXPECT_STREQ(info.group_names[info.cell_group[5]], "high end");
  EXPECT_EQ(info.group_dimension[0], 2u);
  EXPECT_EQ(info.group_npoint[0], 8u);
  EXPECT_EQ(dfm_mesh_destroy(mesh), DFM_OK);
  EXPECT_EQ(dfm_mesh_get_info(mesh, &info), DFM_E_HANDLE);
  EXPECT_EQ(dfm_mesh_destroy(mesh), DFM_E_HANDLE);
}

TEST(MeshApi, OlderInfoStruct_IsFilledUpToItsSize) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 0;
  const double size[3] = {0.1, 0, 0};
  ASSERT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_CELLS, 100, &mesh), DFM_OK);
  dfm_mesh_info info;
  std::memset(&info, 0xee, sizeof info);
  info.size = offsetof(dfm_mesh_info, turned);
  ASSERT_EQ(dfm_mesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.ntet, 160u);
  EXPECT_EQ(info.turned, 0xeeeeeeeeu);
}

TEST(MeshApi, ContextDestroyed_TakesItsMeshesAlong) {
  dfm_mesh_handle mesh = 0;
  const double size[3] = {1, 1, 1};
  {
    test::LoggedContext c;
    ASSERT_EQ(dfm_mesh_make(c.context, "beam", size, DFM_MESH_CELLS, 10, &mesh), DFM_OK);
  }
  dfm_mesh_info info = {};
  EXPECT_EQ(dfm_mesh_get_info(mesh, &info), DFM_E_HANDLE);
}

TEST(MeshApi, WrongArguments_LeaveTheOutputAlone) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 77;
  const double size[3] = {1, 1, 1};
  EXPECT_EQ(dfm_mesh_make(c.context, "cone", size, DFM_MESH_CELLS, 10, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "cylinder, beam, bricks, ball or tube"));
  EXPECT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_CELLS, 0, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_make(nullptr, "ball", size, DFM_MESH_CELLS, 10, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_make(c.context, "ball", nullptr, DFM_MESH_CELLS, 10, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_ANY, 10, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "'ball': what is 0; expected DFM_MESH_CELLS or DFM_MESH_SURFACE"));
  EXPECT_EQ(dfm_mesh_load(c.context, nullptr, DFM_MESH_CELLS, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_load(c.context, own("none.msh").c_str(), 3, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "what is 3; expected DFM_MESH_ANY"));
  EXPECT_EQ(dfm_mesh_load(c.context, own("none.msh").c_str(), DFM_MESH_CELLS, &mesh), DFM_E_IO);
  EXPECT_EQ(mesh, 77u);
}

TEST(MeshApi, SurfaceGroupInAScene_HoldsItsPoints) {
  const auto top_after_a_step = [](const std::string &fix) {
    const std::string scene = folder() + "/group" + std::to_string(fix.size()) + ".json";
    test::write_file(scene,
                     "{\"format\": \"deform-scene\", \"version\": 1, \"time\": {\"duration\": 1, \"step\": "
                     "0.0001}, \"bodies\": [{\"name\": \"cube\", \"mesh\": \"" +
                         own("cube_msh41_ascii.msh") + "\"" + fix + "}]}");
    test::LoggedContext c;
    dfm_world world = 0;
    dfm_body body = 0;
    double x[24] = {};
    uint32_t n = 0;
    EXPECT_EQ(dfm_scene_load(c.context, scene.c_str(), &world), DFM_OK) << dfm_last_error();
    EXPECT_EQ(dfm_world_step(world, 1e-4, nullptr), DFM_OK) << dfm_last_error();
    EXPECT_EQ(dfm_world_find_body(world, "cube", &body), DFM_OK);
    EXPECT_EQ(dfm_body_get_state(body, 8, x, nullptr, &n), DFM_OK) << dfm_last_error();
    return x[23];
  };
  EXPECT_LT(top_after_a_step(""), 1.0);
  EXPECT_EQ(top_after_a_step(", \"fix\": [{\"group\": \"skin\"}]"), 1.0);
}
