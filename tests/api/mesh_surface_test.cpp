// Surfaces through the C API: from the host's triangles, from generators and from files, told,
// lent and written.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "deform/deform.h"
#include "logged_context.h"
#include "support.h"

namespace {

std::string folder() { return test::scratch("trimesh"); }
bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }

// A tetrahedron, each triangle with its own corners, the second turned, and a point that nothing uses.
const double kPoints[39] = {0,      0, 0, 0, 1,      0, 1, 0, 0, /**/ 0, 0, 0, 0, 0,
                            1,      1, 0, 0, /**/ 0, 0, 0, 0, 0, 1,      0, 1, 0,
                            /**/ 1, 0, 0, 0, 1,      0, 0, 0, 1, /**/ 9, 9, 9};
const uint32_t kTriangles[12] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

dfm_mesh_info info_of(dfm_mesh_handle mesh) {
  dfm_mesh_info info = {};
  info.size = sizeof info;
  EXPECT_EQ(dfm_mesh_get_info(mesh, &info), DFM_OK) << dfm_last_error();
  return info;
}

}  // namespace

TEST(SurfaceMesh, Create_RepairsReportsAndLendsArrays) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 0;
  ASSERT_EQ(dfm_mesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK) << dfm_last_error();
  const dfm_mesh_info i = info_of(mesh);
  EXPECT_EQ(i.npoint, 4u);
  EXPECT_EQ(i.ntriangle, 4u);
  EXPECT_EQ(i.nedge, 6u);
  EXPECT_EQ(i.npiece, 1u);
  EXPECT_EQ(i.duplicate_points, 8u);
  EXPECT_EQ(i.dropped_points, 1u);
  EXPECT_EQ(i.dropped_cells, 0u);
  EXPECT_EQ(i.turned, 1u);
  EXPECT_EQ(i.closed, 1u);
  EXPECT_EQ(i.open_edges + i.holes + i.nonmanifold_edges + i.ngroup, 0u);
  EXPECT_NEAR(i.volume, 1.0 / 6, 1e-15);
  EXPECT_NEAR(i.area, 1.5 + std::sqrt(0.75), 1e-15);
  EXPECT_NEAR(i.quality_min, std::sqrt(3.0) / 2, 1e-15);
  EXPECT_EQ(i.quality_histogram[8], 3u);
  EXPECT_EQ(i.quality_histogram[9], 1u);
  EXPECT_EQ(i.edge_min, 1);
  EXPECT_EQ(i.hi[2], 1);
  EXPECT_TRUE(has(i.warnings, "1 of 4 triangles faced the wrong way and was turned\n")) << i.warnings;
  EXPECT_TRUE(has(c.log, "dfm_mesh_create: 8 points were merged")) << c.log;
  EXPECT_EQ(i.ntet + i.ncell, 0u);
  EXPECT_EQ(i.tets, nullptr);
  EXPECT_EQ(i.cells, nullptr);
  EXPECT_EQ(i.nface, 4u);
  EXPECT_EQ(i.file_point[3], 4u);
  EXPECT_EQ(i.points[11], 1);
  EXPECT_EQ(i.face_group[0], UINT32_MAX);
  EXPECT_EQ(dfm_mesh_destroy(mesh), DFM_OK);
  EXPECT_EQ(dfm_mesh_destroy(mesh), DFM_E_HANDLE);
}

TEST(SurfaceMesh, WriteAndRead_KeepsTheSurface) {
  test::LoggedContext c;
  const double size[3] = {0.3, 0.1, 0};
  dfm_mesh_handle mesh = 0, back = 0;
  ASSERT_EQ(dfm_mesh_make(c.context, "torus", size, DFM_MESH_SURFACE, 400, &mesh), DFM_OK)
      << dfm_last_error();
  EXPECT_STREQ(info_of(mesh).warnings, "");
  for (const char *ending : {".obj", ".ply", ".off", ".vtk", ".vtu"}) {
    const std::string path = folder() + "/torus" + ending;
    ASSERT_EQ(dfm_mesh_write(mesh, path.c_str()), DFM_OK) << dfm_last_error();
    ASSERT_EQ(dfm_mesh_load(c.context, path.c_str(), DFM_MESH_ANY, &back), DFM_OK) << dfm_last_error();
    EXPECT_EQ(info_of(back).ntet, 0u);
    EXPECT_EQ(info_of(back).volume, info_of(mesh).volume) << ending;
    EXPECT_EQ(info_of(back).ntriangle, info_of(mesh).ntriangle) << ending;
    EXPECT_EQ(dfm_mesh_destroy(back), DFM_OK);
  }
  EXPECT_EQ(dfm_mesh_write(mesh, (folder() + "/torus.xyz").c_str()), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_mesh_write(mesh, (folder() + "/none/torus.obj").c_str()), DFM_E_IO);
}

TEST(SurfaceMesh, ReadCells_GivesTheirBoundary) {
  test::LoggedContext c;
  const double size[3] = {0.2, 0.5, 0};
  const std::string path = folder() + "/cylinder.msh";
  dfm_mesh_handle cells = 0, skin = 0;
  ASSERT_EQ(dfm_mesh_make(c.context, "cylinder", size, DFM_MESH_CELLS, 500, &cells), DFM_OK);
  ASSERT_EQ(dfm_mesh_write(cells, path.c_str()), DFM_OK);
  ASSERT_EQ(dfm_mesh_load(c.context, path.c_str(), DFM_MESH_SURFACE, &skin), DFM_OK) << dfm_last_error();
  EXPECT_EQ(info_of(skin).ntriangle, info_of(cells).ntriangle);
  EXPECT_NEAR(info_of(skin).volume, info_of(cells).volume, 1e-15);
}

TEST(SurfaceMesh, OlderInfoStruct_IsFilledUpToItsSize) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 0;
  ASSERT_EQ(dfm_mesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK);
  dfm_mesh_info info;
  std::memset(&info, 0xee, sizeof info);
  info.size = offsetof(dfm_mesh_info, nedge);
  ASSERT_EQ(dfm_mesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.ntriangle, 4u);
  EXPECT_EQ(info.nedge, 0xeeeeeeeeu);
}

TEST(SurfaceMesh, ContextDestroyed_TakesItsSurfacesAlong) {
  dfm_mesh_handle mesh = 0;
  {
    test::LoggedContext c;
    ASSERT_EQ(dfm_mesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK);
  }
  dfm_mesh_info info = {};
  EXPECT_EQ(dfm_mesh_get_info(mesh, &info), DFM_E_HANDLE);
}

TEST(SurfaceMesh, CellsAndSurfaces_AreNotMixedUp) {
  test::LoggedContext c;
  dfm_mesh_handle surface = 0, cells = 0, out = 77;
  const double size[3] = {0.1, 0, 0};
  ASSERT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_SURFACE, 100, &surface), DFM_OK);
  ASSERT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_CELLS, 100, &cells), DFM_OK);
  EXPECT_EQ(dfm_mesh_second_order(surface, &out), DFM_E_HANDLE);
  EXPECT_TRUE(has(dfm_last_error(), "is that of a surface mesh; pass the handle of a mesh with cells"))
      << dfm_last_error();
  EXPECT_EQ(dfm_mesh_fill(cells, 100, &out), DFM_E_HANDLE);
  EXPECT_TRUE(has(dfm_last_error(), "is that of a mesh with cells; pass the handle of a surface mesh"))
      << dfm_last_error();
  EXPECT_EQ(dfm_mesh_lattice(cells, 10, 0, &out), DFM_E_HANDLE);
  EXPECT_EQ(dfm_mesh_write(surface, (folder() + "/a.msh").c_str()), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_mesh_write(cells, (folder() + "/a.stl").c_str()), DFM_E_UNSUPPORTED);
  EXPECT_EQ(out, 77u);
}

TEST(SurfaceMesh, WrongArguments_LeaveTheOutputAlone) {
  test::LoggedContext c;
  dfm_mesh_handle mesh = 77;
  const double size[3] = {1, 1, 1};
  uint32_t far[12];
  std::memcpy(far, kTriangles, sizeof far);
  far[5] = 13;
  double bad[39];
  std::memcpy(bad, kPoints, sizeof bad);
  bad[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(dfm_mesh_create(c.context, 13, kPoints, 4, far, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "triangle 1 (counted from 0) uses point 13, there are 13"))
      << dfm_last_error();
  EXPECT_EQ(dfm_mesh_create(c.context, 13, bad, 4, kTriangles, &mesh), DFM_E_FORMAT);
  EXPECT_TRUE(has(dfm_last_error(), "point 1 (counted from 0)")) << dfm_last_error();
  EXPECT_EQ(dfm_mesh_create(c.context, 13, kPoints, 0, kTriangles, &mesh), DFM_E_FORMAT);
  EXPECT_EQ(dfm_mesh_create(c.context, 13, nullptr, 4, kTriangles, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_create(nullptr, 13, kPoints, 4, kTriangles, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_make(c.context, "cone", size, DFM_MESH_SURFACE, 10, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "cylinder, beam, ball, tube or torus")) << dfm_last_error();
  EXPECT_EQ(dfm_mesh_make(c.context, "ball", size, DFM_MESH_SURFACE, 0, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_load(c.context, nullptr, DFM_MESH_SURFACE, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_load(c.context, (folder() + "/none.obj").c_str(), DFM_MESH_SURFACE, &mesh), DFM_E_IO);
  EXPECT_EQ(mesh, 77u);
}
