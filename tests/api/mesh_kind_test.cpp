// dfm_mesh_file_kind and dfm_mesh_read: whether a body takes its cells from a file or is filled
// from its surface.
#include <gtest/gtest.h>

#include "deform/deform.h"
#include "support.h"

namespace {

const std::string kData = std::string(DEFORM_SOURCE_DIR) + "/tests/data/";

struct Context {
  dfm_context *context = nullptr;
  Context() {
    dfm_context_def def = dfm_context_def_default();
    def.log = [](void *, int32_t, const char *) {};
    EXPECT_EQ(dfm_context_create(&def, &context), DFM_OK);
  }
  ~Context() { dfm_context_destroy(context); }
};

}  // namespace

TEST(MeshKind, FileWithAnyTetrahedron_IsTets) {
  Context c;
  for (const char *name : {"meshes/cube_msh41_ascii.msh", "meshes/cube_vtk51_bin_64.vtk",
                           "meshes/cube_vtu_raw_zlib.vtu", "meshes/cube_medit.mesh"}) {
    uint32_t kind = 0;
    EXPECT_EQ(dfm_mesh_file_kind(c.context, (kData + name).c_str(), &kind), DFM_OK) << dfm_last_error();
    EXPECT_EQ(kind, uint32_t(DFM_MESH_TETS)) << name;
  }
}

TEST(MeshKind, FileWithTrianglesAlone_IsSurface) {
  Context c;
  for (const char *name : {"obj.obj", "ply_big.ply", "stl_binary.stl", "off.off", "msh22.msh",
                           "vtk_polydata.vtk", "vtp.vtp", "medit.mesh"}) {
    uint32_t kind = 0;
    EXPECT_EQ(dfm_mesh_file_kind(c.context, (kData + "surfaces/cube_" + name).c_str(), &kind), DFM_OK)
        << dfm_last_error();
    EXPECT_EQ(kind, uint32_t(DFM_MESH_SURFACE)) << name;
  }
}

TEST(MeshKind, NothingToMakeABodyOf_IsAnError) {
  Context c;
  const std::string folder = test::scratch("mesh_kind");
  test::write_file(folder + "/points.obj", "v 0 0 0\n");
  test::write_file(folder + "/a.bdf", "GRID\n");
  uint32_t kind = 77;
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/points.obj").c_str(), &kind), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("no tetrahedra and no triangles"), std::string::npos)
      << dfm_last_error();
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/a.bdf").c_str(), &kind), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/none.msh").c_str(), &kind), DFM_E_IO);
  EXPECT_EQ(dfm_mesh_file_kind(nullptr, "a.msh", &kind), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, nullptr, &kind), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, "a.msh", nullptr), DFM_E_ARG);
  EXPECT_EQ(kind, 77u);
}

TEST(MeshKind, ReadOnce_GivesWhatTheReaderOfItsKindGives) {
  Context c;
  const std::string tets = kData + "meshes/cube_msh41_ascii.msh", skin = kData + "surfaces/cube_obj.obj";
  dfm_tetmesh cells = 7, same_cells = 0;
  dfm_trimesh surface = 7, same_surface = 0;
  ASSERT_EQ(dfm_mesh_read(c.context, tets.c_str(), &cells, &surface), DFM_OK) << dfm_last_error();
  EXPECT_EQ(surface, 0u);
  ASSERT_EQ(dfm_tetmesh_read(c.context, tets.c_str(), &same_cells), DFM_OK);
  dfm_tetmesh_info a{}, b{};
  a.size = b.size = sizeof a;
  ASSERT_EQ(dfm_tetmesh_get_info(cells, &a), DFM_OK);
  ASSERT_EQ(dfm_tetmesh_get_info(same_cells, &b), DFM_OK);
  EXPECT_EQ(a.ntet, b.ntet);
  EXPECT_EQ(a.volume, b.volume);
  EXPECT_STREQ(a.warnings, b.warnings);

  cells = 7;
  ASSERT_EQ(dfm_mesh_read(c.context, skin.c_str(), &cells, &surface), DFM_OK) << dfm_last_error();
  EXPECT_EQ(cells, 0u);
  ASSERT_EQ(dfm_trimesh_read(c.context, skin.c_str(), &same_surface), DFM_OK);
  dfm_trimesh_info s{}, t{};
  s.size = t.size = sizeof s;
  ASSERT_EQ(dfm_trimesh_get_info(surface, &s), DFM_OK);
  ASSERT_EQ(dfm_trimesh_get_info(same_surface, &t), DFM_OK);
  EXPECT_EQ(s.ntriangle, t.ntriangle);
  EXPECT_EQ(s.area, t.area);
  EXPECT_STREQ(s.warnings, t.warnings);
}

TEST(MeshKind, ReadOnceOfNothing_IsAnErrorAndTouchesNothing) {
  Context c;
  const std::string folder = test::scratch("mesh_kind_once");
  test::write_file(folder + "/points.obj", "v 0 0 0\n");
  test::write_file(folder + "/a.glb", "glTF");
  dfm_tetmesh cells = 7;
  dfm_trimesh surface = 7;
  EXPECT_EQ(dfm_mesh_read(c.context, (folder + "/points.obj").c_str(), &cells, &surface), DFM_E_FORMAT);
  EXPECT_EQ(dfm_mesh_read(c.context, (folder + "/none.msh").c_str(), &cells, &surface), DFM_E_IO);
  EXPECT_EQ(dfm_mesh_read(c.context, (folder + "/a.glb").c_str(), &cells, &surface), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error())
                .find("the library itself reads no glTF files; convert it first: deform mesh convert"),
            std::string::npos)
      << dfm_last_error();
  EXPECT_EQ(dfm_mesh_read(nullptr, "a.msh", &cells, &surface), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_read(c.context, "a.msh", nullptr, &surface), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_read(c.context, "a.msh", &cells, nullptr), DFM_E_ARG);
  EXPECT_EQ(cells, 7u);
  EXPECT_EQ(surface, 7u);
}
