#include <gtest/gtest.h>

#include <set>

#include "../narrow/detect_scene.h"
#include "geometry/area.h"
#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"

namespace {

using namespace dfm;
using namespace test;

Surface surface_of(const Mesh &m) {
  Surface s;
  make_surface(Memory::standard(), m.npoint(), m.x.data(), m.tri.data(), m.ntri(), s);
  return s;
}

TEST(MakeSurface, ClosedMeshes_ObeyEulerAndShareEdgesInPairs) {
  for (const Mesh &m : {sphere_mesh(1, 3), box_mesh({1, 2, 3}, 2, 3, 4), cylinder_mesh(1, 2, 12, 5)}) {
    const Surface s = surface_of(m);
    EXPECT_EQ(int(s.nsurfel) - int(s.nedge) + int(s.ntri), 2);
    for (uint32_t e = 0; e < s.nedge; ++e) {
      const uint32_t i = s.edge[2 * e], j = s.edge[2 * e + 1];
      EXPECT_LT(i, j);
      EXPECT_TRUE(e == 0 || std::make_pair(s.edge[2 * e - 2], s.edge[2 * e - 1]) < std::make_pair(i, j));
      for (int k = 0; k < 2; ++k) {  // first face has it as i to j, second as j to i
        const uint32_t t = s.edge_tri[2 * e + k];
        ASSERT_NE(t, kNone);
        bool found = false;
        for (int c = 0; c < 3; ++c)
          found |= s.tri_edge[3 * t + c] == e && s.tri[3 * t + c] == (k ? j : i) &&
                   s.tri[3 * t + (c + 1) % 3] == (k ? i : j);
        EXPECT_TRUE(found);
      }
    }
  }
}

TEST(MakeSurface, EverySurfelAndEdge_HasOneOwner) {
  const Surface s = surface_of(sphere_mesh(1, 2));
  std::vector<int> surfels(s.nsurfel, 0), edges(s.nedge, 0);
  for (uint32_t t = 0; t < s.ntri; ++t)
    for (int k = 0; k < 3; ++k) {
      surfels[s.tri[3 * t + k]] += s.tri_owns[t] >> k & 1;
      edges[s.tri_edge[3 * t + k]] += s.tri_owns[t] >> (3 + k) & 1;
    }
  for (const int n : surfels) EXPECT_EQ(n, 1);
  for (const int n : edges) EXPECT_EQ(n, 1);
}

TEST(MakeSurface, Areas_SumToTheSurface) {
  const Surface s = surface_of(box_mesh({1, 2, 3}, 3, 3, 3));
  // Seen along the six axes, each side of the box adds up to its own area, rims included.
  const double side[3] = {6, 3, 2};
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Vec3 outward;
      outward[axis] = sign;
      double sum = 0;
      for (uint32_t i = 0; i < s.nsurfel; ++i) sum += facing_area(s, i, outward);
      EXPECT_NEAR(sum, side[axis], 1e-12);
    }
}

TEST(MakeSurface, Patches_AreTheSmoothPieces) {
  const auto count = [](const Mesh &m) {
    const Surface s = surface_of(m);
    return std::set<uint32_t>(s.patch.begin(), s.patch.end()).size();
  };
  EXPECT_EQ(count(box_mesh({1, 1, 1}, 3, 3, 3)), 6u);
  EXPECT_EQ(count(sphere_mesh(1, 3)), 1u);
  EXPECT_EQ(count(cylinder_mesh(1, 2, 16, 4)), 3u);
  EXPECT_EQ(count(cylinder_mesh(1, 2, 5, 4)), 2u + 5u) << "72 degrees between the sides";
}

TEST(MakeSurface, UnusedPoints_AreNoSurfels) {
  Mesh m;
  m.add({9, 9, 9});
  const Mesh t = tetrahedron_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  for (uint32_t i = 0; i < 4; ++i) {
    m.add(t.at(i));
    m.add({8, 8, 8});
  }
  for (const uint32_t i : t.tri) m.tri.push_back(1 + 2 * i);
  const Surface s = surface_of(m);
  EXPECT_EQ(s.nsurfel, 4u);
  EXPECT_EQ(std::vector<uint32_t>(s.point.begin(), s.point.end()), (std::vector<uint32_t>{1, 3, 5, 7}));
  EXPECT_EQ(s.x[4 * 1], 1.0);
}

TEST(MakeSurface, OpenAndNonManifoldInput_IsKept) {
  // three triangles on one edge, and a border everywhere else
  Mesh m;
  for (const Vec3 p : {Vec3{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}) m.add(p);
  m.tri = {0, 1, 2, 1, 0, 3, 0, 1, 4};
  const Surface s = surface_of(m);
  EXPECT_EQ(s.nedge, 7u);
  EXPECT_EQ(s.edge_tri[0], 0u);  // edge 0-1: the lowest of each direction
  EXPECT_EQ(s.edge_tri[1], 1u);
  EXPECT_EQ(s.tri_edge[6], 0u);
  EXPECT_EQ(surface_of(Mesh{}).ntri, 0u);
}

TEST(GatherSurface, Coupling_InterpolatesAndIdentityCopies) {
  Surface s = surface_of(tetrahedron_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  alignas(32) const double x[] = {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 10, 11, 12, 0};
  alignas(32) const double v[] = {1, 1, 1, 0, 2, 2, 2, 0, 3, 3, 3, 0, 4, 4, 4, 0};
  gather_surface(s, x, v);
  EXPECT_EQ(s.x[4 * 2 + 1], 8.0);
  EXPECT_EQ(s.v[4 * 3], 4.0);
  EXPECT_EQ(s.x[4 * 2 + 3], 0.0);
  s.row = {0, 2, 3, 4, 5};
  s.col = {0, 1, 1, 2, 3};
  s.weight = {0.25, 0.75, 1, 1, 1};
  gather_surface(s, x, v);
  EXPECT_EQ(s.x[0], 0.25 * 1 + 0.75 * 4);
  EXPECT_EQ(s.v[2], 0.25 * 1 + 0.75 * 2);
  EXPECT_EQ(s.x[4], 4.0);
}

TEST(Closest, Triangle_BeatsSampledPoints) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  for (int i = 0; i < 300; ++i) {
    const Vec3 a = any();
    const Vec3 b = i % 5 ? any() : a + 1e-6 * any();
    const Vec3 c = i % 7 ? any() : a + 0.5 * (b - a) + 1e-9 * any();
    const Vec3 p = 2.0 * any();
    const TrianglePoint q = closest_on_triangle(p, a, b, c);
    EXPECT_NEAR(q.weight[0] + q.weight[1] + q.weight[2], 1, 1e-14);
    for (const double w : q.weight) EXPECT_GE(w, 0);
    EXPECT_LT(norm(q.weight[0] * a + q.weight[1] * b + q.weight[2] * c - q.point), 1e-13);
    EXPECT_NEAR(norm2(p - q.point), q.distance2, 1e-14 * (1 + q.distance2));
    double least = 1e9;
    for (int u = 0; u <= 40; ++u)
      for (int v = 0; u + v <= 40; ++v)
        least = std::min(least, norm(p - (u / 40.0) * b - (v / 40.0) * c - ((40 - u - v) / 40.0) * a));
    EXPECT_LE(std::sqrt(q.distance2), least + 1e-12);
    EXPECT_GE(std::sqrt(q.distance2), least - 0.1 * std::max({norm(b - a), norm(c - a), norm(c - b)}));
    // Optimal: no corner lies beyond the plane through q orthogonal to p - q.
    for (const Vec3 x : {a, b, c})
      EXPECT_LE(dot(p - q.point, x - q.point), 1e-12 * (1 + norm(p)) * (1 + norm(x)));
    EXPECT_TRUE(triangle_within(p, a, b, c, std::sqrt(q.distance2) * (1 + 1e-12)));
    EXPECT_FALSE(triangle_within(p, a, b, c, std::sqrt(q.distance2) * (1 - 1e-12)));
  }
}

TEST(Closest, TriangleRegions_AreNamed) {
  const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
  const auto feature = [&](Vec3 p) { return int(closest_on_triangle(p, a, b, c).feature); };
  EXPECT_EQ(feature({0.2, 0.2, 5}), 0);
  EXPECT_EQ(feature({0.5, -1, 1}), 1);
  EXPECT_EQ(feature({1, 1, 1}), 2);
  EXPECT_EQ(feature({-1, 0.5, -1}), 3);
  EXPECT_EQ(feature({-1, -1, 0}), 4);
  EXPECT_EQ(feature({3, -0.1, 0}), 5);
  EXPECT_EQ(feature({-0.1, 3, 0}), 6);
}

TEST(Closest, Segments_AreOptimal) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  for (int i = 0; i < 500; ++i) {
    const Vec3 p0 = any(), p1 = i % 11 ? any() : p0, q0 = any();
    const Vec3 q1 = i % 5 == 0 ? q0 + (p1 - p0) : i % 7 == 0 ? q0 : any();  // parallel; points
    const SegmentPoints q = closest_segments(p0, p1, q0, q1);
    EXPECT_TRUE(q.s >= 0 && q.s <= 1 && q.t >= 0 && q.t <= 1);
    double least = 1e9;
    for (int s = 0; s <= 60; ++s) {
      const Vec3 p = p0 + (s / 60.0) * (p1 - p0);
      least = std::min(least, norm(p - q0 - closest_on_segment(p, q0, q1) * (q1 - q0)));
    }
    EXPECT_LE(std::sqrt(q.distance2), least + 1e-12);
    EXPECT_GE(std::sqrt(q.distance2), least - norm(p1 - p0) / 60);
    EXPECT_TRUE(segments_within(p0, p1, q0, q1, std::sqrt(q.distance2) * (1 + 1e-12)));
    EXPECT_FALSE(segments_within(p0, p1, q0, q1, std::sqrt(q.distance2) * (1 - 1e-12)));
  }
}

TEST(Closest, DegenerateInput_IsFinite) {
  const Vec3 o{0, 0, 0}, x{1, 0, 0}, p{0.5, 2, 0};
  EXPECT_DOUBLE_EQ(closest_on_triangle(p, o, o, o).distance2, 4.25);
  EXPECT_DOUBLE_EQ(closest_on_triangle(p, o, x, x).distance2, 4);
  EXPECT_DOUBLE_EQ(closest_on_triangle(p, o, x, {0.25, 0, 0}).distance2, 4);
  EXPECT_DOUBLE_EQ(closest_segments(o, o, p, p).distance2, 4.25);
  EXPECT_DOUBLE_EQ(closest_segments(o, x, {0.5, 1, 0}, {2, 1, 0}).distance2, 1);
}

// Against a brute force of points on the obstacle's surface, in random poses.
TEST(ObstacleShape, Closest_MatchesSampledSurface) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  for (const Shape kind : {Shape::sphere, Shape::box, Shape::capsule}) {
    ObstacleView o{};
    o.shape = kind;
    o.position = any();
    o.rotation = turn(any(), 2);
    o.half_size = {0.5, 0.3, 0.8};
    o.radius = 0.4;
    o.half_length = 0.6;
    const ObstacleShape shape(o);
    std::vector<Vec3> surface;
    for (int i = 0; i < 60000; ++i) {
      Vec3 p;
      if (kind == Shape::box) {
        p = {o.half_size.x * unit(random), o.half_size.y * unit(random), o.half_size.z * unit(random)};
        p[i % 3] = (i & 1 ? 1 : -1) * o.half_size[i % 3];
      } else {
        p = o.radius * normalized(any());
        if (kind == Shape::capsule)
          p = i % 2 ? p + Vec3{0, 0, (p.z > 0 ? 1 : -1) * o.half_length}
                    : o.radius * normalized({p.x, p.y, 0}) + Vec3{0, 0, o.half_length * unit(random)};
      }
      surface.push_back(o.position + rotate(o.rotation, p));
    }
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = o.position + (i % 3 ? 1.0 : 0.3) * any();
      const ObstaclePoint q = shape.closest(p);
      double least = 1e9;
      for (const Vec3 s : surface) least = std::min(least, norm(p - s));
      EXPECT_NEAR(std::fabs(q.distance), least, 0.03);
      EXPECT_LE(std::fabs(q.distance), least + 1e-12);
      EXPECT_NEAR(norm(q.normal), 1, 1e-12);
      EXPECT_LT(norm(q.point + q.distance * q.normal - p), 1e-12);
      const Vec3 local = rotate_back(o.rotation, p - o.position);
      bool inside = norm(local) < o.radius;
      if (kind == Shape::box)
        inside = std::fabs(local.x) < 0.5 && std::fabs(local.y) < 0.3 && std::fabs(local.z) < 0.8;
      if (kind == Shape::capsule)
        inside = norm(local - Vec3{0, 0, std::clamp(local.z, -0.6, 0.6)}) < o.radius;
      EXPECT_EQ(q.distance < 0, inside);
    }
  }
}

TEST(ObstacleShape, CentersOfSymmetry_GiveUnitNormals) {
  for (const Shape kind : {Shape::sphere, Shape::box, Shape::capsule}) {
    ObstacleView o{};
    o.shape = kind;
    o.half_size = {0.5, 0.5, 0.5};
    o.radius = 0.5;
    o.half_length = 0.2;
    const ObstaclePoint q = ObstacleShape(o).closest({0, 0, 0});
    EXPECT_NEAR(norm(q.normal), 1, 1e-15);
    EXPECT_DOUBLE_EQ(q.distance, -0.5);
  }
}

TEST(ObstacleShape, BoxEdges_JoinNeighboringCorners) {
  ObstacleView o{};
  o.shape = Shape::box;
  o.half_size = {1, 2, 3};
  const ObstacleShape shape(o);
  std::set<std::array<double, 6>> seen;
  for (uint32_t e = 0; e < 12; ++e) {
    Vec3 a, b;
    uint32_t f[2];
    shape.edge(e, a, b, f);
    EXPECT_DOUBLE_EQ(norm(b - a), 2 * o.half_size[int(e / 4)]);
    for (const uint32_t face : f)
      for (const Vec3 p : {a, b})
        EXPECT_DOUBLE_EQ(dot(shape.face_normal(face), p), o.half_size[int(face / 2)]);
    EXPECT_TRUE(seen.insert({a.x, a.y, a.z, b.x, b.y, b.z}).second);
  }
}

}  // namespace
