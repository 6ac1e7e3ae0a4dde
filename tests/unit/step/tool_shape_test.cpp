// What rigid contact finds of a mesh through its tree has the bits of a search through every triangle, and
// costs what is near, not what is there.
#include "step/rigid/tool_shape.h"

#include <algorithm>
#include <random>
#include <set>

#include "body/obstacle_mesh.h"
#include "geometry/closest.h"
#include "obstacle.h"

namespace {

using dfm::Extent;
using dfm::ToolShape;
using dfm::Vec3;

// Of a mesh in its place, without help of any list.
struct Everything {
  const dfm::Surface &s;
  Vec3 node(uint32_t i) const { return dfm::load3(&s.x[4 * size_t{i}]); }
  Vec3 corner(uint32_t t, size_t k) const { return node(s.tri[3 * size_t{t} + k]); }
  bool holds(const Extent &near, uint32_t t) const {
    Extent box;
    for (size_t k = 0; k < 3; ++k) box.add(corner(t, k));
    return near.meets(box);
  }
  Vec3 normal(uint32_t t) const {
    return dfm::normalized(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
  }
  std::vector<uint32_t> edges(const Extent &near) const {
    std::vector<uint32_t> out;
    for (uint32_t e = 0; e < s.nedge; ++e) {
      Extent box;
      for (size_t k = 0; k < 2; ++k) box.add(node(s.edge[2 * size_t{e} + k]));
      if (near.meets(box)) out.push_back(e);
    }
    return out;
  }
  bool flat(uint32_t e) const {
    const uint32_t *const t = &s.edge_tri[2 * size_t{e}];
    return t[0] != dfm::kNone && t[1] != dfm::kNone && norm(normal(t[0]) - normal(t[1])) < 1e-6;
  }
  bool may_meet(uint32_t corner, Vec3 n) const {
    Vec3 out;
    for (uint32_t t = 0; t < s.ntri; ++t)
      if (std::count(&s.tri[3 * size_t{t}], &s.tri[3 * size_t{t}] + 3, corner)) out += normal(t);
    bool sharp = true, leads = true;
    for (uint32_t e = 0; e < s.nedge; ++e) {
      const uint32_t *const end = &s.edge[2 * size_t{e}];
      if (end[0] != corner && end[1] != corner) continue;
      const Vec3 way = dfm::normalized(node(end[end[0] == corner]) - node(corner));
      sharp = sharp && dot(out, way) < -0.1 * norm(out);
      leads = leads && dot(n, way) < 1e-3;
    }
    return sharp || leads;
  }
  double distance2(Vec3 p, const Extent &near) const {
    double least = HUGE_VAL;
    for (uint32_t t = 0; t < s.ntri; ++t)
      if (holds(near, t))
        least =
            std::min(least, dfm::closest_on_triangle(p, corner(t, 0), corner(t, 1), corner(t, 2)).distance2);
    return least;
  }
};

void same_bits(Vec3 a, Vec3 b) {
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
}

test::Triangles hills(uint32_t n, double half) {
  return test::height_field(half, n,
                            [](double x, double y) { return 0.1 * std::sin(5 * x) * std::cos(4 * y); });
}

dfm::ObstacleMesh mesh_of(const test::Triangles &m) {
  return {dfm::Memory::standard(), uint32_t(m.points.size() / 3), m.points.data(),
          uint32_t(m.tris.size() / 3), m.tris.data()};
}

dfm::ObstacleView view_of(const dfm::ObstacleMesh &m) {
  dfm::ObstacleView v{};
  v.shape = dfm::Shape::mesh;
  v.position = m.position;
  v.rotation = m.rotation;
  v.extent = m.extent;
  v.surface = &m.surface;
  return v;
}

class Random {
 public:
  double in(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(engine_); }
  Vec3 point(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  dfm::Quat rotation() {
    const double q[4] = {in(-1, 1), in(-1, 1), in(-1, 1), in(-1, 1)};
    return dfm::unit_quat(q);
  }

 private:
  std::mt19937 engine_{7};
};

void compare(dfm::ObstacleMesh &with, dfm::ObstacleMesh &without, const Extent &near, Random &random,
             size_t &found) {
  const Everything all{without.surface};
  ToolShape tree(view_of(with), &with), plain(view_of(without), &without);
  same_bits(tree.bounds().lo, plain.bounds().lo);
  same_bits(tree.bounds().hi, plain.bounds().hi);
  for (const bool flat : {false, true}) {
    tree.look_at(near, flat);
    plain.look_at(near, flat);
    std::vector<uint32_t> edges = all.edges(near);
    if (!flat) std::erase_if(edges, [&](uint32_t e) { return all.flat(e); });
    std::set<uint32_t> corners;
    ASSERT_EQ(tree.edges().size(), edges.size());
    ASSERT_EQ(plain.edges().size(), edges.size());
    for (size_t i = 0; i < edges.size(); ++i) {
      const ToolShape::Edge &e = tree.edges()[i], &f = plain.edges()[i];
      EXPECT_EQ(e.number, edges[i]);
      EXPECT_EQ(e.faces, f.faces);
      same_bits(e.from, f.from);
      same_bits(e.to, f.to);
      for (int k = 0; k < 2; ++k) same_bits(e.beside[k], f.beside[k]);
      for (const uint32_t c : e.end)
        if (near.meets({all.node(c), all.node(c)})) corners.insert(c);
    }
    ASSERT_EQ(tree.corners().size(), corners.size());
    auto next = corners.begin();
    for (const ToolShape::Corner &c : tree.corners()) {
      EXPECT_EQ(c.number, *next++);
      same_bits(c.at, all.node(c.number));
      const Vec3 n = dfm::normalized(random.point(1));
      EXPECT_EQ(tree.may_meet(c, n), all.may_meet(c.number, n));
    }
    found += edges.size();
    for (int i = 0; i < 5; ++i) {
      const Vec3 p = all.node(uint32_t(random.in(0, all.s.nsurfel))) + random.point(0.1);
      dfm::ObstaclePoint a{}, b{};
      bool face_a = false, face_b = false;
      const bool is = tree.closest(p, HUGE_VAL, a, &face_a);
      ASSERT_EQ(is, plain.closest(p, HUGE_VAL, b, &face_b));
      ASSERT_EQ(is, std::isfinite(all.distance2(p, near)));
      if (!is) continue;
      same_bits(a.point, b.point);
      same_bits(a.normal, b.normal);
      EXPECT_EQ(a.distance, b.distance);
      EXPECT_EQ(face_a, face_b);
      // of places that are equal but for 1e-9 it takes the triangle that faces p most
      const double least = all.distance2(p, near);
      EXPECT_NEAR(a.distance * a.distance, least, 1e-8 * least + 1e-12);
    }
  }
}

}  // namespace

// Poses near and far, and boxes with corners of the mesh on their border. A triangle counts whose box in the
// world is near, also where it has no point there: a tree in the frame of the mesh has to find it, too.
TEST(ToolShape, ThroughTheTree_FindsWhatASearchThroughEveryTriangleFinds) {
  Random random;
  size_t found = 0;
  for (const test::Triangles &m : {hills(12, 0.5),
                                   test::height_field(
                                       0.5, 8, [](double, double) { return 0.0; }, 0),
                                   test::box_surface({0.2, 0.3, 0.1}, 3)}) {
    dfm::ObstacleMesh with = mesh_of(m), without = mesh_of(m);
    with.make_tree(dfm::Memory::standard());
    for (int round = 0; round < 60; ++round) {
      const Vec3 at = random.point(round % 3 == 2 ? 1000.0 : 1.0);
      const dfm::Quat turned = round % 3 == 0 ? dfm::Quat{} : random.rotation();
      for (dfm::ObstacleMesh *const mesh : {&with, &without}) mesh->place(at, turned, {}, {});
      const Vec3 node = dfm::load3(&with.surface.x[4 * size_t(random.in(0, with.surface.nsurfel))]);
      const Vec3 half = {random.in(0, 0.3), random.in(0, 0.3), random.in(0, 0.3)};
      compare(with, without, {node - half, node + half}, random, found);
      compare(with, without, {node, node + half}, random, found);  // a corner on its border
      compare(with, without, {node, node}, random, found);
    }
    const Vec3 wide = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    compare(with, without, {-wide, wide}, random, found);
    compare(with, without, {{1e5, 0, 0}, {2e5, 1, 1}}, random, found);
  }
  EXPECT_GT(found, 10000u);
}

// Above a plane nothing is listed that is not near; of what is under it, all.
TEST(ToolShape, UnderAPlane_FindsEveryCornerThatIsThere) {
  Random random;
  dfm::ObstacleMesh mesh = mesh_of(test::box_surface({0.2, 0.3, 0.1}, 6));
  mesh.make_tree(dfm::Memory::standard());
  size_t listed = 0, under = 0;
  for (int round = 0; round < 200; ++round) {
    mesh.place(random.point(1), random.rotation(), {}, {});
    const Vec3 n = round % 4 == 0 ? Vec3{0, 0, 1} : dfm::normalized(random.point(1));
    const uint32_t touches = uint32_t(random.in(0, mesh.surface.nsurfel));
    const double height = dot(n, Everything{mesh.surface}.node(touches));
    ToolShape shape(view_of(mesh), &mesh);
    shape.select_below(n, height, true);
    std::set<uint32_t> found;
    for (const ToolShape::Corner &c : shape.corners()) found.insert(c.number);
    for (uint32_t i = 0; i < mesh.surface.nsurfel; ++i) {
      if (!(dot(n, Everything{mesh.surface}.node(i)) <= height)) continue;
      ++under;
      EXPECT_TRUE(found.count(i)) << "round " << round;
    }
    listed += found.size();
  }
  EXPECT_LT(listed, 2 * under);
}

// The bounds are those of the place where the mesh is, also after it has gone back.
TEST(ToolShape, BoundsOfAMesh_FollowItsPlace) {
  dfm::ObstacleMesh mesh = mesh_of(test::box_surface({0.2, 0.3, 0.1}, 1));
  mesh.place({1, 0, 0}, {}, {}, {});
  EXPECT_NEAR(mesh.bounds().hi.x, 1.2, 1e-15);
  mesh.place({2, 0, 0}, {}, {}, {});
  EXPECT_NEAR(mesh.bounds().hi.x, 2.2, 1e-15);
  EXPECT_NEAR(mesh.bounds().lo.x, 1.8, 1e-15);
  mesh.place({1, 0, 0}, {}, {}, {});
  EXPECT_NEAR(mesh.bounds().hi.x, 1.2, 1e-15);
}

// A box of a tenth of a meter on squares of a twentieth: from a hundred triangles to a hundred thousand.
TEST(ToolShape, InALargeMesh_LooksAtWhatIsNear) {
  std::vector<uint32_t> near;
  for (const uint32_t n : {7u, 22u, 71u, 224u}) {
    dfm::ObstacleMesh mesh = mesh_of(hills(n, 0.025 * n));
    mesh.make_tree(dfm::Memory::standard());
    const double q[4] = {0.1, -0.2, 0.3, 1};
    mesh.place({0.3, 0.2, 0.1}, dfm::unit_quat(q), {}, {});
    const Vec3 half = {0.05, 0.05, 0.05};
    const uint64_t looks = mesh.triangles_near(mesh.position - half, mesh.position + half, near);
    EXPECT_LE(near.size(), 100u) << mesh.surface.ntri;
    EXPECT_LE(looks, 100 + 20 * std::log2(mesh.surface.ntri)) << mesh.surface.ntri;
  }
}
