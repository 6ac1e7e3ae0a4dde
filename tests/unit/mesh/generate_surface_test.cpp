// Generated tubes and surfaces: closed, sound, of the size that their polygons have, near the
// number asked for.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/hash.h"
#include "mesh/mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

constexpr double kPi = 3.14159265358979323846;
const Memory &standard() { return Memory::standard(); }

void expect_valid(const RestMesh &m, uint32_t requested, int euler, double least_quality) {
  const dfm_mesh_info s = mesh_statistics(m);
  EXPECT_TRUE(s.closed) << requested;
  EXPECT_EQ(s.npiece, 1u);
  EXPECT_EQ(int64_t(s.npoint) - s.nedge + s.ntriangle, euler) << requested;
  EXPECT_GT(s.volume, 0);
  EXPECT_GT(s.quality_min, requested < 500 ? 0.05 : least_quality) << requested;
  EXPECT_TRUE(m.warnings.empty());
  EXPECT_EQ(m.merged_points + m.turned + m.dropped_points + m.dropped_cells, 0u);
  EXPECT_EQ(m.tri_group.size(), m.ntri());
  for (uint32_t p = 0; p < m.npoint(); ++p) ASSERT_EQ(m.file_point[p], p);
  if (requested < 500) return;
  EXPECT_LT(std::max(s.ntriangle / double(requested), requested / double(s.ntriangle)), 1.35)
      << requested << " asked, " << s.ntriangle << " made";
}

std::string refused(const std::function<void()> &f) {
  try {
    f();
  } catch (const Error &e) {
    EXPECT_EQ(e.status, DFM_E_ARG);
    return e.what();
  }
  return "";
}

}  // namespace

TEST(GenerateSurface, Balls_AreInscribedInTheirSphere) {
  double last = 0;
  for (const uint32_t n : {1u, 100u, 500u, 2000u, 20000u}) {
    const RestMesh m = make_ball_surface(standard(), 0.5, n);
    expect_valid(m, n, 2, 0.75);
    for (size_t p = 0; p < m.points.size(); p += 3)
      EXPECT_NEAR(std::hypot(m.points[p], m.points[p + 1], m.points[p + 2]), 0.5, 1e-15);
    const double volume = mesh_statistics(m).volume;
    EXPECT_GT(volume, last);
    EXPECT_LT(volume, 4 * kPi / 3 / 8);
    last = volume;
  }
  EXPECT_NEAR(last / (4 * kPi / 3 / 8), 1, 1e-3);
}

TEST(GenerateSurface, Beams_FillTheirBox) {
  for (const uint32_t n : {1u, 500u, 5000u})
    for (const auto &size : {std::array{1.0, 1.0, 1.0}, {1.0, 0.1, 0.2}, {1e-9, 2e-9, 3e-9}}) {
      const RestMesh m = make_beam_surface(standard(), size[0], size[1], size[2], n);
      expect_valid(m, n, 2, 0.5);
      EXPECT_NEAR(mesh_statistics(m).volume / (size[0] * size[1] * size[2]), 1, 1e-13);
    }
}

TEST(GenerateSurface, Cylinders_HaveTheVolumeOfTheirPolygon) {
  for (const uint32_t n : {1u, 500u, 5000u})
    for (const double length : {0.3, 1.0, 5.0}) {
      const RestMesh m = make_cylinder_surface(standard(), 0.2, length, n);
      expect_valid(m, n, 2, 0.5);
      uint32_t around = 0;
      for (size_t p = 0; p < m.points.size(); p += 3)
        around += m.points[p + 2] == 0 && std::hypot(m.points[p], m.points[p + 1]) > 0.2 - 1e-12;
      EXPECT_NEAR(mesh_statistics(m).volume, length * 0.02 * around * std::sin(2 * kPi / around),
                  1e-14 * around);
    }
}

TEST(GenerateSurface, Tubes_HaveTheVolumeOfTheirRing) {
  for (const uint32_t n : {1u, 500u, 5000u})
    for (const double inner : {0.05, 0.15, 0.19}) {
      const RestMesh m = make_tube_surface(standard(), inner, 0.2, 0.6, n);
      expect_valid(m, inner == 0.19 ? 1 : n, 0, inner == 0.05 ? 0.2 : 0.5);
      uint32_t around = 0;
      for (size_t p = 0; p < m.points.size(); p += 3)
        around += m.points[p + 2] == 0 && std::hypot(m.points[p], m.points[p + 1]) > 0.2 - 1e-12;
      EXPECT_NEAR(mesh_statistics(m).volume,
                  0.3 * (0.04 - inner * inner) * around * std::sin(2 * kPi / around), 1e-14 * around);
    }
}

TEST(GenerateSurface, Tori_ApproachTheirVolume) {
  for (const uint32_t n : {1u, 500u, 5000u}) {
    const RestMesh m = make_torus_surface(standard(), 0.06, 0.02, n);
    expect_valid(m, n, 0, 0.3);
    for (size_t p = 0; p < m.points.size(); p += 3)
      EXPECT_NEAR(std::hypot(std::hypot(m.points[p], m.points[p + 1]) - 0.06, m.points[p + 2]), 0.02, 1e-15);
  }
  EXPECT_NEAR(mesh_statistics(make_torus_surface(standard(), 0.06, 0.02, 50000)).volume /
                  (2 * kPi * kPi * 0.06 * 0.0004),
              1, 2e-3);
}

TEST(GenerateTube, Cells_AreValidAndFillTheRing) {
  for (const uint32_t n : {1u, 500u, 3000u, 20000u})
    for (const double inner : {0.05, 0.1, 0.18}) {
      const RestMesh m = make_tube(standard(), inner, 0.2, 0.7, n);
      const dfm_mesh_info s = mesh_statistics(m);
      EXPECT_GT(s.quality_min, n == 1 ? 0.1 : inner == 0.05 ? 0.25 : 0.45) << n << " " << inner;
      EXPECT_EQ(s.npiece, 1u);
      EXPECT_EQ(s.nonmanifold_edges + s.duplicate_points, 0u);
      EXPECT_EQ(int64_t(s.npoint) - s.nedge + (4 * s.ntet + s.ntriangle) / 2 - s.ntet, 0) << "a solid ring";
      for (uint32_t t = 0; t < m.ntet(); ++t)
        ASSERT_GT(tet_volume(m.points.data(), &m.tets[4 * size_t(t)]), 0);
      uint32_t around = 0;
      for (size_t p = 0; p < m.points.size(); p += 3)
        around += m.points[p + 2] == 0 && std::hypot(m.points[p], m.points[p + 1]) > 0.2 - 1e-12;
      EXPECT_NEAR(s.volume, 0.35 * (0.04 - inner * inner) * around * std::sin(2 * kPi / around),
                  1e-14 * around);
      if (inner == 0.18 || n < 500) continue;
      EXPECT_LT(std::max(s.ntet / double(n), n / double(s.ntet)), 1.5)
          << n << " asked, " << s.ntet << " made";
    }
}

// Mirrored layers: along the axis diagonals go up as often as down, so a tube under tension does not twist.
TEST(GenerateTube, Surface_HasNoSense) {
  const RestMesh m = make_tube(standard(), 0.15, 0.2, 0.7, 6000);
  const Array<uint32_t> edges = unique_edges(m.tets);
  double twist = 0, all = 0;
  for (size_t i = 0; i < edges.size(); i += 2) {
    const double *p = &m.points[3 * size_t(edges[i])], *q = &m.points[3 * size_t(edges[i + 1])];
    const double turn = (p[0] * q[1] - p[1] * q[0]) * (q[2] - p[2]);
    twist += turn;
    all += std::fabs(turn);
  }
  EXPECT_LT(std::fabs(twist), 0.05 * all);
}

TEST(GenerateSurface, SameBitsEveryTime) {
  Hash h;
  for (const RestMesh &m : {make_ball_surface(standard(), 1, 500), make_torus_surface(standard(), 2, 1, 500),
                            make_tube_surface(standard(), 1, 2, 3, 500)}) {
    h.add(m.points.data(), m.points.size() * sizeof(double));
    h.add(m.tris.data(), m.tris.size() * sizeof(uint32_t));
  }
  const RestMesh t = make_tube(standard(), 1, 2, 3, 500);
  h.add(t.points.data(), t.points.size() * sizeof(double));
  h.add(t.tets.data(), t.tets.size() * sizeof(uint32_t));
  EXPECT_EQ(h.value, 10497315447834092805u);
}

TEST(GenerateSurface, ImpossibleSizes_AreRefused) {
  EXPECT_NE(refused([] {
              make_tube(standard(), 0.2, 0.1, 1, 10);
            }).find("inner radius is 0.2 m; expected less than"),
            std::string::npos);
  EXPECT_NE(refused([] { make_tube_surface(standard(), 0, 0.1, 1, 10); }).find("inner radius is 0 m"),
            std::string::npos);
  EXPECT_NE(refused([] { make_torus_surface(standard(), 1, 1, 10); }).find("torus"), std::string::npos);
  EXPECT_NE(refused([] { make_torus_surface(standard(), 1, 1e-20, 10); }).find("ask for more"),
            std::string::npos);
  EXPECT_NE(refused([] { make_ball_surface(standard(), NAN, 10); }).find("ball's radius"), std::string::npos);
  EXPECT_NE(refused([] { make_ball_surface(standard(), 1, 0); }).find("triangles is 0"), std::string::npos);
  EXPECT_NE(refused([] { make_tube(standard(), 1, 1.0001, 100, 10); }).find("ask for more"),
            std::string::npos);
}
