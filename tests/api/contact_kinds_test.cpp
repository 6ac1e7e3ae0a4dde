// What a reported contact touches with: its kind, and the surfel, edge or triangle that feature_a names.
#include <algorithm>
#include <set>

#include "obstacle.h"

namespace {

using Point = std::array<double, 3>;

double distance_to_segment(const Point &p, const Point &a, const Point &b) {
  double ab = 0, ap = 0;
  for (size_t k = 0; k < 3; ++k) {
    ab += (b[k] - a[k]) * (b[k] - a[k]);
    ap += (p[k] - a[k]) * (b[k] - a[k]);
  }
  const double t = std::clamp(ap / ab, 0.0, 1.0);
  double square = 0;
  for (size_t k = 0; k < 3; ++k) {
    const double d = p[k] - a[k] - t * (b[k] - a[k]);
    square += d * d;
  }
  return std::sqrt(square);
}

// A surface as a host sees it, with edges in the order that contact.h names.
struct Surface {
  std::vector<double> at;
  std::vector<uint32_t> triangles;
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  explicit Surface(dfm_body body)
      : at(test::listed(dfm_surface_positions, body, 3)),
        triangles(test::listed(dfm_surface_triangles, body, 3)) {
    std::set<std::pair<uint32_t, uint32_t>> all;
    for (size_t t = 0; t < triangles.size(); t += 3)
      for (size_t k = 0; k < 3; ++k) all.insert(std::minmax(triangles[t + k], triangles[t + (k + 1) % 3]));
    edges.assign(all.begin(), all.end());
  }
  Point point(uint32_t surfel) const { return {at[3 * surfel], at[3 * surfel + 1], at[3 * surfel + 2]}; }
  // How far p is from the feature; of a triangle, from the nearest of its lines to its center.
  double distance(uint32_t flags, uint32_t feature, const Point &p) const {
    if (flags & DFM_CONTACT_EDGE_A) {
      if (feature >= edges.size()) return INFINITY;
      return distance_to_segment(p, point(edges[feature].first), point(edges[feature].second));
    }
    if (flags & DFM_CONTACT_TRIANGLE_A) {
      if (feature >= triangles.size() / 3) return INFINITY;
      const uint32_t *const t = &triangles[3 * size_t{feature}];
      double least = INFINITY;
      for (int i = 0; i <= 20; ++i) {  // lines from one corner to points of the opposite side
        Point end{};
        const double u = i / 20.0;
        for (size_t k = 0; k < 3; ++k) end[k] = (1 - u) * point(t[1])[k] + u * point(t[2])[k];
        least = std::min(least, distance_to_segment(p, point(t[0]), end));
      }
      return least;
    }
    return feature < at.size() / 3 ? distance_to_segment(p, point(feature), {p[0] + 1e-9, p[1], p[2]})
                                   : INFINITY;
  }
};

void check_features(dfm_world w) {
  for (const dfm_contact &c : test::contacts(w)) {
    const Surface a(c.body_a);
    const Point p{c.point[0], c.point[1], c.point[2]};
    EXPECT_LT(a.distance(c.flags, c.feature_a, p), 2e-3)
        << "kind " << c.kind << ", flags " << c.flags << ", feature " << c.feature_a;
    EXPECT_EQ(c.kind == DFM_CONTACT_EDGE_EDGE,
              (c.flags & DFM_CONTACT_EDGE_A) && c.body_b != 0 && c.kind != DFM_CONTACT_PRIMITIVE);
  }
}

// Flags of what feature_a is, of all contacts of a kind.
std::set<uint32_t> features(dfm_world w, uint32_t kind) {
  std::set<uint32_t> out;
  for (const dfm_contact &c : test::contacts(w))
    if (c.kind == kind) out.insert(c.flags & (DFM_CONTACT_EDGE_A | DFM_CONTACT_TRIANGLE_A));
  return out;
}

}  // namespace

TEST(ContactKinds, OfTwoBodies_NameSurfelsAndEdges) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0);
  test::run(s.world, 20e-3, 1e-3);
  check_features(s.world);
  EXPECT_EQ(features(s.world, DFM_CONTACT_VERTEX_FACE), (std::set<uint32_t>{0}));
  EXPECT_EQ(features(s.world, DFM_CONTACT_EDGE_EDGE), (std::set<uint32_t>{DFM_CONTACT_EDGE_A}));
  EXPECT_EQ(features(s.world, DFM_CONTACT_PRIMITIVE), (std::set<uint32_t>{0}));
}

TEST(ContactKinds, OfAnObstacle_NameItsPlaceInTheList) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0);
  dfm_obstacle_def below = dfm_obstacle_def_default();
  below.name = "below";
  below.pose.position[2] = -1;
  dfm_obstacle last = 0;
  test::ok(dfm_obstacle_create(s.world, &below, &last));
  test::run(s.world, 20e-3, 1e-3);
  const auto obstacles = test::listed(dfm_world_obstacles, s.world);
  uint32_t n = 0;
  for (const dfm_contact &one : test::contacts(s.world)) {
    if (one.kind != DFM_CONTACT_PRIMITIVE) continue;
    ++n;
    ASSERT_LT(one.feature_b, obstacles.size());
    EXPECT_EQ(obstacles[one.feature_b], s.floor);
    EXPECT_EQ(one.body_b, 0u);
  }
  EXPECT_GT(n, 0u);
}

TEST(ContactKinds, OfASharpObstacle_NameTheTriangleThatItPointsAt) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "block";
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.03}, 40, o);
  const double tip[2] = {0.048, 0.052};
  test::Triangles spike;
  spike.points = {-0.1, -0.1, -0.2, 0.2, -0.1, -0.2, 0.05, 0.25, -0.2, tip[0], tip[1], 0};
  spike.tris = {0, 1, 3, 1, 2, 3, 2, 0, 3, 0, 2, 1};
  const dfm_obstacle_def d = test::mesh_def("spike", spike);
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(w, &d, &obstacle));
  test::run(w, 10e-3, 1e-3);
  check_features(w);
  EXPECT_EQ(features(w, DFM_CONTACT_PRIMITIVE).count(DFM_CONTACT_TRIANGLE_A), 1u);
}
