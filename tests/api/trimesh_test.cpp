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

dfm_trimesh_info info_of(dfm_trimesh mesh) {
  dfm_trimesh_info info = {};
  info.size = sizeof info;
  EXPECT_EQ(dfm_trimesh_get_info(mesh, &info), DFM_OK) << dfm_last_error();
  return info;
}

}  // namespace

TEST(TrimeshApi, Create_RepairsReportsAndLendsArrays) {
  test::LoggedContext c;
  dfm_trimesh mesh = 0;
  ASSERT_EQ(dfm_trimesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK) << dfm_last_error();
  const dfm_trimesh_info i = info_of(mesh);
  EXPECT_EQ(i.npoint, 4u);
  EXPECT_EQ(i.ntriangle, 4u);
  EXPECT_EQ(i.nedge, 6u);
  EXPECT_EQ(i.npiece, 1u);
  EXPECT_EQ(i.merged_points, 8u);
  EXPECT_EQ(i.dropped_points, 1u);
  EXPECT_EQ(i.dropped_triangles, 0u);
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
  EXPECT_TRUE(has(c.log, "dfm_trimesh_create: 8 points were merged")) << c.log;
  const double *points = nullptr;
  const uint32_t *triangles = nullptr, *place = nullptr, *group = nullptr;
  ASSERT_EQ(dfm_trimesh_data(mesh, &points, &triangles, &place), DFM_OK);
  EXPECT_EQ(place[3], 4u);
  EXPECT_EQ(points[11], 1);
  ASSERT_EQ(dfm_trimesh_groups(mesh, nullptr, &group), DFM_OK);
  EXPECT_EQ(group[0], UINT32_MAX);
  EXPECT_EQ(dfm_trimesh_data(mesh, nullptr, nullptr, nullptr), DFM_OK);
  EXPECT_EQ(dfm_trimesh_destroy(mesh), DFM_OK);
  EXPECT_EQ(dfm_trimesh_destroy(mesh), DFM_E_HANDLE);
  EXPECT_EQ(dfm_trimesh_data(mesh, &points, nullptr, nullptr), DFM_E_HANDLE);
}

TEST(TrimeshApi, WriteAndRead_KeepsTheSurface) {
  test::LoggedContext c;
  const double size[3] = {0.3, 0.1, 0};
  dfm_trimesh mesh = 0, back = 0;
  ASSERT_EQ(dfm_trimesh_make(c.context, "torus", size, 400, &mesh), DFM_OK) << dfm_last_error();
  EXPECT_STREQ(info_of(mesh).warnings, "");
  for (const char *ending : {".obj", ".ply", ".off", ".vtk", ".vtu"}) {
    const std::string path = folder() + "/torus" + ending;
    uint32_t kind = 0;
    ASSERT_EQ(dfm_trimesh_write(mesh, path.c_str()), DFM_OK) << dfm_last_error();
    EXPECT_EQ(dfm_mesh_file_kind(c.context, path.c_str(), &kind), DFM_OK) << dfm_last_error();
    EXPECT_EQ(kind, uint32_t(DFM_MESH_SURFACE));
    ASSERT_EQ(dfm_trimesh_read(c.context, path.c_str(), &back), DFM_OK) << dfm_last_error();
    EXPECT_EQ(info_of(back).volume, info_of(mesh).volume) << ending;
    EXPECT_EQ(info_of(back).ntriangle, info_of(mesh).ntriangle) << ending;
    EXPECT_EQ(dfm_trimesh_destroy(back), DFM_OK);
  }
  EXPECT_EQ(dfm_trimesh_write(mesh, (folder() + "/torus.xyz").c_str()), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_trimesh_write(mesh, (folder() + "/none/torus.obj").c_str()), DFM_E_IO);
}

TEST(TrimeshApi, ReadCells_GivesTheirBoundary) {
  test::LoggedContext c;
  const double size[3] = {0.2, 0.5, 0};
  const std::string path = folder() + "/cylinder.msh";
  dfm_tetmesh cells = 0;
  dfm_trimesh skin = 0;
  ASSERT_EQ(dfm_tetmesh_make(c.context, "cylinder", size, 500, &cells), DFM_OK);
  ASSERT_EQ(dfm_tetmesh_write(cells, path.c_str()), DFM_OK);
  ASSERT_EQ(dfm_trimesh_read(c.context, path.c_str(), &skin), DFM_OK) << dfm_last_error();
  dfm_tetmesh_info info = {};
  info.size = sizeof info;
  ASSERT_EQ(dfm_tetmesh_get_info(cells, &info), DFM_OK);
  EXPECT_EQ(info_of(skin).ntriangle, info.ntriangle);
  EXPECT_NEAR(info_of(skin).volume, info.volume, 1e-15);
}

TEST(TrimeshApi, OlderInfoStruct_IsFilledUpToItsSize) {
  test::LoggedContext c;
  dfm_trimesh mesh = 0;
  ASSERT_EQ(dfm_trimesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK);
  dfm_trimesh_info info;
  std::memset(&info, 0xee, sizeof info);
  info.size = offsetof(dfm_trimesh_info, nedge);
  ASSERT_EQ(dfm_trimesh_get_info(mesh, &info), DFM_OK);
  EXPECT_EQ(info.ntriangle, 4u);
  EXPECT_EQ(info.nedge, 0xeeeeeeeeu);
}

TEST(TrimeshApi, ContextDestroyed_TakesItsSurfacesAlong) {
  dfm_trimesh mesh = 0;
  {
    test::LoggedContext c;
    ASSERT_EQ(dfm_trimesh_create(c.context, 13, kPoints, 4, kTriangles, &mesh), DFM_OK);
  }
  EXPECT_EQ(dfm_trimesh_data(mesh, nullptr, nullptr, nullptr), DFM_E_HANDLE);
}

TEST(TrimeshApi, CellsAndSurfaces_AreNotMixedUp) {
  test::LoggedContext c;
  dfm_trimesh surface = 0;
  dfm_tetmesh cells = 0;
  const double size[3] = {0.1, 0, 0};
  ASSERT_EQ(dfm_trimesh_make(c.context, "ball", size, 100, &surface), DFM_OK);
  ASSERT_EQ(dfm_tetmesh_make(c.context, "ball", size, 100, &cells), DFM_OK);
  EXPECT_EQ(dfm_tetmesh_data(surface, nullptr, nullptr, nullptr), DFM_E_HANDLE);
  EXPECT_EQ(dfm_trimesh_data(cells, nullptr, nullptr, nullptr), DFM_E_HANDLE);
  EXPECT_TRUE(has(dfm_last_error(), "surface mesh")) << dfm_last_error();
}

TEST(TrimeshApi, WrongArguments_LeaveTheOutputAlone) {
  test::LoggedContext c;
  dfm_trimesh mesh = 77;
  const double size[3] = {1, 1, 1};
  uint32_t far[12];
  std::memcpy(far, kTriangles, sizeof far);
  far[5] = 13;
  double bad[39];
  std::memcpy(bad, kPoints, sizeof bad);
  bad[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(dfm_trimesh_create(c.context, 13, kPoints, 4, far, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "triangle 1 (counted from 0) uses point 13, there are 13"))
      << dfm_last_error();
  EXPECT_EQ(dfm_trimesh_create(c.context, 13, bad, 4, kTriangles, &mesh), DFM_E_FORMAT);
  EXPECT_TRUE(has(dfm_last_error(), "point 1 (counted from 0)")) << dfm_last_error();
  EXPECT_EQ(dfm_trimesh_create(c.context, 13, kPoints, 0, kTriangles, &mesh), DFM_E_FORMAT);
  EXPECT_EQ(dfm_trimesh_create(c.context, 13, nullptr, 4, kTriangles, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_trimesh_create(nullptr, 13, kPoints, 4, kTriangles, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_trimesh_make(c.context, "cone", size, 10, &mesh), DFM_E_ARG);
  EXPECT_TRUE(has(dfm_last_error(), "cylinder, beam, ball, tube or torus")) << dfm_last_error();
  EXPECT_EQ(dfm_trimesh_make(c.context, "ball", size, 0, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_trimesh_read(c.context, nullptr, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_trimesh_read(c.context, (folder() + "/none.obj").c_str(), &mesh), DFM_E_IO);
  EXPECT_EQ(mesh, 77u);
}
