// dfm_mesh_file_kind: whether a body takes its cells from a file or is filled from its surface.
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
  for (const char *name : {"meshes/cube_msh41_ascii.msh", "meshes/cube_vtk51_bin_64.vtk", "meshes/cube_vtu_raw_zlib.vtu", "meshes/cube_medit.mesh"}) {
    uint32_t kind = 0;
    EXPECT_EQ(dfm_mesh_file_kind(c.context, (kData + name).c_str(), &kind), DFM_OK) << dfm_last_error();
    EXPECT_EQ(kind, uint32_t(DFM_MESH_TETS)) << name;
  }
}

TEST(MeshKind, FileWithTrianglesAlone_IsSurface) {
  Context c;
  for (const char *name : {"obj.obj", "ply_big.ply", "stl_binary.stl", "off.off", "msh22.msh", "vtk_polydata.vtk", "vtp.vtp", "medit.mesh"}) {
    uint32_t kind = 0;
    EXPECT_EQ(dfm_mesh_file_kind(c.context, (kData + "surfaces/cube_" + name).c_str(), &kind), DFM_OK) << dfm_last_error();
    EXPECT_EQ(kind, uint32_t(DFM_MESH_SURFACE)) << name;
  }
}

TEST(MeshKind, NothingToMakeABodyOf_IsAnError) {
  Context c;
  const std::string folder = test::scratch("mesh_kind");
  test::write_file(folder + "/points.obj", "v 0 0 0\n");
  test::write_file(folder + "/a.inp", "*NODE\n");
  uint32_t kind = 77;
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/points.obj").c_str(), &kind), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("no tetrahedra and no triangles"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/a.inp").c_str(), &kind), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, (folder + "/none.msh").c_str(), &kind), DFM_E_IO);
  EXPECT_EQ(dfm_mesh_file_kind(nullptr, "a.msh", &kind), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, nullptr, &kind), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_file_kind(c.context, "a.msh", nullptr), DFM_E_ARG);
  EXPECT_EQ(kind, 77u);
}
