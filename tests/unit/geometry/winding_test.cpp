// Winding numbers against solid angles known in closed form, and the tree against the sum over all triangles.
#include "geometry/winding.h"

#include <gtest/gtest.h>

#include "../mesh/fill_support.h"

namespace {

using dfm::RestMesh;
using dfm::Vec3;
using dfm::WindingTree;

WindingTree tree_of(const RestMesh &m) {
  return WindingTree(dfm::Memory::standard(), m.points.data(), m.ntri(), m.tris.data());
}

// Places spread over a cube of half size `reach`, none special.
std::vector<Vec3> places(uint32_t n, double reach) {
  std::vector<Vec3> out;
  double u = 0.5, v = 0.5, w = 0.5;
  for (uint32_t i = 0; i < n; ++i) {
    u = std::fmod(u + 0.8191725134, 1);
    v = std::fmod(v + 0.6710436067, 1);
    w = std::fmod(w + 0.5497004779, 1);
    out.push_back({reach * (2 * u - 1), reach * (2 * v - 1), reach * (2 * w - 1)});
  }
  return out;
}

TEST(Winding, ClosedSurface_OneInsideZeroOutside) {
  const RestMesh box = test::box_surface({-0.5, -0.3, -0.2}, {0.5, 0.3, 0.2});
  const WindingTree tree = tree_of(box);
  for (const Vec3 &p : places(2000, 0.7)) {
    const bool inside = std::fabs(p.x) < 0.5 && std::fabs(p.y) < 0.3 && std::fabs(p.z) < 0.2;
    EXPECT_NEAR(tree.exactly_at(p), inside ? 1 : 0, 1e-13) << p.x << " " << p.y << " " << p.z;
  }
}

TEST(Winding, CubeWithoutAFace_FromItsCenterFiveSixths) {
  RestMesh cube = test::box_surface({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  test::remove(cube, 0);
  test::remove(cube, 0);
  EXPECT_NEAR(tree_of(cube).exactly_at({}), 5.0 / 6, 1e-15);
}

TEST(Winding, OneTriangle_AnOctantIsAnEighthAndItsBackIsMinusThat) {
  RestMesh m = test::surface_of({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}});
  EXPECT_NEAR(tree_of(m).exactly_at({}), 0.125, 1e-16);
  test::flip(m, 0);
  EXPECT_NEAR(tree_of(m).exactly_at({}), -0.125, 1e-16);
}

// The cap of a sphere within angle a around its pole has the solid angle 2 pi (1 - cos a); here its rim is
// a polygon, so the exact sum over the rest of the sphere must equal one minus what the removed triangles
// are seen under.
TEST(Winding, SphereWithAHole_MissesTheSolidAngleOfTheHole) {
  RestMesh whole = test::sphere_surface(0.5, 4), hole = whole;
  RestMesh cap = test::surface_of({}, {});
  cap.points = whole.points;
  for (uint32_t t = whole.ntri(); t-- > 0;) {
    double z = 0;
    for (int k = 0; k < 3; ++k) z += whole.points[3 * size_t(whole.tris[3 * size_t(t) + size_t(k)]) + 2] / 3;
    if (z < 0.48) continue;
    for (int k = 0; k < 3; ++k) cap.tris.push_back(whole.tris[3 * size_t(t) + size_t(k)]);
    test::remove(hole, t);
  }
  ASSERT_GT(cap.ntri(), 10u);
  const WindingTree rest = tree_of(hole), removed = tree_of(cap);
  for (const Vec3 &p : places(200, 0.25)) EXPECT_NEAR(rest.exactly_at(p), 1 - removed.exactly_at(p), 1e-12);
  EXPECT_GT(rest.exactly_at({}), 0.9);
}

TEST(Winding, NestedAndOverlappingShells_CountHowOften) {
  RestMesh m = test::sphere_surface(0.5, 3);
  test::append(m, test::sphere_surface(0.25, 3));
  EXPECT_NEAR(tree_of(m).exactly_at({0.05, 0.02, 0.01}), 2, 1e-12);
  EXPECT_NEAR(tree_of(m).exactly_at({0.35, 0.02, 0.01}), 1, 1e-12);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Winding, Tree_WithinItsStatedErrorOfTheSum) {
  RestMesh ball = test::sphere_surface(0.3, 5), torus = test::torus_surface(0.3, 0.1, 80, 40);
  for (uint32_t t = 0; t < torus.ntri(); t += 37) test::flip(torus, t);
  for (const RestMesh *m : {&ball, &torus}) {
    const WindingTree tree = tree_of(*m);
    double worst = 0;
    for (const Vec3 &p : places(3000, 0.5))
      worst = std::max(worst, std::fabs(tree.at(p) - tree.exactly_at(p)));
    EXPECT_LT(worst, 0.05);
    EXPECT_GT(worst, 0) << "the tree was never used from afar: nothing was tested";
  }
}

TEST(Winding, PlaceOnACornerOrAFace_StaysFinite) {
  const WindingTree tree = tree_of(test::box_surface({0, 0, 0}, {1, 1, 1}));
  for (const Vec3 &p : {Vec3{0, 0, 0}, Vec3{0.5, 0.5, 0}, Vec3{1, 0.3, 0}, Vec3{1, 1, 1}}) {
    const double w = tree.exactly_at(p);
    EXPECT_GE(w, -1e-9);
    EXPECT_LE(w, 1 + 1e-9);
  }
}

}  // namespace
