// Filling through the public door and the command: shares, warnings, refusals.
#include <cmath>

#include "support.h"
#include "world.h"

namespace {

struct Filled {
  test::Context context;
  dfm_trimesh surface = 0;
  dfm_tetmesh mesh = 0;
  explicit Filled(const char *kind, std::array<double, 3> size, uint32_t triangles) {
    test::ok(dfm_trimesh_make(context, kind, size.data(), triangles, &surface));
  }
};

}  // namespace

TEST(TetmeshFill, Torus_SharesSumUpToItsVolume) {
  Filled f("torus", {0.1, 0.03, 0}, 4000);
  test::ok(dfm_tetmesh_fill(f.surface, 2000, &f.mesh));
  dfm_tetmesh_info info{};
  info.size = sizeof info;
  test::ok(dfm_tetmesh_get_info(f.mesh, &info));
  dfm_trimesh_info skin{};
  skin.size = sizeof skin;
  test::ok(dfm_trimesh_get_info(f.surface, &skin));
  const double *share = nullptr;
  test::ok(dfm_tetmesh_share(f.mesh, &share));
  ASSERT_NE(share, nullptr);
  EXPECT_NEAR(info.ntet, 2000, 200);
  EXPECT_EQ(info.npiece, 1u);
  double sum = 0;  // cells of the lattice are alike
  for (uint32_t t = 0; t < info.ntet; ++t) sum += share[t] * info.volume / info.ntet;
  EXPECT_NEAR(sum, skin.volume, 1e-9 * skin.volume);
  EXPECT_GT(info.volume, 1.1 * skin.volume);
}

TEST(TetmeshFill, MeshThatWasNotFilled_HasNoShare) {
  test::Context context;
  const double size[3] = {1, 1, 1};
  dfm_tetmesh mesh = 0;
  test::ok(dfm_tetmesh_make(context, "beam", size, 100, &mesh));
  const double *share = size;
  test::ok(dfm_tetmesh_share(mesh, &share));
  EXPECT_EQ(share, nullptr);
}

TEST(TetmeshFill, WrongArguments_AreRefusedWithASentence) {
  Filled f("ball", {0.1, 0, 0}, 500);
  EXPECT_EQ(dfm_tetmesh_fill(f.surface, 0, &f.mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_fill(f.surface, 100, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_tetmesh_fill(0, 100, &f.mesh), DFM_E_HANDLE);
  EXPECT_EQ(dfm_tetmesh_share(0, nullptr), DFM_E_ARG);
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const uint32_t triangle[] = {0, 1, 2};
  dfm_trimesh sheet = 0;
  test::ok(dfm_trimesh_create(f.context, 3, points, 1, triangle, &sheet));
  EXPECT_EQ(dfm_tetmesh_fill(sheet, 100, &f.mesh), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("1 opening of 0.5 m2"), std::string::npos) << dfm_last_error();
}

TEST(MeshFillCommand, Surface_BecomesAFileOfCells) {
  const std::string folder = test::scratch("fill_command"), data = std::string(DEFORM_SOURCE_DIR) + "/examples/data/";
  const test::CommandResult made = test::deform({"mesh", "fill", data + "organ.obj", "--out", folder + "/organ.msh", "--cells", "1000", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const char *key : {"\"cells\": ", "\"points\": ", "\"enclosed_volume\": ", "\"mean_share\": ", "\"seconds\": ", "\"warnings\": []"})
    EXPECT_NE(made.out.find(key), std::string::npos) << key << "\n" << made.out;
  const test::CommandResult info = test::deform({"mesh", "info", folder + "/organ.msh"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  const test::CommandResult table = test::deform({"mesh", "fill", data + "rabbit.obj", "--out", folder + "/rabbit.vtk", "--cells", "500"});
  EXPECT_NE(table.out.find("the surface is clean"), std::string::npos) << table.out;
}

TEST(MeshFillCommand, OpenSheet_ExitsTwoAndNamesTheFileAndTheOpening) {
  const std::string folder = test::scratch("fill_command_open");
  test::write_file(folder + "/sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const test::CommandResult result = test::deform({"mesh", "fill", folder + "/sheet.obj", "--out", folder + "/x.msh"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("sheet.obj: the surface is open: 1 opening of 0.5 m2"), std::string::npos) << result.err;
  EXPECT_EQ(test::read_file(folder + "/sheet.obj").substr(0, 1), "v");
  EXPECT_EQ(test::deform({"mesh", "info", folder + "/x.msh"}).exit_code, 2) << "nothing may be written";
}
