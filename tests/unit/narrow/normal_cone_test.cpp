// Cones of normals (geometry/convex.h): a feature makes a contact only along a direction in which it is the
// first of its surface. Flat patches have no ghosts at the rim of what slides over them, what sticks out
// keeps its contact, and next to an edge's end either the end has it or the edge.
#include <gtest/gtest.h>

#include <set>

#include "detect_scene.h"
#include "geometry/convex.h"

namespace {

using namespace dfm;
using namespace test;

// A surfel at the origin with six neighbors, the first in direction x, at the heights h.
Surface fan(const std::array<double, 6> &h) {
  Mesh m;
  m.add({0, 0, 0});
  for (int k = 0; k < 6; ++k) m.add({std::cos(k * M_PI / 3), std::sin(k * M_PI / 3), h[size_t(k)]});
  for (uint32_t k = 0; k < 6; ++k) m.tri.insert(m.tri.end(), {0, 1 + k, 1 + (k + 1) % 6});
  Surface s;
  make_surface(Memory::standard(), m.npoint(), m.x.data(), m.tri.data(), m.ntri(), s);
  return s;
}
Vec3 lean(double x, double y) { return normalized(Vec3{x, y, 1}); }

// A floor of triangles with edges of 1/6 and a block on it, its left rim `off` beside a row of the floor's
// vertices (in rest distances; > 0: they are off the block).
Scene block_on_floor(double off, double speed, int cells) {
  Scene scene;
  scene.h = 1e-4;
  scene.add(box_mesh({4, 4, 1}, 24, 24, 4));
  scene.add(
      moved(box_mesh({1, 1, 1}, cells, cells + 1, 2), {}, {0.5 + off * scene.offset, 0.31, 1 + scene.offset}),
      {-speed, 0.3 * speed, 0});
  return scene;
}

}  // namespace

TEST(NormalCone, FlatVertex_HoldsItsNormalAlone) {
  const Surface s = fan({0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(vertex_cone_has(s, 0, {0, 0, 1}));
  EXPECT_TRUE(vertex_cone_has(s, 0, lean(1e-6, -1e-6)));
  for (int k = 0; k < 12; ++k)
    EXPECT_FALSE(vertex_cone_has(s, 0, lean(1e-4 * std::cos(0.1 + k), 1e-4 * std::sin(0.1 + k)))) << k;
}

TEST(NormalCone, Spike_HoldsWhatItsSidesAllow) {
  const Surface s = fan({-1, -1, -1, -1, -1, -1});  // sides fall by 45 degrees along the edges
  for (const double x : {-0.99, -0.5, 0.0, 0.5, 0.99}) EXPECT_TRUE(vertex_cone_has(s, 0, lean(x, 0))) << x;
  for (const double x : {-1.01, 1.01, 3.0}) EXPECT_FALSE(vertex_cone_has(s, 0, lean(x, 0))) << x;
  EXPECT_FALSE(vertex_cone_has(s, 0, {0, 0, -1}));
}

TEST(NormalCone, Ridge_HoldsDirectionsAcrossIt) {
  const double fall = -0.2 * std::sqrt(3.0) / 2;
  const Surface s = fan({0, fall, fall, 0, fall, fall});  // a ridge along x
  EXPECT_TRUE(vertex_cone_has(s, 0, lean(0, 0.19)));
  EXPECT_FALSE(vertex_cone_has(s, 0, lean(0, 0.21)));
  EXPECT_FALSE(vertex_cone_has(s, 0, lean(0.01, 0)));
}

// At the bottom of a groove no direction is free, but the groove's own normal must be: what lies in the
// groove rests on such vertices.
TEST(NormalCone, Hollow_HoldsItsMeanNormal) {
  const double rise = 0.2 * std::sqrt(3.0) / 2;
  for (const Surface &s : {fan({0, rise, rise, 0, rise, rise}), fan({0.3, 0.3, 0.3, 0.3, 0.3, 0.3})}) {
    EXPECT_TRUE(vertex_cone_has(s, 0, {0, 0, 1}));
    EXPECT_FALSE(vertex_cone_has(s, 0, lean(0, 0.01)));
  }
}

// Floor vertices that are off the block by less than the reach must be there, or nothing is tested: without
// the rule they make contacts that lean by 45 degrees and more. Edges of flat faces, of which hundreds
// cross, make none.
TEST(NormalCone, BlockOnFlatBody_HasUprightContactsOnly) {
  for (const double speed : {0.0, 1.0, 20.0})
    for (const double off : {-3.0, -0.5, -0.01, 0.0, 0.01, 0.1, 0.5, 1.0, 1.7, 3.0}) {
      const Scene scene = block_on_floor(off, speed, 5);
      const Array<ContactPoint> contacts = scene.listed();
      EXPECT_EQ(flaw(scene, contacts), "");
      std::set<std::array<uint32_t, 3>> owners;
      for (const ContactPoint &c : contacts) {
        EXPECT_LT(std::hypot(c.normal[0], c.normal[1]), 2 * kConvex)
            << "off " << off << ", surfel " << c.feature_a << " of " << c.slot_a;
        EXPECT_EQ(c.kind, kVertexFace);
        EXPECT_TRUE(owners.insert({c.slot_a, c.type_a, c.feature_a}).second) << "owned twice";
      }
      // 42 of the block's, and of the floor's those under it: 6 of 6, 7 where it has a row under either rim.
      EXPECT_EQ(contacts.size(), 42u + (off == 0 ? 42u : 36u)) << off;
    }
}

// Blocks whose bulging sides are flush: edges in the sides face the same way and press on nothing, also where
// blocks approach so fast that edges count as longer past their ends. twist: makes the diagonals of the sides
// convex, one way or the other.
TEST(NormalCone, FlushBlocks_HaveNoContactAcrossTheirSides) {
  for (const double speed : {0.0, 1.0, 20.0})
    for (const double twist : {-4e-3, 4e-3})
      for (const double shift : {-1e-5, 0.0, 1e-5}) {
        Mesh block = box_mesh({1, 1, 1}, 4, 4, 4);
        for (uint32_t i = 0; i < block.npoint(); ++i) {
          const Vec3 p = block.at(i);
          const double round = 1 + 4e-3 * (1 - 2 * norm2(p));
          store3(&block.x[3 * i],
                 {(round + twist * p.y * p.z) * p.x, (round + twist * p.x * p.z) * p.y, p.z});
        }
        Scene scene;
        scene.add(block);
        scene.add(moved(block, {}, {shift, shift, 1 + scene.offset}), {0, 0, -speed});
        const Array<ContactPoint> contacts = scene.listed();
        EXPECT_GE(contacts.size(), 30u);
        for (const ContactPoint &c : contacts)
          EXPECT_GT(std::fabs(c.normal[2]), 0.9) << speed << ' ' << twist << ' ' << shift;
      }
}

// Half from either side, and the fine side's own half is the patch to a percent wherever the rims lie.
// unsanitized: too slow there; shorter tests run the same code
TEST(NormalCone, BlockOnFlatBody_CarriesThePatchOnce) {
  for (const double off : {0.0, 0.1, 20.0, 50.0, 83.0, 120.0}) {
    Scene scene;
    scene.add(box_mesh({2, 2, 0.5}, 100, 100, 4));
    scene.add(moved(box_mesh({1, 1, 0.5}, 30, 31, 4), turn({0, 0, 1}, 0.2),
                    {0.01 + off * 1e-4, 0, 0.5 + scene.offset}));
    double area = 0;
    for (const ContactPoint &c : scene.listed()) area += c.area;
    EXPECT_NEAR(area, 1, 0.02) << off;
  }
}

// Two convex edges that cross near the end of one: over the end's cone the end has the contact, beside it the
// edges, nowhere none, nowhere both.
TEST(NormalCone, CrossingNearAnEnd_HasOneContact) {
  // lengths of the lower edge (2) past its end
  for (const double beyond : {-1.1e-3, -0.9e-3, -1e-4, -1e-9, 0.0, 1e-9, 1e-4, 1e-3}) {
    Scene scene;
    scene.add(tetrahedron_mesh({-1, 0, 0}, {1, 0, 0}, {0, -0.5, -1}, {0, 0.5, -1}));
    const double x = 1 + 2 * beyond, gap = 1.5e-3;
    scene.add(tetrahedron_mesh({x, -1, gap}, {x, 1, gap}, {x - 0.5, 0, gap + 1}, {x + 0.5, 0, gap + 1}));
    scene.offset = 2e-3;
    const auto c = scene.contacts();
    ASSERT_EQ(c.size(), 1u) << beyond;
    EXPECT_EQ(c[0].kind, beyond < -1e-8 ? kEdgeEdge : kVertexFace) << beyond;
    EXPECT_NEAR(c[0].distance, beyond < 0 ? gap : std::hypot(gap, 2 * beyond), 1e-12) << beyond;
  }
}

// Nothing that bears is lost: an edge that lies in a groove of a body's own vertices rests on them.
TEST(NormalCone, EdgeInAGroove_RestsOnItsVertices) {
  Welder w;
  for (int side = 0; side < 2; ++side) {
    const double x0 = side ? 0 : -1, z0 = side ? 0 : 0.1, z1 = side ? 0.1 : 0;
    w.patch({x0, -1, z0}, {1, 0, z1 - z0}, {0, 2, 0}, 4, 8);
    w.patch({x0, -1, -3}, {0, 2, 0}, {1, 0, 0}, 8, 4);
  }
  Scene scene;
  scene.add(w.mesh);
  const double gap = 1e-3;
  scene.add(tetrahedron_mesh({0, -0.9, gap}, {0, 0.9, gap}, {-0.1, 0, gap + 1}, {0.1, 0, gap + 1}));
  uint32_t groove = 0;
  for (const ContactPoint &c : scene.contacts())
    if (c.slot_a == 0 && c.kind == kVertexFace) {
      ++groove;
      EXPECT_NEAR(c.normal[2], -1, 1e-9);
      EXPECT_NEAR(c.distance, gap, 1e-12);
    }
  EXPECT_EQ(groove, 7u) << "all but the two at the rims of the floor";
}

// A box slides off a flat soft face: the same rule against a closed form.
TEST(NormalCone, FlatVertexOffABox_MakesNoContact) {
  for (const bool sharp : {false, true}) {
    Scene scene;
    if (sharp) scene.add(tetrahedron_mesh({0, 0, 0}, {0.1, 0, -1}, {-0.1, 0.1, -1}, {-0.1, -0.1, -1}));
    else scene.add(moved(box_mesh({2, 2, 1}, 4, 4, 2), {}, {0, 0, -0.5}));
    ObstacleView &box = scene.add(Shape::box, {0.4 + 5e-4, 0, 0.3 + 1e-3});
    // the surfel at the origin is off its left face by half the rest distance
    box.half_size = {0.4, 0.4, 0.3};
    int leaning = 0;
    for (const ContactPoint &c : scene.contacts()) leaning += c.type_a == 0 && std::fabs(c.normal[0]) > 0.1;
    EXPECT_EQ(leaning, sharp ? 1 : 0);
  }
}
