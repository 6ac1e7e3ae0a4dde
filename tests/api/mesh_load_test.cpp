// dfm_mesh_load: cells or a surface, as the file has them or as is asked.
#include <gtest/gtest.h>

#include "logged_context.h"
#include "support.h"
#include "world.h"

namespace {

const std::string kData = std::string(DEFORM_SOURCE_DIR) + "/tests/data/";

dfm_mesh_info loaded(dfm_context *context, const std::string &path, uint32_t what = DFM_MESH_ANY) {
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_load(context, path.c_str(), what, &mesh));
  return test::info_of(mesh);
}

}  // namespace

TEST(MeshLoad, FileWithAnyTetrahedron_GivesCells) {
  test::LoggedContext c;
  for (const char *name : {"meshes/cube_msh41_ascii.msh", "meshes/cube_vtk51_bin_64.vtk",
                           "meshes/cube_vtu_raw_zlib.vtu", "meshes/cube_medit.mesh"}) {
    const dfm_mesh_info any = loaded(c.context, kData + name),
                        cells = loaded(c.context, kData + name, DFM_MESH_CELLS),
                        surface = loaded(c.context, kData + name, DFM_MESH_SURFACE);
    EXPECT_GT(any.ntet, 0u) << name;
    EXPECT_EQ(any.ntet, cells.ntet) << name;
    EXPECT_EQ(any.volume, cells.volume) << name;
    EXPECT_STREQ(any.warnings, cells.warnings) << name;
    EXPECT_EQ(surface.ntet, 0u) << name;
    EXPECT_EQ(surface.ntriangle, any.ntriangle) << name;
    EXPECT_EQ(surface.closed, 1u) << name;
  }
}

TEST(MeshLoad, FileWithTrianglesAlone_GivesASurface) {
  test::LoggedContext c;
  for (const char *name : {"obj.obj", "ply_big.ply", "stl_binary.stl", "off.off", "msh22.msh",
                           "vtk_polydata.vtk", "vtp.vtp", "medit.mesh"}) {
    const std::string path = kData + "surfaces/cube_" + name;
    const dfm_mesh_info any = loaded(c.context, path), surface = loaded(c.context, path, DFM_MESH_SURFACE);
    EXPECT_EQ(any.ntet, 0u) << name;
    EXPECT_EQ(any.ntriangle, surface.ntriangle) << name;
    EXPECT_EQ(any.area, surface.area) << name;
    EXPECT_STREQ(any.warnings, surface.warnings) << name;
    dfm_mesh_handle mesh = 7;
    EXPECT_EQ(dfm_mesh_load(c.context, path.c_str(), DFM_MESH_CELLS, &mesh), DFM_E_FORMAT);
    EXPECT_EQ(mesh, 7u);
  }
}

TEST(MeshLoad, NothingToMakeABodyOf_IsAnErrorAndTouchesNothing) {
  test::LoggedContext c;
  const std::string folder = test::scratch("mesh_load");
  test::write_file(folder + "/points.obj", "v 0 0 0\n");
  test::write_file(folder + "/a.bdf", "GRID\n");
  test::write_file(folder + "/a.glb", "glTF");
  dfm_mesh_handle mesh = 7;
  const auto load = [&](const char *name) {
    return dfm_mesh_load(c.context, (folder + "/" + name).c_str(), DFM_MESH_ANY, &mesh);
  };
  EXPECT_EQ(load("points.obj"), DFM_E_FORMAT);
  test::says({"no tetrahedra and no triangles"});
  EXPECT_EQ(load("a.bdf"), DFM_E_UNSUPPORTED);
  EXPECT_EQ(load("none.msh"), DFM_E_IO);
  EXPECT_EQ(load("a.glb"), DFM_E_UNSUPPORTED);
  test::says({"the library itself reads no glTF files; convert it first: deform mesh convert"});
  EXPECT_EQ(dfm_mesh_load(nullptr, "a.msh", DFM_MESH_ANY, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_load(c.context, nullptr, DFM_MESH_ANY, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_load(c.context, "a.msh", DFM_MESH_ANY, nullptr), DFM_E_ARG);
  EXPECT_EQ(mesh, 7u);
}
