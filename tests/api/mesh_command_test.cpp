// `deform mesh` as a user calls it, and the mesh functions of the C API.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <filesystem>

#include "deform/deform.h"
#include "support.h"

namespace {

std::string folder() { return test::scratch("mesh_command"); }
std::string own(const std::string &name) { return std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/" + name; }
bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }
size_t lines(const std::string &text) { return size_t(std::count(text.begin(), text.end(), '\n')); }

void expect_refused(const std::vector<std::string> &args, const std::vector<std::string> &words) {
  const auto r = test::deform(args);
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_EQ(lines(r.err), 1u) << r.err;
  EXPECT_TRUE(r.out.empty()) << r.out;
  for (const auto &word : words) EXPECT_TRUE(has(r.err, word)) << "no '" << word << "' in: " << r.err;
}

struct Context {
  dfm_context *context = nullptr;
  std::string log;
  Context() {
    dfm_context_def def = dfm_context_def_default();
    def.user = this;
    def.log = [](void *user, int32_t, const char *text) { static_cast<Context *>(user)->log += std::string(text) + "\n"; };
    EXPECT_EQ(dfm_context_create(&def, &context), DFM_OK);
  }
  ~Context() { dfm_context_destroy(context); }
};

}  // namespace

TEST(MeshCommand, Info_PrintsCountsGroupsAndWarnings) {
  const auto r = test::deform({"mesh", "info", own("cube_msh41_ascii.msh")});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word : {"points            8", "tetrahedra        6", "surface triangles 12", "edges             19",
                           "volume            1 m3", "skin (triangles, 8 points)", "high end (cells, 6 points)",
                           "warning: 1 point that no tetrahedron uses was dropped"})
    EXPECT_TRUE(has(r.out, word)) << word << " not in\n" << r.out;
}

TEST(MeshCommand, InfoAsJson_HoldsTheSame) {
  const auto r = test::deform({"mesh", "info", "--json", own("cube_msh22_bin_be.msh")});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word : {"\"points\": 8", "\"tets\": 6", "\"surface_triangles\": 12", "\"edges\": 19", "\"pieces\": 1",
                           "\"dropped_points\": 1", "\"name\": \"high end\""})
    EXPECT_TRUE(has(r.out, word)) << word << " not in\n" << r.out;
}

TEST(MeshCommand, Make_WritesEachShape) {
  const std::vector<std::vector<std::string>> shapes = {
      {"cylinder", "--radius", "0.2", "--length", "1"}, {"beam", "--size", "1", "0.1", "0.2"}, {"ball", "--radius", "0.05"}};
  for (const auto &shape : shapes)
    for (const char *ending : {".msh", ".msh2", ".vtk"}) {
      const std::string out = folder() + "/" + shape[0] + ending;
      std::vector<std::string> args = {"mesh", "make"};
      args.insert(args.end(), shape.begin(), shape.end());
      args.insert(args.end(), {"--cells", "600", "--out", out});
      const auto made = test::deform(args);
      EXPECT_EQ(made.exit_code, 0) << made.err;
      EXPECT_EQ(test::deform({"mesh", "info", out}).exit_code, 0);
    }
}

TEST(MeshCommand, Convert_ThereAndBackKeepsTheBytes) {
  const std::string a = folder() + "/a.msh", b = folder() + "/b.vtk", c = folder() + "/c.msh";
  ASSERT_EQ(test::deform({"mesh", "make", "ball", "--out", a, "--cells", "300", "--quiet"}).exit_code, 0);
  ASSERT_EQ(test::deform({"mesh", "convert", a, b}).exit_code, 0);
  ASSERT_EQ(test::deform({"mesh", "convert", b, c}).exit_code, 0);
  EXPECT_EQ(test::read_file(a), test::read_file(c));
}

TEST(MeshCommand, BadInput_ExitsTwoWithOneSentence) {
  test::write_file(folder() + "/flat.vtk",
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
      "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n");
  test::write_file(folder() + "/surface.obj", "v 0 0 0\n");
  const std::string ball = folder() + "/ball.msh";
  expect_refused({"mesh", "info", folder() + "/none.msh"}, {"none.msh", "No such file"});
  expect_refused({"mesh", "info", folder()}, {"ending"});
  expect_refused({"mesh", "info", folder() + "/flat.vtk"}, {"flat.vtk", "flat"});
  expect_refused({"mesh", "info", folder() + "/surface.obj"}, {"not available yet", ".msh", ".vtk"});
  expect_refused({"mesh", "convert", own("cube_vtk20_ascii.vtk"), folder() + "/x.obj"}, {"not available yet", ".msh"});
  EXPECT_FALSE(std::filesystem::exists(folder() + "/x.obj"));
  expect_refused({"mesh", "fill", folder() + "/surface.obj", "--out", ball, "--cells", "5"}, {"not available yet"});
  expect_refused({"mesh", "make", "ball", "--out", folder() + "/none/b.msh"}, {"none/b.msh", "No such file"});
  expect_refused({"mesh", "make", "ball", "--out", ball, "--radius", "-1"}, {"radius", "-1", "above 0"});
  expect_refused({"mesh", "make", "ball", "--out", ball, "--radius", "nan"}, {"radius"});
  expect_refused({"mesh", "make", "ball", "--out", ball, "--cells", "0"}, {"cells is 0"});
  expect_refused({"mesh", "make", "ball"}, {"--out"});
  expect_refused({"mesh", "make", "bal", "--out", ball}, {"bal", "ball"});
  expect_refused({"mesh", "inof", ball}, {"inof", "info"});
  expect_refused({"mesh"}, {"info"});
}

TEST(MeshApi, Read_TellsWarningsAndLends) {
  Context c;
  dfm_tetmesh mesh = 0;
  ASSERT_EQ(dfm_tetmesh_read(c.context, own("cube_msh41_bin_be.msh").c_str(), &mesh), DFM_OK) << dfm_last_error();
  EXPECT_TRUE(has(c.log, "cube_msh41_bin_be.msh: 1 point that no tetrahedron uses was dropped")) << c.log;
  dfm_tetmesh_info info = {};
  info.size = sizeof info;
  ASSERT_EQ(dfm_tetmesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.npoint, 8u);
  EXPECT_EQ(info.ngroup, 3u);
  EXPECT_STREQ(info.warnings, "1 point that no tetrahedron uses was dropped\n");
  const double *points = nullptr;
  const uint32_t *tets = nullptr, *place = nullptr, *group = nullptr, *skin = nullptr;
  const char *const *names = nullptr;
  ASSERT_EQ(dfm_tetmesh_data(mesh, &points, &tets, &place), DFM_OK);
  EXPECT_EQ(place[2], 3u);
  ASSERT_EQ(dfm_tetmesh_groups(mesh, &names, &group), DFM_OK);
  EXPECT_STREQ(names[group[5]], "high end");
  uint32_t dimension = 9, n = 0;
  ASSERT_EQ(dfm_tetmesh_group_points(mesh, 0, &dimension, &skin, &n), DFM_OK);
  EXPECT_EQ(dimension, 2u);
  EXPECT_EQ(n, 8u);
  EXPECT_EQ(dfm_tetmesh_group_points(mesh, 3, nullptr, nullptr, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_destroy(mesh), DFM_OK);
  EXPECT_EQ(dfm_tetmesh_get_info(mesh, &info), DFM_E_HANDLE);
  EXPECT_EQ(dfm_tetmesh_destroy(mesh), DFM_E_HANDLE);
}

TEST(MeshApi, OlderInfoStruct_IsFilledAsFarAsItGoes) {
  Context c;
  dfm_tetmesh mesh = 0;
  const double size[3] = {0.1, 0, 0};
  ASSERT_EQ(dfm_tetmesh_make(c.context, "ball", size, 100, &mesh), DFM_OK);
  dfm_tetmesh_info info;
  std::memset(&info, 0xee, sizeof info);
  info.size = offsetof(dfm_tetmesh_info, turned);
  ASSERT_EQ(dfm_tetmesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.ntet, 160u);
  EXPECT_EQ(info.turned, 0xeeeeeeeeu);
}

TEST(MeshApi, ContextDestroyed_TakesItsMeshesAlong) {
  dfm_tetmesh mesh = 0;
  const double size[3] = {1, 1, 1};
  {
    Context c;
    ASSERT_EQ(dfm_tetmesh_make(c.context, "beam", size, 10, &mesh), DFM_OK);
  }
  EXPECT_EQ(dfm_tetmesh_data(mesh, nullptr, nullptr, nullptr), DFM_E_HANDLE);
}

TEST(MeshApi, WrongArguments_LeaveTheOutputAlone) {
  Context c;
  dfm_tetmesh mesh = 77;
  const double size[3] = {1, 1, 1};
  EXPECT_EQ(dfm_tetmesh_make(c.context, "cone", size, 10, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "cylinder, beam, ball or tube"));
  EXPECT_EQ(dfm_tetmesh_make(c.context, "ball", size, 0, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_make(nullptr, "ball", size, 10, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_make(c.context, "ball", nullptr, 10, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_read(c.context, nullptr, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_read(c.context, own("none.msh").c_str(), &mesh), DFM_E_IO);
  EXPECT_EQ(mesh, 77u);
}

TEST(MeshApi, SurfaceGroupInAScene_HoldsItsPoints) {
  const auto top_after_a_step = [](const std::string &fix) {
    const std::string scene = folder() + "/group" + std::to_string(fix.size()) + ".json";
    test::write_file(scene, "{\"format\": \"deform-scene\", \"version\": 1, \"time\": {\"duration\": 1, \"step\": 0.0001}, \"bodies\": "
                            "[{\"name\": \"cube\", \"mesh\": \"" + own("cube_msh41_ascii.msh") + "\"" + fix + "}]}");
    Context c;
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
