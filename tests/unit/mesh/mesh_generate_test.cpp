// Generators: closed sound bodies of the right size, near the number of cells asked for, the same
// bits every time.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <tuple>

#include "core/hash.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

const Memory &standard() { return Memory::standard(); }

void expect_valid(const RestMesh &m) {
  const dfm_mesh_info s = mesh_statistics(m);
  EXPECT_GT(s.quality_min, 0.3);
  EXPECT_EQ(s.npiece, 1u);
  EXPECT_EQ(s.nonmanifold_edges, 0u);
  EXPECT_EQ(s.duplicate_points, 0u);
  for (uint32_t t = 0; t < m.ntet(); ++t) ASSERT_GT(tet_volume(m.points.data(), &m.tets[4 * size_t(t)]), 0);
  EXPECT_EQ(m.tet_group.size(), m.ntet());
  EXPECT_EQ(m.file_point.size(), m.npoint());

  // A ball in the sense of topology: points - edges + faces - cells = 1, its surface a sphere: 2.
  const uint32_t faces = (4 * s.ntet + s.ntriangle) / 2;
  EXPECT_EQ(int64_t(s.npoint) - s.nedge + faces - s.ntet, 1);
  const Array<uint32_t> tri = boundary_triangles(m.tets);
  std::map<std::pair<uint32_t, uint32_t>, int> directed;
  for (size_t i = 0; i < tri.size(); i += 3)
    for (int k = 0; k < 3; ++k) ++directed[{tri[i + k], tri[i + (k + 1) % 3]}];
  double longest = 0, shortest = HUGE_VAL;
  for (const auto &[edge, n] : directed) {
    EXPECT_EQ(n, 1);
    EXPECT_TRUE(directed.count({edge.second, edge.first}));  // closed and consistently turned
    double d = 0;
    for (int k = 0; k < 3; ++k)
      d += std::pow(m.points[3 * edge.first + k] - m.points[3 * edge.second + k], 2);
    longest = std::max(longest, d);
    shortest = std::min(shortest, d);
  }
  EXPECT_LT(std::sqrt(longest / shortest), 3.0);  // contact wants surfaces of one grain
  double volume = 0;
  for (size_t i = 0; i < tri.size(); i += 3) {
    const double *a = &m.points[3 * tri[i]], *b = &m.points[3 * tri[i + 1]], *c = &m.points[3 * tri[i + 2]];
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) /
              6;
  }
  EXPECT_NEAR(volume / s.volume, 1, 1e-12);
}

uint64_t hash_of(const RestMesh &m) {
  Hash h;
  h.add(m.points.data(), m.points.size() * sizeof(double));
  h.add(m.tets.data(), m.tets.size() * sizeof(uint32_t));
  return h.value;
}

}  // namespace

TEST(MeshGenerate, Beams_AreValidAndFillTheirBox) {
  for (const uint32_t cells : {1u, 50u, 500u, 3000u, 20000u})
    for (const auto &[x, y, z] : {std::tuple{1.0, 0.1, 0.1}, std::tuple{0.1, 0.1, 0.1},
                                  std::tuple{1.0, 1.0, 0.1}, std::tuple{2e-9, 1e-9, 3e-9}}) {
      SCOPED_TRACE(testing::Message() << cells << " cells, " << x << " " << y << " " << z);
      const RestMesh m = make_beam(standard(), x, y, z, cells);
      expect_valid(m);
      const dfm_mesh_info s = mesh_statistics(m);
      EXPECT_NEAR(s.volume / (x * y * z), 1, 1e-12);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(s.lo[k], 0);
      EXPECT_EQ(s.hi[0], x);
      EXPECT_EQ(s.hi[1], y);
      EXPECT_EQ(s.hi[2], z);
      if (cells >= 3000) {
        EXPECT_NEAR(s.ntet / double(cells), 1, 0.35);
      }
    }
}

TEST(MeshGenerate, Cylinders_AreValidAndInscribed) {
  for (const uint32_t cells : {1u, 50u, 500u, 2700u, 15000u})
    for (const auto &[radius, length] :
         {std::pair{0.2, 1.0}, std::pair{1.0, 1.0}, std::pair{1.0, 0.2}, std::pair{0.02, 0.16}}) {
      SCOPED_TRACE(testing::Message() << cells << " cells, " << radius << " " << length);
      const RestMesh m = make_cylinder(standard(), radius, length, cells);
      expect_valid(m);
      const dfm_mesh_info s = mesh_statistics(m);
      // The outer ring has 6n points: the body is a prism over a regular polygon.
      uint32_t rim = 0;
      for (uint32_t i = 0; i < m.npoint(); ++i) {
        const double *p = &m.points[3 * size_t(i)];
        rim += p[2] == 0 && std::fabs(std::hypot(p[0], p[1]) / radius - 1) < 1e-12;
      }
      EXPECT_EQ(rim % 6, 0u);
      const double polygon = 0.5 * rim * std::sin(2 * M_PI / rim) * radius * radius;
      EXPECT_NEAR(s.volume / (polygon * length), 1, 1e-12);
      EXPECT_EQ(s.hi[2], length);
      if (cells >= 2700) {
        EXPECT_NEAR(s.ntet / double(cells), 1, 0.35);
      }
    }
}

// One ring has 18 cells a layer and two have 72: between them layers of other heights count.
TEST(MeshGenerate, SlenderCylinders_HaveAboutTheNumberOfCellsRequested) {
  for (uint32_t cells = 200; cells < 1500; cells += 7) {
    const double made = make_cylinder(standard(), 0.05, 0.3, cells).ntet();
    EXPECT_LT(std::max(made / cells, cells / made), 1.42) << cells;
  }
}

TEST(MeshGenerate, Balls_AreValidAndTheirSurfaceLiesOnTheSphere) {
  double last_gap = 1;
  for (const uint32_t cells : {1u, 160u, 1000u, 5000u, 20000u}) {
    SCOPED_TRACE(cells);
    const RestMesh m = make_ball(standard(), 0.05, cells);
    expect_valid(m);
    const Array<uint32_t> tri = boundary_triangles(m.tets);
    for (const uint32_t p : tri) {
      const double *x = &m.points[3 * size_t(p)];
      EXPECT_NEAR(std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) / 0.05, 1, 1e-12);
    }
    const double gap = 1 - mesh_statistics(m).volume / (4 * M_PI / 3 * 0.05 * 0.05 * 0.05);
    EXPECT_GT(gap, 0);
    EXPECT_LT(gap, last_gap);
    last_gap = gap;
    EXPECT_LT(std::max(m.ntet(), cells) / double(std::min(m.ntet(), cells)), cells == 1 ? 21 : 1.7);
  }
  EXPECT_LT(last_gap, 0.006);
}

TEST(MeshGenerate, Lattices_HaveNoPreferredDirection) {
  // The tensor of edge directions (sum of d d^T over |d|^2) is a multiple of the identity by symmetry
  // of the lattices.
  const auto anisotropy = [](const RestMesh &m, int axes) {
    const Array<uint32_t> edges = unique_edges(m.tets);
    double t[3][3] = {};
    for (size_t i = 0; i < edges.size(); i += 2) {
      double d[3], l = 0;
      for (int k = 0; k < 3; ++k) {
        d[k] = m.points[3 * size_t(edges[i]) + k] - m.points[3 * size_t(edges[i + 1]) + k];
        l += d[k] * d[k];
      }
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) t[a][b] += d[a] * d[b] / l;
    }
    double worst = 0, mean = 0;
    for (int a = 0; a < axes; ++a) mean += t[a][a] / axes;
    for (int a = 0; a < axes; ++a)
      for (int b = 0; b < axes; ++b) worst = std::max(worst, std::fabs(t[a][b] - (a == b ? mean : 0)) / mean);
    return worst;
  };
  // only the diagonals of its octahedra differ
  EXPECT_LT(anisotropy(make_ball(standard(), 1, 5000), 3), 0.02);
  EXPECT_LT(anisotropy(make_cylinder(standard(), 1, 2, 5000), 2), 0.01);
  EXPECT_LT(anisotropy(make_beam(standard(), 1, 1, 1, 12 * 8 * 8 * 8), 3), 0.01);
}

TEST(MeshGenerate, Bits_AreTheSameEverywhere) {
  // Golden values: the lattices use + - * / sqrt alone, so compilers and processors agree.
  EXPECT_EQ(hash_of(make_beam(standard(), 1, 0.1, 0.1, 3000)), 15844668210900000100u);
  EXPECT_EQ(hash_of(make_cylinder(standard(), 0.2, 1, 2700)), 4131924135249032641u);
  EXPECT_EQ(hash_of(make_ball(standard(), 0.1, 2500)), 420938365216662557u);
}

TEST(MeshGenerate, UnusableSizes_AreRefusedWithTheReason) {
  const auto sentence = [](auto &&make) -> std::string {
    try {
      make();
    } catch (const Error &e) {
      EXPECT_EQ(e.status, DFM_E_ARG);
      return e.sentence;
    }
    return "";
  };
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    EXPECT_NE(sentence([&] { make_beam(standard(), 1, bad, 1, 10); }).find("beam's y size"),
              std::string::npos);
    EXPECT_NE(sentence([&] { make_cylinder(standard(), bad, 1, 10); }).find("radius"), std::string::npos);
    EXPECT_NE(sentence([&] { make_cylinder(standard(), 1, bad, 10); }).find("length"), std::string::npos);
    EXPECT_NE(sentence([&] { make_ball(standard(), bad, 10); }).find("radius"), std::string::npos);
  }
  EXPECT_NE(sentence([] { make_ball(standard(), 1, 0); }).find("cells is 0"), std::string::npos);
  EXPECT_NE(sentence([] { make_ball(standard(), 1, UINT32_MAX); }).find("expected 1 to"), std::string::npos);
}

TEST(MeshGenerate, ExtremeProportions_NeitherHangNorFill) {
  for (const double x : {1e-8, 1e-4, 1e4, 1e8}) {
    for (int shape = 0; shape < 2; ++shape) {
      try {
        const RestMesh m = shape ? make_cylinder(standard(), 1, x, 100) : make_beam(standard(), 1, 1, x, 100);
        EXPECT_LE(m.ntet(), 10'000u);
        for (uint32_t t = 0; t < m.ntet(); ++t)
          ASSERT_GT(tet_volume(m.points.data(), &m.tets[4 * size_t(t)]), 0);
      } catch (const Error &e) {
        EXPECT_NE(e.sentence.find("nearer to each other"), std::string::npos) << e.sentence;
      }
    }
  }
}
