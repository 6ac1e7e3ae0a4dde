#include <gtest/gtest.h>

#include <set>

#include "core/hash.h"
#include "detect_scene.h"
#include "geometry/area.h"
#include "geometry/closest.h"

namespace {

using namespace dfm;
using namespace test;

// A probe: a tiny tetrahedron whose lowest corner is at `tip`, so that one surfel meets the other surface.
constexpr double kProbe = 0.02;
Mesh probe(Vec3 tip, Quat q = {}) {
  return moved(tetrahedron_mesh({0, 0, 0}, {kProbe, 0, 2 * kProbe}, {-kProbe, kProbe, 2 * kProbe},
                                {-kProbe, -kProbe, 2 * kProbe}),
               q, tip);
}
std::vector<ContactPoint> of_tip(const Scene &scene, uint32_t body, uint32_t surfel) {
  std::vector<ContactPoint> found;
  for (const ContactPoint &c : scene.contacts())
    if (c.slot_a == body && c.type_a == 0 && c.feature_a == surfel && !c.obstacle) found.push_back(c);
  return found;
}

// A floor with a valley or a ridge along y at x = 0: two slabs that rise to both sides by
// `rise`, closed below.
Mesh folded_floor(double rise, int n) {
  Welder w;
  for (int side = 0; side < 2; ++side) {
    const double x0 = side ? 0 : -1, x1 = side ? 1 : 0, z0 = side ? 0 : rise, z1 = side ? rise : 0;
    w.patch({x0, -1, z0}, {x1 - x0, 0, z1 - z0}, {0, 2, 0}, n, 2 * n);
    w.patch({x0, -1, -3}, {0, 2, 0}, {x1 - x0, 0, 0}, 2 * n, n);
  }
  return w.mesh;
}

TEST(VertexFace, PointOverFace_HasFaceNormalAndBarycentricWeights) {
  Scene scene;
  scene.add(probe({0.1, 0.3, 0.5005}));
  scene.add(box_mesh({2, 2, 1}, 2, 2, 1));
  const auto c = of_tip(scene, 0, 0);
  ASSERT_EQ(c.size(), 1u);
  EXPECT_NEAR(c[0].distance, 5e-4, 1e-15);
  EXPECT_EQ(c[0].normal[2], 1.0);
  EXPECT_EQ(c[0].kind, kVertexFace);
  EXPECT_EQ(c[0].nnode, 4);
  EXPECT_DOUBLE_EQ(c[0].area, facing_area(*scene.surfaces[0], 0, -load3(c[0].normal)) / 2);
  EXPECT_EQ(flaw(scene, scene.contacts()), "");
}

TEST(VertexFace, Reach_GrowsWithRelativeSpeedOnly) {
  for (const double speed : {0.0, 1.0, 5.0})
    for (const double common : {0.0, 100.0}) {
      const double reach = 2e-3 + 2e-3 * speed;
      for (const double part : {0.99, 1.01}) {
        Scene scene;
        scene.add(probe({0.1, 0.3, 0.5 + part * reach}), {0, 0, common - speed});
        scene.add(box_mesh({2, 2, 1}, 2, 2, 1), {0, 0, common});
        EXPECT_EQ(of_tip(scene, 0, 0).size(), part < 1 ? 1u : 0u) << speed << " " << common;
      }
    }
}

// Slides a tip over a flat face cut into triangles: exactly one contact everywhere, always with the plane's
// own normal and distance.
TEST(VertexFace, SlideOverFlatTriangulation_SeesNoBump) {
  Scene scene;
  scene.add(probe({0, 0, 0}));
  scene.add(moved(box_mesh({2, 2, 1}, 7, 5, 1), turn({0, 0, 1}, 0.3), {0, 0, -0.5}));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-0.6, 0.6);
  const Surface &floor = *scene.surfaces[1];
  std::vector<Vec3> tips;
  for (int i = 0; i < 400; ++i) tips.push_back({unit(random), unit(random), 1e-3});
  for (uint32_t e = 0; e < floor.nedge; ++e) {  // right above edges and corners
    const Vec3 a = load3(&floor.x[4 * floor.edge[2 * e]]), b = load3(&floor.x[4 * floor.edge[2 * e + 1]]);
    for (const double t : {0.0, 0.25, 0.5})
      if (a.z > -0.1 && b.z > -0.1) {
        const Vec3 p = a + t * (b - a);
        if (std::fabs(p.x) < 0.6 && std::fabs(p.y) < 0.6)
          for (const double off : {0.0, 1e-16, 1e-12, 1e-9, -1e-7})
            tips.push_back({p.x + off, p.y - off, 1e-3});
      }
  }
  Surface &s = *scene.surfaces[0];
  const Mesh at_origin = probe({0, 0, 0});
  for (const Vec3 tip : tips) {
    for (uint32_t i = 0; i < s.nsurfel; ++i) store3(&s.x[4 * i], at_origin.at(i) + tip);
    const auto c = of_tip(scene, 0, 0);
    ASSERT_EQ(c.size(), 1u) << tip.x << " " << tip.y;
    EXPECT_NEAR(c[0].distance, 1e-3, 1e-12);
    EXPECT_NEAR(c[0].normal[2], 1, 1e-9);
    EXPECT_LT(std::hypot(c[0].normal[0], c[0].normal[1]), 1e-5);
  }
  EXPECT_GT(tips.size(), 600u);
}

// Round a tessellated cylinder at a constant distance from its surface: one contact each, the normal within
// the faces' own spread.
// unsanitized: too slow there; shorter tests run the same code
TEST(VertexFace, SlideRoundCylinder_OneContactWithTurningNormal) {
  const int n = 32;
  Scene scene;
  scene.add(probe({0, 0, 0}));
  const Mesh cylinder = cylinder_mesh(0.5, 1, n, 8);
  scene.add(cylinder);
  Surface &s = *scene.surfaces[0];
  std::set<uint64_t> keys;
  Vec3 last;
  for (int i = 0; i < 1000; ++i) {
    const double angle = 0.001 * M_PI * i, radius = 0.5005;
    const Vec3 out{std::cos(angle), 0, std::sin(angle)};
    const Vec3 tip{radius * out.x, 0.013 + 1e-4 * i, radius * out.z};
    const Mesh p = probe(tip, turn({0, 1, 0}, M_PI / 2 - angle));
    for (uint32_t k = 0; k < s.nsurfel; ++k) store3(&s.x[4 * k], p.at(k));
    scene.offset = 4e-3;
    const auto c = of_tip(scene, 0, 0);
    ASSERT_EQ(c.size(), 1u) << i;
    const Vec3 normal = load3(c[0].normal);
    EXPECT_GT(dot(normal, out), std::cos(1.01 * M_PI / n));
    EXPECT_GT(c[0].distance, 0);
    EXPECT_LT(c[0].distance, 0.0005 + 0.5 * (1 - std::cos(M_PI / n)) + 1e-9);
    keys.insert(c[0].key);
    last = normal;
  }
  EXPECT_LT(last.x, -0.9);
  EXPECT_EQ(keys.size(), 1u) << "one patch, one key";
}

TEST(VertexFace, OverConvexEdgeAndCorner_OneContactAlongTheDirection) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 3, 3, 3));
  scene.add(probe({0, 0, 0}));
  Surface &s = *scene.surfaces[1];
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 300; ++i) {
    const bool corner = i % 2;
    const Vec3 d = 1.5e-3 * normalized(Vec3{unit(random), corner ? unit(random) : 0, unit(random)});
    const Vec3 tip = Vec3{0.5, corner ? 0.5 : unit(random) - 0.5, 0.5} + d, across = cross({0, 0, 1}, d);
    const double lean = std::acos(d.z / norm(d));  // the tip points at the box
    const Mesh pointed = probe(tip, lean > 0 ? turn(across, lean) : Quat{});
    for (uint32_t k = 0; k < s.nsurfel; ++k) store3(&s.x[4 * k], pointed.at(k));
    const auto c = of_tip(scene, 1, 0);
    ASSERT_EQ(c.size(), 1u);
    EXPECT_NEAR(c[0].distance, 1.5e-3, 1e-12);
    EXPECT_LT(norm(load3(c[0].normal) - normalized(d)), 1e-9);
    EXPECT_EQ(flaw(scene, scene.contacts()), "");
  }
}

// A step in a floor: beside the riser both planes hold the tip, in front and behind of the fold alike.
TEST(VertexFace, InValley_BothPlanesHold) {
  for (const double rise : {0.2, 1.0, 2.0}) {
    Scene scene;
    scene.add(folded_floor(rise, 4));
    const Vec3 n0 = normalized({rise, 0, 1}), n1 = normalized({-rise, 0, 1});
    scene.add(probe({0, 0.1, 1e-3 * std::sqrt(1 + rise * rise)}), {1, 0, 0});
    const auto c = of_tip(scene, 1, 0);
    ASSERT_EQ(c.size(), 2u) << rise;
    int seen = 0;
    for (const ContactPoint &k : c)
      for (const Vec3 n : {n0, n1})
        if (norm(load3(k.normal) - n) < 1e-9) {
          ++seen;
          EXPECT_NEAR(k.distance, 1e-3, 1e-12);
        }
    EXPECT_EQ(seen, 2);
    EXPECT_NE(c[0].key, c[1].key);
    EXPECT_EQ(flaw(scene, scene.contacts()), "");
  }
}

// Above one side of a gentle valley, about to reach the other side within the step: the other plane is there
// in advance, with weights that sum to one and no torque.
TEST(VertexFace, NearValley_PlaneAcrossIsExtrapolated) {
  Scene scene;
  scene.add(folded_floor(0.2, 4));
  const Vec3 n0 = normalized({0.2, 0, 1});
  const double s = 1e-3;  // beside the fold, above the left side
  scene.add(probe(Vec3{-s, 0.1, 0.2 * s} + 1e-4 * n0), {2, 0, 0});
  const auto c = of_tip(scene, 1, 0);
  ASSERT_EQ(c.size(), 2u);
  EXPECT_EQ(flaw(scene, scene.contacts()), "");
  const ContactPoint &across = c[0].normal[0] < 0 ? c[0] : c[1];
  double most = 0;
  for (int k = 1; k < across.nnode; ++k) most = std::max(most, across.weight[k]);
  EXPECT_GT(most, 0) << "extrapolated: one weight of side b has the other sign";
  EXPECT_GT(across.distance, 1e-4);
  // Far from the fold, or slow, there is nothing to reach.
  Scene slow;
  slow.add(folded_floor(0.2, 4));
  slow.add(probe(Vec3{-5 * s, 0.1, 5 * 0.2 * s} + 1e-4 * n0), {0.001, 0, 0});
  EXPECT_EQ(of_tip(slow, 1, 0).size(), 1u);
}

// A block whose wall at x = 0 has a shallow valley along its diagonal. A surfel that flies over the block
// passes the extended plane of the wall's lower triangle, which bounds nothing there.
TEST(VertexFace, OverTheTopOfAFoldedWall_OnlyTheTopHolds) {
  const Vec3 low0{0, -1, -1}, low1{-0.1, 1, -1}, high0{-0.1, -1, 0}, high1{0, 1, 0};
  const Vec3 back0{3, -1, -1}, back1{3, 1, -1}, back2{3, -1, 0}, back3{3, 1, 0};
  Welder w;
  w.triangle(low0, high1, low1);
  w.triangle(low0, high0, high1);
  w.triangle(high0, back2, back3);
  w.triangle(high0, back3, high1);
  w.triangle(low0, back1, back0);
  w.triangle(low0, low1, back1);
  w.triangle(low0, back0, back2);
  w.triangle(low0, back2, high0);
  w.triangle(low1, high1, back3);
  w.triangle(low1, back3, back1);
  w.triangle(back0, back1, back3);
  w.triangle(back0, back3, back2);
  Scene scene;
  scene.h = 0.2;
  scene.add(w.mesh);
  scene.add(probe({0.07, 0.5, 0.5}), {2, 0, 0});
  const auto c = of_tip(scene, 1, 0);
  ASSERT_EQ(c.size(), 1u);
  EXPECT_GT(c[0].normal[2], 0.99);
  // Lower, in front of the wall, the same plane is there in advance.
  Scene before;
  before.h = 0.2;
  before.add(w.mesh);
  before.add(probe({-0.06, -0.5, -0.55}), {2, 0, 0});
  EXPECT_EQ(of_tip(before, 1, 0).size(), 2u);
}

// A block whose front face, at x = 0, has a shallow groove from bottom to top at y = 0. A surfel below the
// front face, beside the groove, passes under the block: the other side's plane bounds nothing there.
TEST(VertexFace, BelowAGroovedFrontFace_NoPlaneOfItHolds) {
  for (const bool turned : {false, true}) {
    const Vec3 low[3] = {{0, -1, 0}, {0.02, 0, 0}, {0, 1, 0}},
               high[3] = {{0, -1, 1}, {0.02, 0, 1}, {0, 1, 1}};
    const Vec3 back[4] = {{3, -1, 0}, {3, 1, 0}, {3, -1, 1}, {3, 1, 1}};
    Welder w;
    w.triangle(low[0], high[0], turned ? low[1] : high[1]);
    w.triangle(turned ? high[0] : low[0], high[1], low[1]);
    w.triangle(low[1], high[1], high[2]);  // touches the bottom by one corner
    w.triangle(low[1], high[2], low[2]);
    for (int i = 0; i < 2; ++i) {
      w.triangle(low[i], low[i + 1], back[0]);
      w.triangle(high[i + 1], high[i], back[2]);
    }
    w.triangle(low[2], back[1], back[0]);
    w.triangle(high[2], back[2], back[3]);
    w.triangle(back[0], back[1], back[3]);
    w.triangle(back[0], back[3], back[2]);
    w.triangle(low[0], back[0], back[2]);
    w.triangle(low[0], back[2], high[0]);
    w.triangle(low[2], high[2], back[3]);
    w.triangle(low[2], back[3], back[1]);
    Scene scene;
    scene.add(w.mesh);
    // the tip points up, under the leading edge
    scene.add(probe({0.0188, -2e-3, -1e-3}, turn({0, 1, 0}, 3.14159265358979)), {2, 0, 0});
    for (const ContactPoint &k : of_tip(scene, 1, 0))
      EXPECT_LT(k.normal[2], -0.5) << turned << ": " << k.normal[0] << " " << k.normal[1] << " "
                                   << k.normal[2];
    // In front of the face, the other side of the groove is there in advance.
    Scene before;
    before.add(w.mesh);
    before.add(probe({0.0188, -2e-3, 0.5}, turn({0, 1, 0}, 1.5707963)), {2, 0, 0});
    EXPECT_EQ(of_tip(before, 1, 0).size(), 2u);
  }
}

TEST(VertexFace, SlightlyInside_IsPushedOutThroughTheNearestFace) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 4, 4, 4));
  scene.add(probe({0.49, 0.03, 0.498}));  // 2 mm below the top, 10 mm beside the side
  auto c = of_tip(scene, 1, 0);
  ASSERT_EQ(c.size(), 1u);
  EXPECT_NEAR(c[0].distance, -2e-3, 1e-12);
  EXPECT_EQ(c[0].normal[2], 1.0);
  // Deeper than a quarter edge: the nearest face is not trusted any more.
  Scene deep;
  deep.add(box_mesh({1, 1, 1}, 4, 4, 4));
  deep.add(probe({0.05, 0.03, 0.40}));
  EXPECT_TRUE(of_tip(deep, 1, 0).empty());
}

// A plate thinner than the recovery depth: a tip under it is held below, never pulled through to the top.
TEST(VertexFace, ThinPlate_FarSideDoesNotPull) {
  for (const double below : {-5e-4, 1e-5, 5e-4, 1e-3}) {
    Scene scene;
    scene.add(box_mesh({1, 1, 4e-3}, 4, 4, 1));
    scene.add(probe({0.05, 0.03, -2e-3 - below}, turn({1, 0, 0}, M_PI)));
    const auto c = of_tip(scene, 1, 0);
    ASSERT_EQ(c.size(), 1u) << below;
    EXPECT_LT(c[0].normal[2], -0.999);
    EXPECT_NEAR(c[0].distance, below, 1e-12);
  }
}

// Inside the corner of an L both planes push, also when the tip has gone below both.
TEST(VertexFace, BelowBothPlanesOfValley_BothPush) {
  Scene scene;
  scene.add(folded_floor(1, 4));
  scene.add(probe({1e-5, 0.1, -2e-4}));
  const auto c = of_tip(scene, 1, 0);
  ASSERT_EQ(c.size(), 2u);
  for (const ContactPoint &k : c) EXPECT_LT(k.distance, 0);
  EXPECT_LT(c[0].normal[0] * c[1].normal[0], 0);
  EXPECT_EQ(flaw(scene, scene.contacts()), "");
}

// The nearest distance over all contacts equals the brute-force distance of two bodies apart, from every
// direction: no gap in the rules.
TEST(FindContacts, NearestContact_IsTheDistanceOfTheBodies) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  const Mesh meshes[3] = {box_mesh({1, 0.7, 0.5}, 1, 1, 1), sphere_mesh(0.5, 1),
                          tetrahedron_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1, 0.2, 0.8})};
  int edges = 0, faces = 0, rims = 0, exact = 0, pairs = 0;
  for (int i = 0; i < 600; ++i) {
    Scene scene;
    scene.offset = 0.05;
    scene.h = 0;
    const auto any_turn = [&] { return turn(Vec3{normal(random), normal(random), normal(random)}, 1 + i); };
    scene.add(moved(meshes[i % 3], any_turn(), {}));
    Surface &b = scene.add(moved(meshes[(i / 3) % 3], any_turn(), {}));
    const Surface &a = *scene.surfaces[0];
    const auto distance = [&] {
      double least = 1e9;
      for (int side = 0; side < 2; ++side) {
        const Surface &p = side ? b : a, &q = side ? a : b;
        for (uint32_t v = 0; v < p.nsurfel; ++v)
          for (uint32_t t = 0; t < q.ntri; ++t)
            least = std::min(least, closest_on_triangle(load3(&p.x[4 * v]), load3(&q.x[4 * q.tri[3 * t]]),
                                                        load3(&q.x[4 * q.tri[3 * t + 1]]),
                                                        load3(&q.x[4 * q.tri[3 * t + 2]]))
                                        .distance2);
      }
      for (uint32_t e = 0; e < a.nedge; ++e)
        for (uint32_t f = 0; f < b.nedge; ++f)
          least = std::min(
              least, closest_segments(load3(&a.x[4 * a.edge[2 * e]]), load3(&a.x[4 * a.edge[2 * e + 1]]),
                                      load3(&b.x[4 * b.edge[2 * f]]), load3(&b.x[4 * b.edge[2 * f + 1]]))
                         .distance2);
      return std::sqrt(least);
    };
    // From far away toward each other until they are 0.03 to 0.09 apart.
    const Vec3 way = normalized({normal(random), normal(random), normal(random)});
    for (uint32_t v = 0; v < b.nsurfel; ++v) store3(&b.x[4 * v], load3(&b.x[4 * v]) + 3.0 * way);
    double d = distance();
    for (int k = 0; k < 200 && d > 0.09; ++k) {
      const double go = std::max(0.5 * (d - 0.03), 0.005);
      for (uint32_t v = 0; v < b.nsurfel; ++v) store3(&b.x[4 * v], load3(&b.x[4 * v]) - go * way);
      d = distance();
    }
    if (d > 0.099 || d < 1e-3) continue;
    const auto contacts = scene.contacts();
    ASSERT_EQ(flaw(scene, contacts), "");
    double least = 1e9;
    const ContactPoint *nearest = nullptr;
    for (const ContactPoint &c : contacts)
      if (c.distance < least) {
        least = c.distance;
        nearest = &c;
      }
    ASSERT_NE(nearest, nullptr) << "pair " << i << " at distance " << d;
    // Exact, but for edges that meet within a thousandth of their ends: there the end stands for them, x
    // further along the other edge.
    const double x = 1e-3 * 1.4;  // no edge of these meshes is longer than 1.4
    EXPECT_GE(least, d - 1e-9) << "pair " << i;
    EXPECT_LE(least, std::sqrt(d * d + x * x) + 1e-9) << "pair " << i;
    exact += least < d + 1e-9;
    ++pairs;
    const Vec3 n = load3(nearest->normal);
    EXPECT_GT(dot(n, way) * (nearest->slot_a == 1 ? 1 : -1), 0);
    edges += nearest->kind == kEdgeEdge;
    faces += nearest->kind == kVertexFace && nearest->nnode == 4;
    rims += nearest->kind == kVertexFace && nearest->nnode < 4;
  }
  EXPECT_GT(edges, 50);
  EXPECT_GT(faces, 50);
  EXPECT_GT(rims, 10);
  EXPECT_GT(exact, 0.97 * pairs);
}

Scene crossed_tetrahedra(double gap) {
  Scene scene;
  scene.add(tetrahedron_mesh({-1, 0, 0}, {1, 0, 0}, {0, -0.5, -1}, {0, 0.5, -1}));
  scene.add(tetrahedron_mesh({0, -1, gap}, {0, 1, gap}, {-0.5, 0, gap + 1}, {0.5, 0, gap + 1}));
  return scene;
}

// Only edges meet; no vertex of either is near the other (Zerbato 2010, 4.2, misses this case).
TEST(EdgeEdge, CrossedTetrahedra_MeetEdgeOnEdge) {
  Scene scene = crossed_tetrahedra(1e-3);
  const auto c = scene.contacts();
  ASSERT_EQ(c.size(), 1u);
  EXPECT_EQ(c[0].kind, kEdgeEdge);
  EXPECT_EQ(c[0].slot_a, 0u);
  EXPECT_NEAR(c[0].distance, 1e-3, 1e-15);
  EXPECT_NEAR(c[0].normal[2], -1, 1e-15);  // from b (above) to a
  EXPECT_NEAR(c[0].point[2], 0.5e-3, 1e-15);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(std::fabs(c[0].weight[k]), 0.5, 1e-12);
  EXPECT_EQ(flaw(scene, c), "");
  EXPECT_EQ(c[0].indentation, 0);  // nothing else holds the edges apart
  // No end has a contact of its own, so the nearest end (all equally near: the first) lends its share.
  EXPECT_DOUBLE_EQ(c[0].area, facing_area(*scene.surfaces[0], 0, -load3(c[0].normal)) / 2);
}

// The same with the upper one moved, and moving.
Scene moving_tetrahedra(double gap, Vec3 shift, Vec3 velocity) {
  Scene scene = crossed_tetrahedra(gap);
  Surface &upper = *scene.surfaces[1];
  for (uint32_t s = 0; s < upper.nsurfel; ++s) {
    store3(&upper.x[4 * s], load3(&upper.x[4 * s]) + shift);
    store3(&upper.v[4 * s], velocity);
  }
  return scene;
}
std::vector<ContactPoint> crossings(const Scene &scene) {  // of the first edges
  std::vector<ContactPoint> out;
  for (const ContactPoint &c : scene.contacts())
    if (c.kind == kEdgeEdge && c.feature_a == 0 && c.feature_b == 0) out.push_back(c);
  return out;
}

// The upper edge starts a little beyond the end of the lower one and slides in over it: at the end of the
// sub-step they would be through each other without ever having been seen side by side. At rest the same
// place makes no edge contact.
TEST(EdgeEdge, EdgeThatSlidesInOverAnEnd_IsSeenBefore) {
  EXPECT_TRUE(crossings(moving_tetrahedra(1e-3, {1.02, 0, 0}, {})).empty());
  const auto edges = crossings(moving_tetrahedra(1e-3, {1.02, 0, 0}, {-50, 0, -5}));
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_NEAR(edges[0].weight[0], -0.01, 1e-12);
  EXPECT_NEAR(edges[0].weight[1], 1.01, 1e-12);
  EXPECT_NEAR(edges[0].distance, 1e-3, 1e-12);
}

// Beside the end, the edges pass each other. Neither a body that falls past another, nor one that moves away
// from the end or along the other's edge, may be held.
TEST(EdgeEdge, EdgeThatPassesAnEnd_IsNoContact) {
  for (const Vec3 velocity : {Vec3{0, 0, -50}, {50, 0, -5}, {0, 50, -5}, {0, -50, -5}})
    EXPECT_TRUE(crossings(moving_tetrahedra(1e-3, {1.02, 0, 0}, velocity)).empty());
}

// What counts is how the crossing moves, not an end of the edge: here the far end of the upper edge turns in.
TEST(EdgeEdge, CrossingBeyondAnEnd_MovesWithTheEdgesThere) {
  for (const double turning : {-50.0, 50.0}) {
    Scene scene = moving_tetrahedra(1e-3, {1.02, -0.9, 0}, {});
    Surface &upper = *scene.surfaces[1];
    for (uint32_t s = 0; s < upper.nsurfel;
         ++s) {  // about a place of the upper edge that is off its crossing
      const Vec3 r = load3(&upper.x[4 * s]) - Vec3{1.02, -0.3, 0};
      store3(&upper.v[4 * s], {-turning * r.y, turning * r.x, -5});
    }
    EXPECT_EQ(crossings(scene).size(), turning > 0 ? 1u : 0u);
  }
}

// Lists of candidates hold edges within reach alone, so a crossing beyond ends makes no contact of others.
TEST(EdgeEdge, LinesThatAreNearerThanTheirEdges_AreNoContact) {
  for (const double past : {0.02, 0.065}) {
    const Vec3 velocity{-36, -36, -1};
    const Scene scene = moving_tetrahedra(0.08, {1 + past, 1 + past, 0}, velocity);
    const double reach = contact_reach(scene.h, scene.offset, norm(velocity));
    EXPECT_LT(0.08, reach);
    EXPECT_EQ(crossings(scene).size(), std::sqrt(0.08 * 0.08 + 2 * past * past) < reach ? 1u : 0u) << past;
  }
}

TEST(EdgeEdge, SlightPenetration_KeepsItsSign) {
  Scene scene = crossed_tetrahedra(-1e-3);
  const auto c = scene.contacts();
  ASSERT_EQ(c.size(), 1u);
  EXPECT_NEAR(c[0].distance, -1e-3, 1e-15);
  EXPECT_NEAR(c[0].normal[2], -1, 1e-15);
  EXPECT_EQ(flaw(scene, c), "");
}

TEST(EdgeEdge, ParallelEdges_AreLeftToVertexFace) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 1, 1, 1));
  // edge along edge, diagonally above
  scene.add(moved(box_mesh({1, 1, 1}, 1, 1, 1), {}, {0.3, 1.0005, 1.0005}));
  const auto c = scene.contacts();
  EXPECT_EQ(flaw(scene, c), "");
  ASSERT_FALSE(c.empty());
  for (const ContactPoint &k : c) {
    EXPECT_EQ(k.kind, kVertexFace);
    EXPECT_NEAR(k.distance, 5e-4 * std::sqrt(2.0), 1e-12);
  }
}

// Edges inside flat faces never count, whatever crosses them.
TEST(EdgeEdge, FlatFaces_HaveNoEdgeContacts) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 5, 5, 2));
  scene.add(moved(box_mesh({0.6, 0.6, 1}, 7, 3, 2), turn({0, 0, 1}, 0.4), {0, 0, 1.001}));
  const auto c = scene.contacts();
  EXPECT_EQ(flaw(scene, c), "");
  size_t faces = 0;
  for (const ContactPoint &k : c) {
    EXPECT_NEAR(std::fabs(k.normal[2]), 1, 1e-9);
    if (k.kind == kVertexFace) ++faces;
    if (k.kind == kEdgeEdge) ADD_FAILURE() << "edge " << k.feature_a << " on " << k.feature_b;
  }
  EXPECT_GE(faces, 32u + 4u);
}

// Edges that bore each other count on though load has pressed them flat or a little hollow: exactly those
// two, and only while the normal is in the cone of a face that leans up by less than its slack, 2 degrees and
// what the edges can turn within the sub-step.
TEST(EdgeEdge, FlatButBoreInTheLastSubStep_CountsOnWithinItsCone) {
  for (const double rise : {0.0, 0.02, 0.06}) {
    Scene scene;
    Mesh lower = box_mesh({1, 1, 1}, 1, 1, 1);
    for (uint32_t i = 0; i < lower.npoint(); ++i)
      // beside the diagonal of the upper face: it is a valley
      if (const Vec3 p = lower.at(i); p.z > 0 && p.x * p.y < 0) lower.x[3 * i + 2] += rise;
    scene.add(lower);
    scene.add(moved(box_mesh({0.2, 0.2, 1}, 1, 1, 1), turn({0, 0, 1}, 0.5 * M_PI), {0, 0, 1.001}));
    const Surface &a = *scene.bodies[0].surface, &b = *scene.bodies[1].surface;
    const auto edges = [&](std::span<const Crossing> bore) {
      std::vector<Crossing> found;
      for (const ContactPoint &c : scene.contacts(scene.all(), bore))
        if (c.kind == kEdgeEdge)
          found.push_back({scene.bodies[0].id, scene.bodies[1].id, c.feature_a, c.feature_b});
      return found;
    };
    EXPECT_TRUE(edges({}).empty());
    std::vector<Crossing> any;
    for (uint32_t i = 0; i < a.nedge; ++i)
      for (uint32_t j = 0; j < b.nedge; ++j) any.push_back({scene.bodies[0].id, scene.bodies[1].id, i, j});
    const std::vector<Crossing> found = edges(any);
    if (rise > 0.05) {
      EXPECT_TRUE(found.empty());
      continue;
    }
    ASSERT_EQ(found.size(), 1u) << rise;
    EXPECT_EQ(edges(found), found);
    Crossing other = found[0];
    other.edge_b = (other.edge_b + 1) % b.nedge;
    EXPECT_TRUE(edges({&other, 1}).empty());
  }
}

// Of two edges that cross, one lies in a face that is flat or nearly so, to the rest distance: it gives way
// under load, less and less where both rise by more than that. Not between the faces of a cut.
TEST(EdgeEdge, CrossingInAFlatFace_GivesWayUnderLoad) {
  constexpr double kOffset = 0.01;
  const auto indentation = [](double rise, bool cut) {
    Scene scene;
    scene.h = 0;
    scene.offset = kOffset;
    Mesh lower = box_mesh({1, 1, 1}, 1, 1, 1), upper = box_mesh({0.2, 0.2, 1}, 1, 1, 1);
    // Ridges along the diagonals, of a height above the middle of the other diagonal.
    const auto fold = [](Mesh &m, bool top, double by) {
      for (uint32_t i = 0; i < m.npoint(); ++i)
        if (const Vec3 p = m.at(i); (p.z > 0) == top && p.x * p.y < 0) m.x[3 * i + 2] += by;
    };
    fold(lower, true, -5 * rise);  // the diagonal above is a fifth as long
    fold(upper, false, 0.2 * rise);
    scene.add(lower);
    scene.add(moved(upper, turn({0, 0, 1}, 0.5 * M_PI), {0, 0, 1 + kOffset}));
    for (auto &s : scene.surfaces) s->back = cut ? 0.5 * kOffset : 0;
    std::vector<Crossing> any;
    for (uint32_t i = 0; i < scene.bodies[0].surface->nedge; ++i)
      for (uint32_t j = 0; j < scene.bodies[1].surface->nedge; ++j)
        any.push_back({scene.bodies[0].id, scene.bodies[1].id, i, j});
    std::vector<double> out;
    for (const ContactPoint &c : scene.contacts(scene.all(), any))
      // the one of the diagonals, not those of rims
      if (c.kind == kEdgeEdge && std::hypot(c.point[0], c.point[1]) < 1e-9)
        out.push_back(c.indentation / kOffset);
    EXPECT_EQ(out.size(), 1u) << rise;
    return out.empty() ? -1 : out[0];
  };
  EXPECT_DOUBLE_EQ(indentation(0, false), 0.3);
  EXPECT_NEAR(indentation(0.9 * kOffset, false), 0.3, 1e-3);
  EXPECT_NEAR(indentation(1.5 * kOffset, false), 0.15, 1e-2);
  EXPECT_EQ(indentation(2.1 * kOffset, false), 0);
  EXPECT_EQ(indentation(0, true), 0);
}

// A tilted edge over a rim: the closest points of the lines lie inside both, but the distance falls on along
// the edge, so it is no minimum.
TEST(EdgeEdge, DirectionOutsideTheCone_IsNoContact) {
  for (const double tilt : {-0.5, 0.5}) {
    Scene scene;
    scene.h = 0;
    scene.offset = 0.05;
    scene.add(box_mesh({1, 1, 1}, 1, 1, 1));
    // Its lower edge runs in x and z through (0.5, 0.1, 0.52), down to the inside or to the outside.
    const Vec3 u{1, 0, tilt}, at{0.5, 0.1, 0.56};
    scene.add(tetrahedron_mesh(at - 0.06 * u, at + 0.8 * u, at + Vec3{0, 0.4, 1}, at + Vec3{0, -0.4, 1}));
    size_t edges = 0;
    for (const ContactPoint &c : scene.contacts()) edges += c.kind == kEdgeEdge;
    EXPECT_EQ(edges, tilt > 0 ? 0u : 1u) << tilt;
  }
}

// An edge contact lives on the share of a corner that touches nothing by itself, and no corner gives twice.
TEST(EdgeEdge, Area_ComesFromFreeCorners) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 5, 5, 2));
  scene.add(moved(box_mesh({0.8, 0.8, 1}, 7, 3, 2), turn({0, 0, 1}, 0.4), {0, 0, 1.001}));
  const auto contacts = scene.contacts();
  std::set<uint32_t> touching;
  for (const ContactPoint &c : contacts)
    if (c.kind == kVertexFace) touching.insert(c.node[0]);
  size_t edges = 0;
  double given = 0, free = 0;
  std::set<uint32_t> corners;
  for (const ContactPoint &c : contacts) {
    if (c.kind != kEdgeEdge) continue;
    ++edges;
    given += c.area;
    for (int k = 0; k < c.nnode; ++k) {
      const uint32_t body = c.node[k] < scene.surfaces[0]->nsurfel ? 0 : 1;
      if (!touching.count(c.node[k]) && corners.insert(c.node[k]).second)
        free += 0.5 * facing_area(*scene.surfaces[body], c.node[k] - scene.bodies[body].first_node,
                                  {0, 0, body ? -1.0 : 1.0});
    }
  }
  EXPECT_GE(edges, 8u);
  EXPECT_GT(given, 0);
  EXPECT_LE(given, free * (1 + 1e-12));
}

// The areas of a fully touching patch sum to the patch, from both sides in halves.
TEST(FindContacts, SummedArea_IsTheTouchingPatch) {
  Scene scene;
  scene.add(box_mesh({4, 4, 1}, 24, 24, 4));
  scene.add(moved(box_mesh({1, 1, 1}, 30, 31, 4), turn({0, 0, 1}, 0.2), {0, 0, 1.001}));
  double area = 0;
  for (const ContactPoint &c : scene.listed()) area += c.area;
  EXPECT_NEAR(area, 1, 0.02);
}

TEST(FindContacts, SwappedBodies_GiveMirroredContacts) {
  Scene one, two;
  const Mesh m = sphere_mesh(0.5, 2);
  const Mesh n = moved(box_mesh({1, 1, 1}, 3, 3, 3), turn({1, 2, 3}, 0.7), {0.9, 0.3, 0.2});
  one.offset = two.offset = 0.02;
  one.add(m);
  one.add(n);
  two.add(n);
  two.add(m);
  const auto a = one.contacts(), b = two.contacts();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 3u);
  for (const ContactPoint &c : a) {
    int matches = 0;
    for (const ContactPoint &d : b) {
      if (c.kind != d.kind || norm(load3(c.point) - load3(d.point)) > 1e-12) continue;
      const bool same_side = c.slot_a == 1 - d.slot_a;
      EXPECT_EQ(same_side, c.kind == kVertexFace);
      EXPECT_NEAR(c.distance, d.distance, 1e-14);
      EXPECT_LT(norm(load3(c.normal) - (same_side ? 1.0 : -1.0) * load3(d.normal)), 1e-12);
      ++matches;
    }
    EXPECT_EQ(matches, 1);
  }
}

TEST(FindContacts, Translation_KeepsContacts) {
  Scene one, two;
  const Vec3 shift{10, 20, 30};
  const Mesh m = sphere_mesh(0.5, 2), n = moved(sphere_mesh(0.5, 2), turn({1, 2, 3}, 0.7), {0.9, 0.3, 0.2});
  for (Scene *s : {&one, &two}) {
    s->offset = 0.02;
    const Vec3 by = s == &one ? Vec3{} : shift;
    s->add(moved(m, {}, by));
    s->add(moved(n, {}, by));
    ObstacleView &o = s->add(Shape::box, by + Vec3{-0.7, 0, 0}, turn({1, 1, 0}, 0.5));
    o.half_size = {0.2, 0.2, 0.2};
  }
  const auto a = one.contacts(), b = two.contacts();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 5u);
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].key, b[i].key);
    EXPECT_NEAR(a[i].distance, b[i].distance, 1e-12);
    EXPECT_LT(norm(load3(a[i].point) + shift - load3(b[i].point)), 1e-12);
    EXPECT_LT(norm(load3(a[i].normal) - load3(b[i].normal)), 1e-9);
  }
}

// One value for gcc and clang, -O0 and -O2. The scene is made with + - * / sqrt alone.
TEST(FindContacts, FixedScene_HasItsGoldenHash) {
  Scene scene;
  scene.offset = 0.02;
  const double q[4] = {0.3, -0.2, 0.5, 0.7};
  scene.add(sphere_mesh(0.5, 2), {0.5, 0.1, 0});
  scene.add(moved(box_mesh({1, 0.8, 0.6}, 4, 3, 2), unit_quat(q), {0.8, 0.2, 0.3}));
  scene.add(moved(sphere_mesh(0.3, 2), {}, {-0.2, 0.77, 0.1}));
  scene.add(Shape::plane, {0, 0, -0.49});
  ObstacleView &o = scene.add(Shape::capsule, {-0.3, 0, 0.5}, unit_quat(q));
  o.radius = 0.05;
  o.half_length = 0.4;
  ObstacleView &box = scene.add(Shape::box, {0.2, -0.6, 0.1}, unit_quat(q));
  box.half_size = {0.2, 0.2, 0.2};
  const auto contacts = scene.contacts();
  EXPECT_EQ(flaw(scene, contacts), "");
  ASSERT_GT(contacts.size(), 20u);
  Hash hash;
  for (const ContactPoint &c : contacts) hash.add(c);
  EXPECT_EQ(hash.value, 6420961922599741145u);
}

TEST(FindContacts, CallOrderOfViews_DoesNotMatter) {
  Scene scene;
  scene.offset = 0.02;
  scene.add(sphere_mesh(0.5, 2));
  scene.add(moved(sphere_mesh(0.5, 2), {}, {0.99, 0, 0}));
  const auto c = scene.all();
  const auto a = scene.contacts(c);
  std::swap(scene.bodies[0], scene.bodies[1]);
  EXPECT_TRUE(same_bits(a, scene.contacts(c)));
}

TEST(FindContacts, BlocksOnSeveralThreads_GiveTheBitsOfOne) {
  Scene scene;
  const Mesh cylinder = cylinder_mesh(0.2, 1, 48, 40);
  scene.add(cylinder, {0, 0, -0.3});
  scene.add(moved(cylinder, turn({0, 0, 1}, 0.02), {0.4005, 0.01, 0.003}));
  scene.add(Shape::plane, {0, 0, -0.2004});
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  const Array<Candidate> &list = broad.candidates();
  ASSERT_GT(list.size(), 1000u) << "too few for blocks";
  const Array<ContactPoint> one = scene.contacts(list);
  ASSERT_GT(one.size(), 20u);
  NarrowBlocks blocks(Memory::standard());
  for (const uint32_t threads : {2u, 3u, 8u}) {
    Tasks tasks(threads, nullptr, nullptr);
    for (int again = 0; again < 20; ++again) {
      Array<ContactPoint> out;
      Array<uint8_t> lent;
      find_contacts(scene.bodies, scene.obstacles, list, scene.h, scene.offset, {}, lent, out, &blocks,
                    &tasks);
      ASSERT_TRUE(same_bits(out, one)) << threads << " threads";
    }
  }
}

TEST(FindContacts, BlockWithoutMemoryOnTwoThreads_ThrowsInTheCaller) {
  Scene scene;
  const Mesh cylinder = cylinder_mesh(0.2, 1, 48, 40);
  scene.add(cylinder);
  scene.add(moved(cylinder, turn({0, 0, 1}, 0.02), {0.4005, 0.01, 0.003}));
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  Memory refusing = Memory::standard();
  refusing.alloc = [](void *, size_t, size_t) -> void * { return nullptr; };
  NarrowBlocks blocks(refusing);
  Tasks tasks(2, nullptr, nullptr);
  Array<ContactPoint> out;
  Array<uint8_t> lent;
  EXPECT_THROW(find_contacts(scene.bodies, scene.obstacles, broad.candidates(), scene.h, scene.offset, {},
                             lent, out, &blocks, &tasks),
               std::bad_alloc);
}

TEST(FindContacts, DegenerateShapes_StayFinite) {
  const Mesh box = box_mesh({1, 1, 1}, 2, 2, 2);
  for (int kind = 0; kind < 5; ++kind) {
    Scene scene;
    scene.offset = 0.01;
    Surface &s = scene.add(box);
    scene.add(moved(box, {}, {0.2, 0.1, 0.4}));
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      double *x = &s.x[4 * i];
      if (kind == 0) x[0] = x[1] = x[2] = 0.5;  // one point
      if (kind == 1) x[1] = x[2] = 0;           // a line
      if (kind == 2) x[2] = 0.6;                // a sheet
      if (kind == 3) x[0] = -x[0];              // inside out
      if (kind == 4 && i % 3 == 0) x[0] = NAN;
    }
    for (const Shape shape : {Shape::plane, Shape::sphere, Shape::box, Shape::capsule}) {
      ObstacleView &o = scene.add(shape, {0.5, 0.1, 0.1});
      o.half_size = {0.3, 0.3, 0.3};
      o.radius = 0.3;
      o.half_length = 0;
    }
    const auto c = scene.contacts();
    if (kind != 4) {
      EXPECT_EQ(flaw(scene, c), "") << kind;
      continue;
    }
    for (const ContactPoint &k : c)
      EXPECT_TRUE(std::isfinite(k.distance) && std::isfinite(k.normal[0]) && std::isfinite(k.point[0]));
  }
}

}  // namespace
