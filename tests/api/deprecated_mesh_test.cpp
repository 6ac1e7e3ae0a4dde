// Functions of deform/deprecated.h for meshes: each gives what it gave.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>

#include "deform/deprecated.h"
#include "support.h"
#include "world.h"

namespace {

const std::string kData = std::string(DEFORM_SOURCE_DIR) + "/tests/data/";
const std::string kCells = kData + "meshes/cube_msh41_bin_be.msh", kSurface = kData + "surfaces/cube_obj.obj";

// dfm_tetmesh_info as programs of 0.1 had it
struct FirstInfo {
  uint32_t size, npoint, ntet, ntriangle, nedge, npiece, repairs[7], ngroup;
  double volume, edge[3], quality[2];
  uint32_t histogram[10];
  double lo[3], hi[3];
  const char *warnings;
};

}  // namespace

TEST(DeprecatedMesh, OfCells) {
  test::Context c;
  dfm_tetmesh mesh = 0, made = 0, second = 0;
  test::ok(dfm_tetmesh_read(c, kCells.c_str(), &mesh));
  const dfm_mesh_info m = test::info_of(mesh);
  dfm_tetmesh_info info{};
  info.size = sizeof info;
  test::ok(dfm_tetmesh_get_info(mesh, &info));
  EXPECT_EQ(std::memcmp(&info, &m, sizeof m), 0);
  const double *points = nullptr, *share = points, *inside = points;
  const uint32_t *tets = nullptr, *place = nullptr, *group = nullptr, *faces = nullptr, *cells = tets;
  const char *const *names = nullptr;
  uint32_t kind = 0, n = 0, dimension = 0;
  test::ok(dfm_tetmesh_data(mesh, &points, &tets, &place));
  EXPECT_EQ(points, m.points);
  EXPECT_EQ(tets, m.tets);
  EXPECT_EQ(place, m.file_point);
  test::ok(dfm_tetmesh_data(mesh, nullptr, nullptr, nullptr));
  test::ok(dfm_tetmesh_cells(mesh, &kind, &cells));
  EXPECT_EQ(kind, uint32_t(DFM_CELL_TET));
  EXPECT_EQ(cells, nullptr);
  test::ok(dfm_tetmesh_groups(mesh, &names, &group));
  EXPECT_STREQ(names[group[5]], "high end");
  test::ok(dfm_tetmesh_triangles(mesh, &faces, &group, &n));
  EXPECT_EQ(n, m.nface);
  EXPECT_EQ(faces, m.faces);
  EXPECT_EQ(group, m.face_group);
  test::ok(dfm_tetmesh_group_points(mesh, 0, &dimension, &place, &n));
  EXPECT_EQ(dimension, 2u);
  EXPECT_EQ(n, 8u);
  EXPECT_EQ(dfm_tetmesh_group_points(mesh, 3, nullptr, nullptr, nullptr), DFM_E_ARG);
  test::ok(dfm_tetmesh_file_cells(mesh, &cells));
  EXPECT_EQ(cells, m.file_cell);
  EXPECT_EQ(dfm_tetmesh_file_cells(mesh, nullptr), DFM_E_ARG);
  test::ok(dfm_tetmesh_share(mesh, &share));
  EXPECT_EQ(share, nullptr);
  EXPECT_EQ(dfm_tetmesh_share(0, nullptr), DFM_E_ARG);
  test::ok(dfm_tetmesh_inside(mesh, &inside));
  EXPECT_EQ(inside, nullptr);
  EXPECT_EQ(dfm_tetmesh_inside(mesh, nullptr), DFM_E_ARG);
  const double size[3] = {0.1, 0.1, 0.1};
  test::ok(dfm_tetmesh_make(c, "beam", size, 10, &made));
  test::ok(dfm_tetmesh_second_order(made, &second));
  test::ok(dfm_tetmesh_write(made, (test::scratch("deprecated_mesh") + "/a.msh").c_str()));
  EXPECT_EQ(dfm_handle_kind(made), uint32_t(DFM_HANDLE_TETMESH));
  test::ok(dfm_tetmesh_destroy(made));
  EXPECT_EQ(dfm_tetmesh_destroy(made), DFM_E_HANDLE);
}

TEST(DeprecatedMesh, OfSurfaces) {
  test::Context c;
  dfm_trimesh mesh = 0, made = 0, again = 0;
  dfm_tetmesh filled = 0, lattice = 0;
  test::ok(dfm_trimesh_read(c, (kData + "surfaces/cube_stl_binary.stl").c_str(), &mesh));
  const dfm_mesh_info m = test::info_of(mesh);
  dfm_trimesh_info info{};
  test::ok(dfm_trimesh_get_info(mesh, &info));
  EXPECT_EQ(info.size, sizeof info) << "0: all, as 0.1 had it";
  EXPECT_EQ(info.ntriangle, m.ntriangle);
  EXPECT_EQ(info.merged_points, 28u);
  EXPECT_EQ(info.merged_points, m.duplicate_points);
  EXPECT_EQ(info.closed, 1u);
  EXPECT_EQ(info.area, m.area);
  EXPECT_EQ(info.quality_mean, m.quality_mean);
  EXPECT_EQ(info.quality_histogram[8], m.quality_histogram[8]);
  EXPECT_EQ(info.hi[2], m.hi[2]);
  EXPECT_STREQ(info.warnings, m.warnings);
  std::memset(&info, 0xee, sizeof info);
  info.size = offsetof(dfm_trimesh_info, nedge);
  test::ok(dfm_trimesh_get_info(mesh, &info));
  EXPECT_EQ(info.ntriangle, 12u);
  EXPECT_EQ(info.nedge, 0xeeeeeeeeu) << "an older struct is filled up to its size";
  EXPECT_EQ(dfm_trimesh_get_info(mesh, nullptr), DFM_E_ARG);
  const double *points = nullptr;
  const uint32_t *triangles = nullptr, *place = nullptr, *group = nullptr;
  const char *const *names = nullptr;
  test::ok(dfm_trimesh_data(mesh, &points, &triangles, &place));
  EXPECT_EQ(points, m.points);
  EXPECT_EQ(triangles, m.faces);
  EXPECT_EQ(place, m.file_point);
  test::ok(dfm_trimesh_groups(mesh, &names, &group));
  EXPECT_EQ(group, m.face_group);
  test::ok(dfm_trimesh_create(c, m.npoint, points, m.ntriangle, triangles, &again));
  test::ok(dfm_trimesh_write(again, (test::scratch("deprecated_mesh") + "/a.stl").c_str()));
  const double size[3] = {0.1, 0, 0};
  test::ok(dfm_trimesh_make(c, "ball", size, 400, &made));
  test::ok(dfm_tetmesh_fill(made, 100, &filled));
  test::ok(dfm_tetmesh_share(filled, &points));
  EXPECT_NE(points, nullptr);
  test::ok(dfm_tetmesh_lattice(made, 8, 0, &lattice));
  test::ok(dfm_tetmesh_inside(lattice, &points));
  EXPECT_NE(points, nullptr);
  test::ok(dfm_trimesh_destroy(made));
  EXPECT_EQ(dfm_trimesh_destroy(made), DFM_E_HANDLE);
}

TEST(DeprecatedMesh, OfFilesOfEitherKind) {
  test::Context c;
  uint32_t kind = 0;
  dfm_tetmesh cells = 7;
  dfm_trimesh surface = 7;
  test::ok(dfm_mesh_file_kind(c, kCells.c_str(), &kind));
  EXPECT_EQ(kind, uint32_t(DFM_MESH_TETS));
  test::ok(dfm_mesh_read(c, kCells.c_str(), &cells, &surface));
  EXPECT_NE(cells, 0u);
  EXPECT_EQ(surface, 0u);
  test::ok(dfm_mesh_file_kind(c, kSurface.c_str(), &kind));
  EXPECT_EQ(kind, uint32_t(DFM_MESH_SURFACE));
  test::ok(dfm_mesh_read(c, kSurface.c_str(), &cells, &surface));
  EXPECT_EQ(cells, 0u);
  EXPECT_NE(surface, 0u);
  EXPECT_EQ(dfm_mesh_file_kind(c, "none.msh", &kind), DFM_E_IO);
  EXPECT_EQ(dfm_mesh_file_kind(c, kCells.c_str(), nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_read(c, "none.msh", &cells, &surface), DFM_E_IO);
  EXPECT_EQ(dfm_mesh_read(c, kCells.c_str(), nullptr, &surface), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_read(c, kCells.c_str(), &cells, nullptr), DFM_E_ARG);
}

TEST(DeprecatedMesh, CellsAndSurfaces_AreNotMixedUp) {
  test::Context c;
  dfm_trimesh surface = 0;
  dfm_tetmesh cells = 0;
  dfm_tetmesh_info of_cells{};
  dfm_trimesh_info of_surface{};
  const double size[3] = {0.1, 0, 0}, *real = nullptr;
  const uint32_t *whole = nullptr;
  test::ok(dfm_trimesh_make(c, "ball", size, 100, &surface));
  test::ok(dfm_tetmesh_make(c, "ball", size, 100, &cells));
  for (const dfm_status status :
       {dfm_tetmesh_get_info(surface, &of_cells), dfm_tetmesh_data(surface, nullptr, nullptr, nullptr),
        dfm_tetmesh_cells(surface, nullptr, nullptr), dfm_tetmesh_groups(surface, nullptr, nullptr),
        dfm_tetmesh_triangles(surface, nullptr, nullptr, nullptr),
        dfm_tetmesh_group_points(surface, 0, nullptr, nullptr, nullptr), dfm_tetmesh_write(surface, "a.vtk"),
        dfm_tetmesh_file_cells(surface, &whole), dfm_tetmesh_share(surface, &real),
        dfm_tetmesh_inside(surface, &real), dfm_tetmesh_second_order(surface, &cells),
        dfm_tetmesh_fill(cells, 100, &cells), dfm_tetmesh_lattice(cells, 8, 0, &cells),
        dfm_tetmesh_destroy(surface)})
    EXPECT_EQ(status, DFM_E_HANDLE);
  test::says({"is that of a surface mesh"});
  EXPECT_EQ(of_cells.size, 0u) << "what failed leaves the output alone";
  for (const dfm_status status :
       {dfm_trimesh_get_info(cells, &of_surface), dfm_trimesh_data(cells, nullptr, nullptr, nullptr),
        dfm_trimesh_groups(cells, nullptr, nullptr), dfm_trimesh_write(cells, "a.vtk"),
        dfm_trimesh_destroy(cells)})
    EXPECT_EQ(status, DFM_E_HANDLE);
  test::says({"is that of a mesh with cells"});
}

// A program of 0.1 that does not set the size of its struct has that one.
TEST(DeprecatedMesh, SizeOfZero_IsThatOfTheFirstStruct) {
  test::Context c;
  dfm_tetmesh mesh = 0;
  test::ok(dfm_tetmesh_read(c, kCells.c_str(), &mesh));
  static_assert(sizeof(FirstInfo) == offsetof(dfm_tetmesh_info, wave_path));
  struct {
    FirstInfo info;
    uint64_t behind;
  } old{{}, 77};
  test::ok(dfm_tetmesh_get_info(mesh, reinterpret_cast<dfm_tetmesh_info *>(&old.info)));
  EXPECT_EQ(old.info.size, sizeof old.info);
  EXPECT_EQ(old.info.npoint, 8u);
  EXPECT_STREQ(old.info.warnings, "1 point that no cell uses was dropped\n");
  EXPECT_EQ(old.behind, 77u);
}
