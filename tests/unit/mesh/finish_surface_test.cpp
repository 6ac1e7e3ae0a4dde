// Loose triangles to surfaces with two sides, on hand-made input of which the right outcome is known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "math/vec3.h"
#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

struct Soup {
  std::vector<Vec3> points;
  std::vector<std::array<uint32_t, 3>> tris;
};

// The six faces of a box as two triangles each, outward.
Soup box(Vec3 lo, Vec3 hi) {
  Soup s;
  for (uint32_t i = 0; i < 8; ++i)
    s.points.push_back({i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
  const uint32_t quad[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto &q : quad) {
    s.tris.push_back({q[0], q[1], q[2]});
    s.tris.push_back({q[0], q[2], q[3]});
  }
  return s;
}

Soup joined(Soup a, const Soup &b) {
  const uint32_t first = uint32_t(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const auto &t : b.tris) a.tris.push_back({t[0] + first, t[1] + first, t[2] + first});
  return a;
}

// As an STL file has it: each triangle brings its own three corners.
Soup loose(const Soup &s) {
  Soup out;
  for (const auto &t : s.tris) {
    const uint32_t n = uint32_t(out.points.size());
    for (const uint32_t p : t) out.points.push_back(s.points[p]);
    out.tris.push_back({n, n + 1, n + 2});
  }
  return out;
}

Soup turned(Soup s, uint32_t every = 1) {
  for (size_t t = 0; t < s.tris.size(); t += every) std::swap(s.tris[t][1], s.tris[t][2]);
  return s;
}

RawMesh raw_of(const Soup &s, double scale = 1, Vec3 offset = {}) {
  RawMesh raw(Memory::standard());
  for (const Vec3 &p : s.points)
    for (int k = 0; k < 3; ++k) raw.points.push_back(scale * p[k] + offset[k]);
  for (const auto &t : s.tris) raw.tris.insert(raw.tris.end(), t.begin(), t.end());
  raw.tri_group.assign(s.tris.size(), kNoGroup);
  return raw;
}

RestMesh finished(const Soup &s, double scale = 1, Vec3 offset = {}) {
  return finish_surface("soup", raw_of(s, scale, offset));
}

std::string all_warnings(const RestMesh &m) {
  std::string out;
  for (const std::string &w : m.warnings) out += w + "\n";
  return out;
}

std::string refused(RawMesh &&raw) {
  try {
    finish_surface("soup", std::move(raw));
  } catch (const Error &e) {
    return e.what();
  }
  return "";
}

const Soup kTetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                        {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

}  // namespace

TEST(FinishSurface, ValidBox_IsUnchanged) {
  const Soup s = box({1, 2, 3}, {2, 4, 6});
  const RestMesh m = finished(s);
  EXPECT_EQ(all_warnings(m), "");
  for (uint32_t i = 0; i < 36; ++i) EXPECT_EQ(m.tris[i], s.tris[i / 3][i % 3]);
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_TRUE(st.closed);
  EXPECT_EQ(st.nedge, 18u);
  EXPECT_EQ(st.npiece, 1u);
  EXPECT_NEAR(st.volume, 6, 1e-14);
  EXPECT_NEAR(st.area, 2 * (2 + 3 + 6), 1e-14);
  EXPECT_EQ(st.edge_min, 1);
  EXPECT_EQ(st.edge_max, std::sqrt(13.0));
}

TEST(FinishSurface, LooseCorners_AreMergedToTheFirst) {
  const Soup s = loose(box({}, {1, 1, 1}));
  const RestMesh m = finished(s);
  EXPECT_EQ(m.npoint(), 8u);
  EXPECT_EQ(m.merged_points, 28u);
  EXPECT_EQ(m.dropped_points, 0u);
  EXPECT_TRUE(mesh_statistics(m).closed);
  for (uint32_t p = 0; p < 8; ++p) {
    const Vec3 here = load3(&m.points[3 * size_t(p)]);
    for (uint32_t q = 0; q < s.points.size(); ++q)
      if (norm2(s.points[q] - here) == 0) {
        EXPECT_EQ(m.file_point[p], q) << "the first of those at one place";
        break;
      }
  }
}

TEST(FinishSurface, MinusZero_IsZero) {
  Soup s = loose(box({}, {1, 1, 1}));
  for (size_t i = 0; i < s.points.size(); i += 2)
    for (int k = 0; k < 3; ++k)
      if (s.points[i][k] == 0) s.points[i][k] = -0.0;
  EXPECT_EQ(finished(s).npoint(), 8u);
}

// A seam that was computed twice differs in its last digits: of a double, a single, or a text of six digits.
TEST(FinishSurface, OneRoundingApart_IsMerged) {
  for (const double scale : {1e-150, 1e-3, 1.0, 1e90})
    for (const double apart : {1e-16, 1e-7, 4e-6}) {
      Soup s = loose(box({0.5, 0.5, 0.5}, {1, 1, 1}));
      uint32_t n = 0;
      for (Vec3 &p : s.points) {
        p = {std::min(p.x + apart * (n % 3), 1.0), std::min(p.y + apart * (n % 2), 1.0), p.z};
        ++n;
      }
      const RestMesh m = finished(s, scale);
      EXPECT_EQ(m.npoint(), 8u) << scale << ' ' << apart;
      EXPECT_TRUE(mesh_statistics(m).closed) << scale << ' ' << apart;
      EXPECT_EQ(m.merged_points, 28u);
    }
  Soup s = loose(box({}, {1, 1, 1}));
  s.points[1].x = std::nextafter(s.points[1].x, 2);
  EXPECT_EQ(all_warnings(finished(s)),
            "27 points were merged with another at exactly the same place\n"
            "1 point on open edges was merged with another that differs by rounding only\n");
}

// The coordinate by which rounding is measured counts wherever its point stands in the file.
TEST(FinishSurface, OneRoundingApart_OfALargeCoordinateThatComesLast_IsMerged) {
  Soup s;
  s.points = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0.1 + 3e-6, 0, 0}, {0, 0.1, 0}, {1, 1, 0}};
  s.tris = {{0, 1, 2}, {3, 5, 4}};
  EXPECT_EQ(finished(s).npoint(), 4u);
}

// A slit that is meant is wider; points that are no ends of open edges stay, however near.
TEST(FinishSurface, FartherApart_IsNotMerged) {
  Soup s = loose(box({}, {1, 1, 1}));
  s.points[1].x += 3e-5;
  EXPECT_EQ(finished(s).npoint(), 9u);
  const Soup near = joined(box({}, {1, 1, 1}), box({1 + 1e-9, 0, 0}, {2, 1, 1}));
  EXPECT_EQ(finished(near).npoint(), 16u);
  const Soup small = box({0.5, 0.5, 0.5}, {0.5 + 1e-6, 0.5 + 1e-6, 0.5 + 1e-6});  // smaller than the rounding
  Soup open = joined(small, box({}, {1e-7, 1e-7, 1e-7}));
  open.tris.erase(open.tris.begin());
  EXPECT_EQ(finished(open).npoint(), 16u);
}

// Its edges are shorter than what rounding is taken to be beside a large triangle far out.
TEST(FinishSurface, SmallOpenTubeBesideALargeTriangle_KeepsItsPoints) {
  constexpr uint32_t n = 20;
  Soup s;
  s.points = {{100, 0, 0}, {99, 0, 0}, {100, 1, 0}};
  s.tris = {{0, 1, 2}};
  for (const double z : {0.0, 1e-3})
    for (uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * 3.14159265358979 * i / n;
      s.points.push_back({3e-3 * std::cos(angle), 3e-3 * std::sin(angle), z});
    }
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t a = 3 + i, b = 3 + (i + 1) % n;
    s.tris.push_back({a, b, b + n});
    s.tris.push_back({a, b + n, a + n});
  }
  EXPECT_EQ(finished(s).npoint(), 3 + 2 * n);
}

TEST(FinishSurface, TurnedAtRandom_FacesOutward) {
  for (const uint32_t every : {1u, 2u, 3u, 4u}) {
    const RestMesh m = finished(turned(box({}, {1, 1, 1}), every));
    const dfm_mesh_info st = mesh_statistics(m);
    EXPECT_TRUE(st.closed) << every;
    EXPECT_NEAR(st.volume, 1, 1e-15) << every;
    EXPECT_EQ(m.turned, (11 + every) / every);
  }
}

TEST(FinishSurface, AnySizeAndPlace_SameRepairs) {
  const Soup s = loose(turned(joined(box({}, {3, 3, 3}), box({1, 1, 1}, {2, 2, 2})), 3));
  for (const double scale : {1e-150, 1e-9, 1.0, 1e5, 1e90}) {
    const RestMesh m = finished(s, scale);
    const dfm_mesh_info st = mesh_statistics(m);
    EXPECT_EQ(m.npoint(), 16u) << scale;
    EXPECT_EQ(m.ntri(), 24u) << scale;
    EXPECT_TRUE(st.closed) << scale;
    EXPECT_NEAR(st.volume / scale / scale / scale, scale < 1e-100 ? 0 : 26, 1e-12) << scale;
    EXPECT_NEAR(st.quality_min, std::sqrt(3.0) / 2, 1e-12) << scale;
  }
  const dfm_mesh_info far = mesh_statistics(finished(s, 0.125, {1e7, -1e7, 1e7}));
  EXPECT_TRUE(far.closed);
  EXPECT_NEAR(far.volume, 26 * 0.125 * 0.125 * 0.125, 1e-12);
}

// Depth by depth: outside, wall of a hole, kernel in the hole, and a second kernel beside it.
TEST(FinishSurface, Nested_AlternatesOutwardAndIntoTheHole) {
  Soup s = joined(joined(box({0, 0, 0}, {9, 9, 9}), box({1, 1, 1}, {8, 8, 8})),
                  joined(box({2, 2, 2}, {4, 4, 4}), box({5, 5, 5}, {7, 7, 7})));
  for (const Soup &given : {s, turned(s), turned(s, 5)}) {
    const RestMesh m = finished(given);
    EXPECT_NEAR(mesh_statistics(m).volume, 729 - 343 + 8 + 8, 1e-11);
    EXPECT_EQ(mesh_statistics(m).npiece, 4u);
  }
}

TEST(FinishSurface, Crossing_IsNotNested) {
  const RestMesh m = finished(turned(joined(box({0, 0, 0}, {4, 4, 4}), box({1, 1, 1}, {3, 3, 5})), 2));
  EXPECT_NEAR(mesh_statistics(m).volume, 64 + 16, 1e-12);
}

// Both boxes within the other's bounding box would be wrong by one point or by boxes alone: the small one
// lies in the opening of an L.
TEST(FinishSurface, BesideInTheBoundingBox_IsNotNested) {
  Soup l = kTetrahedron;
  const RestMesh m = finished(turned(joined(l, box({0.7, 0.7, 0.7}, {0.9, 0.9, 0.9})), 3));
  EXPECT_NEAR(mesh_statistics(m).volume, 1.0 / 6 + 0.008, 1e-14);
}

TEST(FinishSurface, NestedPieceThatTouchesTheOuter_StillFacesIntoTheHole) {
  // shares the plane x = 0
  const RestMesh m = finished(joined(box({0, 0, 0}, {3, 3, 3}), box({0, 1, 1}, {2, 2, 2})));
  EXPECT_NEAR(mesh_statistics(m).volume, 27 - 2, 1e-12);
}

TEST(FinishSurface, MissingTriangles_AreCountedAndTheRestFacesOutward) {
  Soup s = joined(box({}, {1, 1, 1}), box({2, 0, 0}, {3, 1, 1}));
  s.tris.erase(s.tris.begin() + 12, s.tris.begin() + 14);  // z = 0 of the second: a square hole
  s.tris.erase(s.tris.begin() + 3);
  s.tris.erase(s.tris.begin());
  const RestMesh m = finished(turned(s));
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_FALSE(st.closed);
  EXPECT_EQ(st.open_edges, 10u);
  EXPECT_EQ(st.holes, 3u);
  EXPECT_EQ(m.turned, m.ntri());
  EXPECT_NE(all_warnings(m).find("the surface is open: 10 edges with one triangle around 3 holes"),
            std::string::npos)
      << all_warnings(m);
}

TEST(FinishSurface, RimsThatTouchInAPoint_AreTwo) {
  const Soup bow{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}};
  const dfm_mesh_info st = mesh_statistics(finished(bow));
  EXPECT_EQ(st.holes, 2u);
  EXPECT_EQ(st.open_edges, 6u);
  EXPECT_EQ(st.npiece, 1u);
}

TEST(FinishSurface, OpenSheet_KeepsTheSideOfItsMajority) {
  Soup s;
  for (uint32_t i = 0; i < 16; ++i) s.points.push_back({double(i % 4), double(i / 4), 0});
  for (uint32_t q = 0; q < 9; ++q) {
    const uint32_t a = q % 3 + 4 * (q / 3);
    s.tris.push_back({a, a + 5, a + 1});
    s.tris.push_back({a, a + 4, a + 5});
  }
  const RestMesh m = finished(turned(s, 4));
  EXPECT_EQ(m.turned, 5u);
  for (uint32_t t = 0; t < m.ntri(); ++t) {
    const uint32_t *c = &m.tris[3 * size_t(t)];
    const Vec3 a = load3(&m.points[3 * size_t(c[0])]);
    const Vec3 b = load3(&m.points[3 * size_t(c[1])]);
    const Vec3 d = load3(&m.points[3 * size_t(c[2])]);
    EXPECT_LT(cross(b - a, d - a).z, 0);
  }
}

TEST(FinishSurface, MoebiusStrip_IsReportedAndLeft) {
  Soup s;
  constexpr uint32_t n = 12;
  for (uint32_t i = 0; i < n; ++i)
    for (const double side : {-0.3, 0.3}) {
      const double angle = 2 * 3.14159265358979 * i / n, r = 1 + side * std::cos(angle / 2);
      s.points.push_back({r * std::cos(angle), r * std::sin(angle), side * std::sin(angle / 2)});
    }
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t a = 2 * i, b = a + 1, c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
    s.tris.push_back({a, c, b});
    s.tris.push_back({b, c, d});
  }
  const RestMesh m = finished(s);
  EXPECT_EQ(m.turned, 0u);
  EXPECT_NE(all_warnings(m).find("1 piece has no two sides"), std::string::npos) << all_warnings(m);
  EXPECT_EQ(mesh_statistics(m).holes, 1u);
}

TEST(FinishSurface, WithoutArea_IsDropped) {
  Soup s = box({}, {1, 1, 1});
  s.points.push_back({0.5, 0.5, 7});
  s.points.push_back({5, 5, 5});
  s.tris.push_back({0, 0, 1});
  s.tris.push_back({2, 2, 2});
  s.tris.push_back({8, 3, 8});
  const RestMesh m = finished(s);
  EXPECT_EQ(m.dropped_cells, 3u);
  EXPECT_EQ(m.dropped_points, 2u);
  EXPECT_TRUE(mesh_statistics(m).closed);
  EXPECT_EQ(all_warnings(m),
            "3 triangles without area were dropped\n2 points that no triangle uses were dropped\n");
}

// A flat triangle that closes a T-junction: dropping it would open a slit, so its neighbor is split.
TEST(FinishSurface, FlatAlongANeighborsSide_LeavesNoSlit) {
  Soup s = kTetrahedron;
  s.points.push_back({0.5, 0, 0});  // on the edge 0-1
  s.tris = {{0, 2, 1}, {0, 4, 3}, {4, 1, 3}, {0, 3, 2}, {1, 2, 3}, {0, 1, 4}};
  const RestMesh m = finished(s);
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_TRUE(st.closed);
  EXPECT_EQ(m.ntri(), 6u);
  EXPECT_NEAR(st.volume, 1.0 / 6, 1e-16);
  EXPECT_GT(st.quality_min, 0.3);
  EXPECT_EQ(all_warnings(m), "1 triangle without area was taken up by splitting the neighbor\n");
}

TEST(FinishSurface, FlatBesideFlat_IsTakenUpInTurn) {
  Soup s = kTetrahedron;
  s.points.push_back({0.25, 0, 0});
  s.points.push_back({0.5, 0, 0});
  s.points.push_back({0.75, 0, 0});
  s.tris = {{0, 2, 1}, {0, 4, 3}, {4, 5, 3}, {5, 6, 3}, {6, 1, 3},
            {0, 3, 2}, {1, 2, 3}, {0, 1, 5}, {0, 5, 4}, {5, 1, 6}};
  const RestMesh m = finished(s);
  EXPECT_TRUE(mesh_statistics(m).closed);
  EXPECT_EQ(m.ntri(), 10u);
  EXPECT_NEAR(mesh_statistics(m).volume, 1.0 / 6, 1e-16);
}

TEST(FinishSurface, ListedTwice_IsDropped) {
  Soup s = box({}, {1, 1, 1});
  s.tris.push_back(s.tris[3]);
  s.tris.push_back({s.tris[4][0], s.tris[4][2], s.tris[4][1]});
  s.tris.push_back(s.tris[5]);
  const RestMesh m = finished(s);
  EXPECT_EQ(m.ntri(), 12u);
  EXPECT_EQ(m.dropped_cells, 3u);
  EXPECT_TRUE(mesh_statistics(m).closed);
  EXPECT_EQ(all_warnings(m), "3 duplicate triangles were dropped\n");
}

// Two closed boxes face to face: keeping one side of the wall would leave edges of three triangles.
TEST(FinishSurface, TwoBoxesFaceToFace_BecomeOne) {
  const RestMesh m = finished(joined(box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1})));
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_TRUE(st.closed);
  EXPECT_EQ(m.ntri(), 20u);
  EXPECT_EQ(st.npiece, 1u);
  EXPECT_NEAR(st.volume, 2, 1e-15);
  EXPECT_NE(all_warnings(m).find("2 pairs of triangles where two pieces touch were dropped"),
            std::string::npos)
      << all_warnings(m);
}

TEST(FinishSurface, SheetWithBothSides_KeepsOne) {
  Soup s{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}}};
  const RestMesh m = finished(s);
  EXPECT_EQ(m.ntri(), 2u);
  EXPECT_EQ(mesh_statistics(m).area, 1);
}

TEST(FinishSurface, BoxesThatShareAnEdge_AreTurnedEachAndCounted) {
  Soup a = box({0, 0, 0}, {1, 1, 1}), b = box({1, 1, 0}, {2, 2, 1});
  const RestMesh m = finished(turned(joined(a, b), 3));
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_EQ(st.nonmanifold_edges, 1u);
  EXPECT_FALSE(st.closed);
  EXPECT_NEAR(st.volume, 2, 1e-14);
  EXPECT_EQ(st.npiece, 1u);
}

TEST(FinishSurface, FinOnABox_IsCountedAndTheBoxFacesOutward) {
  Soup s = turned(box({}, {1, 1, 1}), 2);
  s.points.push_back({0.5, -1, -1});
  s.tris.push_back({0, 1, 8});
  const RestMesh m = finished(s);
  const dfm_mesh_info st = mesh_statistics(m);
  EXPECT_EQ(st.nonmanifold_edges, 1u);
  EXPECT_EQ(st.open_edges, 2u);
  double volume = 0;
  for (uint32_t t = 0; t < 12; ++t) {
    const uint32_t *c = &m.tris[3 * size_t(t)];
    volume += dot(cross(load3(&m.points[3 * size_t(c[0])]), load3(&m.points[3 * size_t(c[1])])),
                  load3(&m.points[3 * size_t(c[2])])) /
              6;
  }
  EXPECT_NEAR(volume, 1, 1e-15);
}

TEST(FinishSurface, Tetrahedra_GiveTheirBoundaryWithTheGroupsOfTheSkin) {
  const RestMesh ball = make_ball(Memory::standard(), 1, 160);
  RawMesh raw(Memory::standard());
  raw.points = ball.points;
  raw.tets = ball.tets;
  std::swap(raw.tets[2], raw.tets[3]);                                        // an inverted cell
  raw.tets.insert(raw.tets.end(), ball.tets.begin(), ball.tets.begin() + 8);  // and two listed twice
  raw.points.insert(raw.points.end(), {9, 9, 9});
  raw.groups.push_back({"unused", 2, 4, {}});
  raw.groups.push_back({"skin", 2, 7, {}});
  const Array<uint32_t> skin = boundary_triangles(ball.tets);
  raw.tris.assign({skin[5], skin[4], skin[3]});
  raw.tri_group.assign({1});
  const RestMesh m = finish_surface("ball", std::move(raw));
  EXPECT_TRUE(mesh_statistics(m).closed);
  EXPECT_NEAR(mesh_statistics(m).volume, mesh_statistics(ball).volume, 1e-14);
  EXPECT_EQ(m.ntri(), skin.size() / 3);
  EXPECT_EQ(m.dropped_points, 1u);
  ASSERT_EQ(m.groups.size(), 1u);
  EXPECT_EQ(m.groups[0].name, "skin");
  EXPECT_EQ(m.groups[0].points.size(), 3u);
  EXPECT_EQ(std::count(m.tri_group.begin(), m.tri_group.end(), 0u), 1);
  EXPECT_EQ(m.tri_group[1], 0u);
}

// Where the cells only lie side by side in the file, the faces between them are no surface.
TEST(FinishSurface, CellsApartAtOnePlace_AreJoined) {
  const RestMesh beam = make_beam(Memory::standard(), 1, 1, 1, 12);
  RawMesh raw(Memory::standard());
  for (const uint32_t p : beam.tets) {
    raw.tets.push_back(raw.npoint());
    raw.points.insert(raw.points.end(), &beam.points[3 * size_t(p)], &beam.points[3 * size_t(p)] + 3);
  }
  const RestMesh m = finish_surface("cells", std::move(raw));
  EXPECT_EQ(m.ntri(), boundary_triangles(beam.tets).size() / 3);
  EXPECT_EQ(m.merged_points, beam.tets.size() - beam.npoint());
  EXPECT_EQ(m.dropped_points, 0u);
  EXPECT_NEAR(mesh_statistics(m).volume, 1, 1e-14);
}

TEST(FinishSurface, Groups_FollowTheirTriangles) {
  RawMesh raw = raw_of(loose(box({}, {1, 1, 1})));
  raw.groups.push_back({"b", 2, 9, {}});
  raw.groups.push_back({"a", 2, 3, {}});
  raw.tri_group[0] = raw.tri_group[1] = 0;
  raw.tri_group[2] = 1;
  const RestMesh m = finish_surface("soup", std::move(raw));
  ASSERT_EQ(m.groups.size(), 2u);
  EXPECT_EQ(m.groups[0].name, "a");
  EXPECT_EQ(m.groups[1].points.size(), 4u);
  EXPECT_EQ(m.tri_group[0], 1u);
  EXPECT_EQ(m.tri_group[2], 0u);
  EXPECT_EQ(m.tri_group[3], kNoGroup);
}

TEST(FinishSurface, NothingThere_IsRefusedWithASentence) {
  EXPECT_NE(refused(RawMesh(Memory::standard())).find("soup: no triangles"), std::string::npos);
  Soup line{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}}};
  EXPECT_NE(refused(raw_of(line)).find("all 1 triangles are without area"), std::string::npos);
  Soup bad = kTetrahedron;
  bad.points[2].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(raw_of(bad)).find("point 2"), std::string::npos);
}

TEST(FinishSurface, OutOfMemoryAnywhere_LeaksNothing) {
  Soup s = loose(joined(turned(box({}, {3, 3, 3}), 2), box({1, 1, 1}, {2, 2, 2})));
  s.points[0].x += 1e-9;
  for (size_t n = 1; n < 200; ++n) {
    test::CountedMemory memory;
    bool done = false;
    {
      RawMesh raw(memory.hooks);
      const RawMesh given = raw_of(s);
      raw.points.assign(given.points.begin(), given.points.end());
      raw.tris.assign(given.tris.begin(), given.tris.end());
      memory.refuse_from = memory.calls + n;
      try {
        finish_surface("soup", std::move(raw));
        done = true;
      } catch (const std::bad_alloc &) {}
    }
    EXPECT_EQ(memory.held, 0u) << n;
    if (done) return;
  }
  ADD_FAILURE() << "never came through";
}
