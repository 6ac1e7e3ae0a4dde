// Filling through the public door and the command: shares, warnings, refusals.
#include <cmath>

#include "logged_context.h"
#include "support.h"
#include "world.h"

namespace {

struct Filled {
  test::Context context;
  dfm_mesh_handle surface = 0;
  dfm_mesh_handle mesh = 0;
  explicit Filled(const char *kind, std::array<double, 3> size, uint32_t triangles) {
    test::ok(dfm_mesh_make(context, kind, size.data(), DFM_MESH_SURFACE, triangles, &surface));
  }
};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(MeshFill, Torus_SharesSumUpToItsVolume) {
  Filled f("torus", {0.1, 0.03, 0}, 4000);
  test::ok(dfm_mesh_fill(f.surface, 2000, &f.mesh));
  const dfm_mesh_info info = test::info_of(f.mesh), skin = test::info_of(f.surface);
  const double *const share = info.share;
  ASSERT_NE(share, nullptr);
  EXPECT_NEAR(info.ntet, 2000, 200);
  EXPECT_EQ(info.npiece, 1u);
  double sum = 0;  // cells of the lattice are alike
  for (uint32_t t = 0; t < info.ntet; ++t) sum += share[t] * info.volume / info.ntet;
  EXPECT_NEAR(sum, skin.volume, 1e-9 * skin.volume);
  EXPECT_GT(info.volume, 1.1 * skin.volume);
}

// Twelve triangles around many cells: only a scene splits them.
TEST(MeshFill, BodyWithTrianglesMuchLargerThanItsCells_IsReportedWithTheRemedy) {
  const auto reported = [](uint32_t triangles) {
    test::LoggedContext context;
    const double size[3] = {0.2, 0.2, 0.2};
    dfm_mesh_handle surface = 0;
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_make(context.context, "beam", size, DFM_MESH_SURFACE, triangles, &surface));
    test::ok(dfm_mesh_fill(surface, 1500, &mesh));
    const dfm_mesh_info cells = test::info_of(mesh), skin = test::info_of(surface);
    dfm_surface_def worn{};
    worn.size = sizeof worn;
    dfm_body_def body = dfm_body_def_default();
    body.points = cells.points;
    body.tets = cells.tets;
    body.cell_share = cells.share;
    worn.points = skin.points;
    worn.triangles = skin.faces;
    body.npoint = cells.npoint;
    body.ntet = cells.ntet;
    worn.npoint = skin.npoint;
    worn.ntriangle = skin.ntriangle;
    body.surface = &worn;
    const dfm_world_def def = dfm_world_def_default();
    dfm_world world = 0;
    dfm_body made = 0;
    test::ok(dfm_world_create(context.context, &def, &world));
    test::ok(dfm_body_create(world, &body, &made));
    return context.log;
  };
  const std::string coarse = reported(12);
  EXPECT_NE(coarse.find("its surface has edges of up to 0.283 m"), std::string::npos) << coarse;
  EXPECT_NE(coarse.find("split edges longer than"), std::string::npos) << coarse;
  const std::string fine = reported(1000);
  EXPECT_EQ(fine.find("split edges"), std::string::npos) << fine;
}

// All of mass and stiffness by one share: the cells move as full ones do, with fibers and where they flow.
TEST(MeshFill, CellsOfOneShare_MoveAsFullOnes) {
  test::Context context;
  const double young = 1e5, along = 1e6, shear = 2e5, yield = 500, hardening = 3e4;
  const auto places = [&](double share, std::vector<dfm_param_value> params) {
    std::vector<uint8_t> fixed;
    dfm_body_def d = test::clamped_beam(context, 200, fixed);
    const std::vector<double> shares(d.ntet, share);
    if (share < 1) d.cell_share = shares.data();
    params.push_back({"young", &young, 1});
    d.model = "corotational_fem";
    d.model_params = {sizeof(dfm_params), uint32_t(params.size()), params.data()};
    const dfm_world world = test::make_world(context);
    dfm_body body = 0;
    test::ok(dfm_body_create(world, &d, &body));
    test::run(world, 0.1, 1e-3);
    std::vector<double> x(3 * size_t{d.npoint});
    test::ok(dfm_body_get_state(body, d.npoint, x.data(), nullptr, nullptr));
    return x;
  };
  const std::vector<dfm_param_value> fibers = {{"anisotropy_young", &along, 1},
                                               {"anisotropy_shear", &shear, 1}},
                                     flow = {{"yield", &yield, 1}, {"hardening", &hardening, 1}};
  const std::vector<double> plain = places(1, {});
  for (const auto &params : {fibers, flow}) {
    const std::vector<double> full = places(1, params), part = places(0.25, params);
    double most = 0, changed = 0;
    for (size_t i = 0; i < full.size(); ++i) {
      most = std::max(most, std::fabs(full[i] - part[i]));
      changed = std::max(changed, std::fabs(full[i] - plain[i]));
    }
    EXPECT_GT(changed, 1e-3) << params[0].key;
    EXPECT_LT(most, 1e-9) << params[0].key;
  }
}

TEST(MeshFill, MeshThatWasNotFilled_HasNoShare) {
  test::Context context;
  const double size[3] = {1, 1, 1};
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 100, &mesh));
  EXPECT_EQ(test::info_of(mesh).share, nullptr);
}

TEST(MeshFill, WrongArguments_AreRefusedWithASentence) {
  Filled f("ball", {0.1, 0, 0}, 500);
  EXPECT_EQ(dfm_mesh_fill(f.surface, UINT32_MAX, &f.mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_fill(f.surface, 100, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_fill(0, 100, &f.mesh), DFM_E_HANDLE);
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const uint32_t triangle[] = {0, 1, 2};
  dfm_mesh_handle sheet = 0;
  test::ok(dfm_mesh_create(f.context, 3, points, 1, triangle, &sheet));
  EXPECT_EQ(dfm_mesh_fill(sheet, 100, &f.mesh), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("1 opening of 0.5 m2"), std::string::npos) << dfm_last_error();
}

TEST(MeshFillCommand, Surface_BecomesAFileOfCells) {
  const std::string folder = test::scratch("fill_command");
  const std::string data = std::string(DEFORM_SOURCE_DIR) + "/examples/data/";
  const test::CommandResult made = test::deform(
      {"mesh", "fill", data + "organ.obj", "--out", folder + "/organ.vtu", "--cells", "1000", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const char *key : {"\"cells\": ", "\"points\": ", "\"enclosed_volume\": ", "\"mean_share\": ",
                          "\"seconds\": ", "\"warnings\": []"})
    EXPECT_NE(made.out.find(key), std::string::npos) << key << "\n" << made.out;
  const test::CommandResult info = test::deform({"mesh", "info", folder + "/organ.vtu"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find("of it material"), std::string::npos) << info.out;
  const test::CommandResult table =
      test::deform({"mesh", "fill", data + "rabbit.obj", "--out", folder + "/rabbit.vtk", "--cells", "500"});
  EXPECT_NE(table.out.find("the surface is clean"), std::string::npos) << table.out;
}

namespace {

struct FromFile {
  test::Context context;
  dfm_mesh_handle mesh = 0;
  const double *share = nullptr;
  dfm_mesh_info info{};
  explicit FromFile(const std::string &path) {
    info.size = sizeof info;
    test::ok(dfm_mesh_load(context, path.c_str(), DFM_MESH_CELLS, &mesh));
    test::ok(dfm_mesh_get_info(mesh, &info));
    share = info.share;
  }
};

}  // namespace

// A mesh that is filled, written and loaded has the same mass, or a message names the loss.
TEST(MeshFillCommand, Shares_SurviveInVtkAndVtu_AndTheirLossIsReported) {
  const std::string folder = test::scratch("fill_command_shares");
  const std::string organ = std::string(DEFORM_SOURCE_DIR) + "/examples/data/organ.obj";
  const auto fill = [&](const std::string &name) {
    return test::deform({"mesh", "fill", organ, "--out", folder + "/" + name, "--cells", "600"});
  };
  EXPECT_EQ(fill("a.vtu").out.find("not kept"), std::string::npos);
  fill("b.vtk");
  const FromFile vtu(folder + "/a.vtu"), vtk(folder + "/b.vtk");
  ASSERT_NE(vtu.share, nullptr);
  ASSERT_NE(vtk.share, nullptr);
  double mean = 0;
  for (uint32_t t = 0; t < vtu.info.ntet; ++t) {
    ASSERT_EQ(vtu.share[t], vtk.share[t]);
    mean += vtu.share[t] / vtu.info.ntet;
  }
  EXPECT_GT(mean, 0.3);
  EXPECT_LT(mean, 0.8);
  for (const char *name : {"c.msh", "c.msh2", "c.mesh"}) {
    EXPECT_NE(fill(name).out.find("warning: not kept: the share of material of each cell"), std::string::npos)
        << name;
    const test::CommandResult converted =
        test::deform({"mesh", "convert", folder + "/a.vtu", folder + "/" + name});
    EXPECT_NE(converted.err.find("not kept: the share of material of each cell"), std::string::npos)
        << name << converted.err;
    EXPECT_EQ(FromFile(folder + "/" + name).share, nullptr);
  }
}

TEST(MeshFillCommand, ArrayThatIsNoShare_IsLeftAlone) {
  const std::string file = test::scratch("fill_command_foreign") + "/a.vtk";
  const std::string mesh =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0 1 0 0 0 1 0 0 "
      "0 1 1 1 1\n"
      "CELLS 4 19\n4 0 1 2 3\n3 0 2 1\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 4\n10 5 10 10\nCELL_DATA 4\n";
  for (const auto &[array, counts] :
       {std::pair("SCALARS share double 1\nLOOKUP_TABLE default\n0.5 1 0.5 0.25\n", true),
        std::pair("SCALARS share double 1\nLOOKUP_TABLE default\n0.5 1 0.5 1.5\n", false),
        std::pair("SCALARS share double 1\nLOOKUP_TABLE default\n0.5 1 0.5 0\n", false),
        std::pair("SCALARS share int 1\nLOOKUP_TABLE default\n1 1 1 1\n", false),
        std::pair("VECTORS share double\n1 1 1 1 1 1 1 1 1 1 1 1\n", false)}) {
    test::write_file(file, mesh + array);
    const FromFile read(file);
    ASSERT_EQ(read.info.ntet, 2u) << "the double is dropped";
    ASSERT_EQ(read.share != nullptr, counts) << array;
    if (!counts) continue;
    EXPECT_EQ(read.share[0], 0.5);
    EXPECT_EQ(read.share[1], 0.25) << "shares stay with their cells, past triangles and doubles";
  }
}

TEST(MeshFillCommand, OpenSheet_ExitsTwoAndNamesTheFileAndTheOpening) {
  const std::string folder = test::scratch("fill_command_open");
  test::write_file(folder + "/sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const test::CommandResult result =
      test::deform({"mesh", "fill", folder + "/sheet.obj", "--out", folder + "/x.msh"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("sheet.obj: the surface is open: 1 opening of 0.5 m2"), std::string::npos)
      << result.err;
  EXPECT_EQ(test::read_file(folder + "/sheet.obj").substr(0, 1), "v");
  EXPECT_EQ(test::deform({"mesh", "info", folder + "/x.msh"}).exit_code, 2) << "nothing may be written";
}
