#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "mesh_support.h"

using namespace dfm;

namespace {

RestMesh two_tets() {  // share the face 1 2 3
  RestMesh m;
  m.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  m.tets = {0, 1, 2, 3, 4, 2, 1, 3};
  m.tet_group.assign(2, kNoGroup);
  return m;
}

}  // namespace

TEST(MeshTopology, Faces_OfAPositiveCellPointOutward) {
  const RestMesh m = two_tets();
  ASSERT_GT(tet_volume(m.points.data(), &m.tets[4]), 0);
  // Divergence theorem: the sum of signed cones from the origin is the volume only if every triangle
  // points outward.
  const Array<uint32_t> tri = boundary_triangles(m.tets);
  double volume = 0;
  for (size_t i = 0; i < tri.size(); i += 3) {
    const double *a = &m.points[3 * tri[i]], *b = &m.points[3 * tri[i + 1]], *c = &m.points[3 * tri[i + 2]];
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) /
              6;
  }
  EXPECT_NEAR(volume, tet_volume(m.points.data(), &m.tets[0]) + tet_volume(m.points.data(), &m.tets[4]),
              1e-15);
}

TEST(MeshTopology, Boundary_LeavesOutSharedFacesInOrderOfCells) {
  const Array<uint32_t> tri = boundary_triangles(two_tets().tets);
  // Cell 0 without its face 0 (1 2 3), then cell 1 without its face 0.
  EXPECT_EQ(tri, (Array<uint32_t>{0, 3, 2, 0, 1, 3, 0, 2, 1, 4, 3, 1, 4, 2, 3, 4, 1, 2}));
}

TEST(MeshTopology, Edges_AreUniqueAscendingAndLexicographic) {
  EXPECT_EQ(unique_edges(two_tets().tets),
            (Array<uint32_t>{0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 1, 4, 2, 3, 2, 4, 3, 4}));
}

TEST(MeshTopology, Quality_IsOneForRegularZeroForFlatAndBlindToSize) {
  const uint32_t tet[4] = {0, 1, 2, 3};
  for (const double s : {1e-9, 1.0, 1e5}) {
    const double regular[12] = {s, s, s, s, -s, -s, -s, s, -s, -s, -s, s};
    EXPECT_NEAR(std::fabs(tet_quality(regular, tet)), 1, 1e-14);
    const double corner[12] = {0, 0, 0, s, 0, 0, 0, s, 0, 0, 0, s};
    // V = 1/6, squared edges 1 1 1 2 2 2
    EXPECT_NEAR(tet_quality(corner, tet), 12 * std::cbrt(0.25) / 9, 1e-14);
    const double flat[12] = {0, 0, 0, s, 0, 0, 0, s, 0, s, s, 0};
    EXPECT_EQ(tet_quality(flat, tet), 0);
  }
  const double point[12] = {};
  EXPECT_EQ(tet_quality(point, tet), 0);
}

TEST(MeshTopology, Statistics_OfTwoCells) {
  const dfm_mesh_info s = mesh_statistics(two_tets());
  EXPECT_EQ(s.ntriangle, 6u);
  EXPECT_EQ(s.nedge, 9u);
  EXPECT_EQ(s.npiece, 1u);
  EXPECT_EQ(s.nonmanifold_edges, 0u);
  EXPECT_DOUBLE_EQ(s.volume, 0.5);
  EXPECT_DOUBLE_EQ(s.edge_min, 1);
  EXPECT_DOUBLE_EQ(s.edge_max, std::sqrt(2.0));
  EXPECT_EQ(s.quality_histogram[7] + s.quality_histogram[8] + s.quality_histogram[9], 2u);
  EXPECT_EQ(s.hi[2], 1);
}

TEST(MeshTopology, Pieces_AreJoinedByPoints) {
  RestMesh m = two_tets();
  m.points.insert(m.points.end(), {5, 0, 0, 6, 0, 0, 5, 1, 0, 5, 0, 1});
  m.tets.insert(m.tets.end(), {5, 6, 7, 8});
  EXPECT_EQ(mesh_statistics(m).npiece, 2u);
}

TEST(MeshTopology, EdgeWhereBodiesTouch_IsNonManifold) {
  RestMesh m = two_tets();
  m.tets = {0, 1, 2, 3, 0, 1, 5, 4};  // they share the edge 0 1 alone
  m.points.insert(m.points.end(), {0, -1, -1});
  EXPECT_EQ(mesh_statistics(m).nonmanifold_edges, 1u);
}
