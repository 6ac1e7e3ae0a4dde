#include <gtest/gtest.h>

#include "detect_scene.h"
#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"

namespace {

using namespace dfm;
using namespace test;

TEST(Plane, Surfels_HaveSignedDistanceAreaAndBelt) {
  Scene scene;
  scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {0, 0, 0.5005}));
  scene.add(Shape::plane, {0, 0, 0});
  scene.obstacles[0].belt = {0.3, 0, 0.2};
  scene.obstacles[0].spin = {0, 0, 5};
  const auto c = scene.contacts();
  EXPECT_EQ(flaw(scene, c), "");
  ASSERT_EQ(c.size(), 9u);
  double area = 0;
  for (const ContactPoint &k : c) {
    EXPECT_EQ(k.kind, kPrimitive);
    EXPECT_EQ(k.nnode, 1);
    EXPECT_NEAR(k.distance, 5e-4, 1e-15);
    EXPECT_EQ(k.normal[2], 1.0);
    const double turn = 5 * scene.h, x = k.point[0], y = k.point[1];
    EXPECT_NEAR(k.velocity[0], 0.3 + ((std::cos(turn) - 1) * x - std::sin(turn) * y) / scene.h, 1e-7)
        << "the chord, not the tangent";
    EXPECT_NEAR(k.velocity[1], ((std::cos(turn) - 1) * y + std::sin(turn) * x) / scene.h, 1e-7);
    EXPECT_NEAR(k.velocity[2], 0, 1e-12) << "a belt does not push";
    area += k.area;
  }
  EXPECT_NEAR(area, 1, 1e-12) << "the bottom, and nothing of the sides";
  for (uint32_t i = 0; i < scene.surfaces[0]->nsurfel; ++i) scene.surfaces[0]->x[4 * i + 2] -= 0.1;
  for (const ContactPoint &k : scene.contacts())
    EXPECT_NEAR(k.distance, 5e-4 - 0.1, 1e-15) << "from any depth";
}

// What sticks to a drum goes round with it at its own radius, not at the drum's; of a rigid body, what its
// host adds to its spin counts to first order only.
TEST(Obstacles, RotationVelocity_IsTakenAtTheBodysPoint) {
  Scene scene;
  scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {0, 0, 1.0005}));
  scene.add(Shape::sphere, {0, 0, 0}).radius = 0.5;
  const auto velocity = [&](Vec3 spin, Vec3 linear) {
    scene.obstacles[0].spin = spin;
    scene.obstacles[0].linear = linear;
    Vec3 top{};
    for (const ContactPoint &c : scene.contacts())
      if (c.normal[2] == 1 && c.type_a == 0) top = load3(c.velocity);
    return top;
  };
  const double w = 4, r = 0.5005, a = w * scene.h;
  const Vec3 drum = velocity({0, w, 0}, {}), host = velocity({0, w, 0}, {0, w, 0});
  EXPECT_NEAR(drum.x, r * std::sin(a) / scene.h, 1e-8);
  EXPECT_NEAR(drum.z, r * (std::cos(a) - 1) / scene.h, 1e-8);
  EXPECT_NEAR(host.x, r * w, 1e-15);
  EXPECT_EQ(host.z, 0);
}

// Reach counts the motion of the shape, not the belt and not the spin of a ball about itself.
TEST(Obstacles, Reach_CountsWhatMoves) {
  const auto count = [](Vec3 belt, Vec3 velocity, Vec3 spin) {
    Scene scene;
    scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {0, 0, 1.005}));
    ObstacleView &o = scene.add(Shape::sphere, {0.001, 0.001, 0});
    o.radius = 0.5;
    o.belt = belt;
    o.velocity = velocity;
    o.spin = spin;
    return scene.contacts().size();
  };
  EXPECT_EQ(count({}, {}, {}), 0u);
  EXPECT_EQ(count({9, 0, 0}, {}, {}), 0u);
  EXPECT_EQ(count({}, {}, {20, 0, 0}), 0u);
  EXPECT_GT(count({}, {0, 0, 4}, {}), 0u);
}

TEST(Sphere, SmallerThanTriangle_MeetsFaceEdgeOrCorner) {
  struct Case {
    Vec3 center;
    int type;
  } cases[] = {{{0.1, 0.3, 0.5605}, 2}, {{0.5425, 0.1, 0.5425}, 1}, {{0.535, 0.535, 0.535}, 0}};
  for (const Case &at : cases) {
    Scene scene;
    scene.add(box_mesh({1, 1, 1}, 1, 1, 1));
    ObstacleView &o = scene.add(Shape::sphere, at.center);
    o.radius = 0.06;
    const auto c = scene.contacts();
    EXPECT_EQ(flaw(scene, c), "");
    ASSERT_EQ(c.size(), 1u) << at.type;
    EXPECT_EQ(c[0].type_a, at.type);
    EXPECT_EQ(c[0].nnode, at.type + 1);
    Vec3 q;
    for (int k = 0; k < 3; ++k) q[k] = std::clamp(at.center[k], -0.5, 0.5);
    EXPECT_NEAR(c[0].distance, norm(at.center - q) - 0.06, 1e-12);
    EXPECT_LT(norm(load3(c[0].normal) - normalized(q - at.center)), 1e-9);
    EXPECT_GT(c[0].area, 0) << "a corner without contact lends its share";
  }
}

// A ball rolls over a flat triangulated face: always one face contact with the same normal; edges inside the
// face are silent.
TEST(Sphere, SlidingOverFlatFace_SeesNoBump) {
  Scene scene;
  const Surface &s = scene.add(box_mesh({2, 2, 1}, 5, 5, 1));
  ObstacleView &o = scene.add(Shape::sphere, {0, 0, 0});
  o.radius = 0.05;
  std::vector<Vec3> at;
  for (int i = 0; i < 300; ++i) at.push_back({-0.8 + 0.005 * i, 0.3 * std::sin(0.1 * i), 0});
  for (uint32_t e = 0; e < s.nedge; ++e)
    at.push_back(0.3 * load3(&s.x[4 * s.edge[2 * e]]) + 0.7 * load3(&s.x[4 * s.edge[2 * e + 1]]));
  for (Vec3 p : at) {
    if (std::max(std::fabs(p.x), std::fabs(p.y)) > 0.9 || p.z < -0.1) continue;
    scene.obstacles[0].position = {p.x, p.y, 0.5 + 0.05 + 1e-4};
    const auto c = scene.contacts();
    ASSERT_FALSE(c.empty());
    for (const ContactPoint &k : c) {
      EXPECT_NE(k.type_a, 1);
      if (k.type_a == 2) {
        EXPECT_NEAR(k.normal[2], -1, 1e-12);
        EXPECT_NEAR(k.distance, 1e-4, 1e-12);
      }
    }
  }
}

// At the ends by the face, between them by the face's diagonal, flat as it is: of a face that bends it would
// be what bears.
TEST(Capsule, LyingOnFace_HoldsAtBothEndsAndAcrossTheDiagonal) {
  Scene scene;
  scene.add(box_mesh({2, 2, 1}, 1, 1, 1));
  ObstacleView &o = scene.add(Shape::capsule, {0.1, 0.2, 0.5 + 0.1 + 5e-4}, turn({0, 1, 0}, M_PI / 2));
  o.radius = 0.1;
  o.half_length = 0.3;
  const auto c = scene.contacts();
  EXPECT_EQ(flaw(scene, c), "");
  ASSERT_EQ(c.size(), 3u);
  for (const ContactPoint &k : c) {
    EXPECT_EQ(k.type_a, &k == &c[0] ? 1 : 2);
    EXPECT_NEAR(k.distance, 5e-4, 1e-12);
    EXPECT_NEAR(k.normal[2], -1, 1e-12);
    EXPECT_NEAR(k.type_a == 1 ? std::fabs(std::fabs(k.point[0]) - 0.2) : std::fabs(k.point[0] - 0.1) - 0.3, 0,
                1e-9);
  }
}

TEST(Capsule, AcrossAnEdge_MeetsTheEdge) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 1, 1, 1));
  const Vec3 out = normalized({1, 0, 1});
  ObstacleView &o =
      scene.add(Shape::capsule, Vec3{0.5, 0.1, 0.5} + 0.1005 * out, turn({0, 1, 0}, 3 * M_PI / 4));
  o.radius = 0.1;
  o.half_length = 0.3;
  const auto c = scene.contacts();
  EXPECT_EQ(flaw(scene, c), "");
  ASSERT_EQ(c.size(), 1u);
  EXPECT_EQ(c[0].type_a, 1);
  EXPECT_NEAR(c[0].distance, 5e-4, 1e-12);
  EXPECT_LT(norm(load3(c[0].normal) + out), 1e-9);
}

TEST(Box, CornerInFaceAndEdgeOnEdge_AreFound) {
  {
    Scene scene;  // a box stands on its corner upon a large triangle
    scene.add(box_mesh({2, 2, 1}, 1, 1, 1));
    const Vec3 down = normalized({1, 1, 1});
    const Quat q = turn(cross(down, {0, 0, -1}), std::acos(-down.z));
    ObstacleView &o = scene.add(Shape::box, {0.2, -0.3, 0.5 + 0.1 * std::sqrt(3.0) + 5e-4}, q);
    o.half_size = {0.1, 0.1, 0.1};
    const auto c = scene.contacts();
    EXPECT_EQ(flaw(scene, c), "");
    ASSERT_EQ(c.size(), 1u);
    EXPECT_EQ(c[0].type_a, 2);
    EXPECT_NEAR(c[0].distance, 5e-4, 1e-12);
    EXPECT_NEAR(c[0].normal[2], -1, 1e-12);
  }
  for (const double gap : {5e-4, -5e-4}) {
    Scene scene;  // two roofs cross
    scene.add(moved(box_mesh({1, 1, 1}, 1, 1, 1), turn({1, 0, 0}, M_PI / 4), {0, 0, 0}));
    ObstacleView &o = scene.add(Shape::box, {0, 0, std::sqrt(2.0) + gap}, turn({0, 1, 0}, M_PI / 4));
    o.half_size = {0.5, 0.5, 0.5};
    const auto c = scene.contacts();
    EXPECT_EQ(flaw(scene, c), "");
    ASSERT_EQ(c.size(), 1u);
    EXPECT_EQ(c[0].type_a, 1);
    EXPECT_NEAR(c[0].distance, gap, 1e-12);
    EXPECT_NEAR(c[0].normal[2], -1, 1e-12);
  }
}

// As EdgeEdge.FlatButBoreInTheLastSubStep_CountsOnWithinItsCone: the rim of a box across a face's diagonal.
TEST(Box, FlatEdgeThatBoreInTheLastSubStep_CountsOnWithinItsCone) {
  for (const double rise : {0.0, 0.02, 0.06}) {
    Scene scene;
    Mesh lower = box_mesh({1, 1, 1}, 1, 1, 1);
    for (uint32_t i = 0; i < lower.npoint(); ++i)
      // beside the diagonal of the upper face: it is a valley
      if (const Vec3 p = lower.at(i); p.z > 0 && p.x * p.y < 0) lower.x[3 * i + 2] += rise;
    const Surface &body = scene.add(lower);
    ObstacleView &o = scene.add(Shape::box, {0.05, 0, 1.0005});
    o.half_size = {0.1, 0.1, 0.5};  // its rim crosses the diagonal at two places
    const auto edges = [&](std::span<const Crossing> bore) {
      std::vector<Crossing> found;
      const auto c = scene.contacts(scene.all(), bore);
      EXPECT_EQ(flaw(scene, c), "");
      for (const ContactPoint &k : c)
        if (k.type_a == 1 && k.normal[2] < -0.9)
          found.push_back({scene.bodies[0].id, scene.obstacles[0].id, k.feature_a, k.feature_b});
      return found;
    };
    EXPECT_TRUE(edges({}).empty());
    std::vector<Crossing> any;
    for (uint32_t i = 0; i < body.nedge; ++i)
      for (uint32_t k = 0; k < 20; ++k) any.push_back({scene.bodies[0].id, scene.obstacles[0].id, i, k});
    const std::vector<Crossing> found = edges(any);
    if (rise > 0.05) {
      EXPECT_TRUE(found.empty());
      continue;
    }
    ASSERT_EQ(found.size(), 2u) << rise;
    EXPECT_EQ(edges(found), found);
    EXPECT_EQ(edges({&found[1], 1}).size(), 1u);
    Crossing other = found[0];
    other.edge_b = (other.edge_b + 1) % 12;
    EXPECT_TRUE(edges({&other, 1}).empty());
  }
}

TEST(Box, BodyOnItsTop_UsesSurfelsAlone) {
  Scene scene;
  scene.add(moved(box_mesh({1, 1, 1}, 4, 4, 4), {}, {0, 0, 0.5005}));
  scene.add(Shape::box, {0, 0, -0.5});
  scene.obstacles[0].half_size = {2, 2, 0.5};
  const auto c = scene.contacts();
  ASSERT_EQ(c.size(), 25u);
  for (const ContactPoint &k : c) {
    EXPECT_EQ(k.type_a, 0);
    EXPECT_EQ(k.feature_b, 5u) << "top";
    EXPECT_EQ(k.normal[2], 1.0);
  }
}

// The least distance over all contacts is the distance of body and obstacle, from every side; the surfels'
// own distances are exact.
// unsanitized: too slow there; shorter tests run the same code
TEST(Obstacles, NearestContact_IsTheDistance) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  int types[3] = {0, 0, 0};
  for (int i = 0; i < 400; ++i) {
    const Shape kind = i % 3 == 0 ? Shape::sphere : i % 3 == 1 ? Shape::box : Shape::capsule;
    Scene scene;
    scene.h = 0;
    scene.offset = 0.05;
    Surface &s = scene.add(
        moved(i % 2 ? box_mesh({1, 0.7, 0.5}, 1, 1, 1) : sphere_mesh(0.5, 1), turn(any(), 1 + i), {}));
    ObstacleView &o = scene.add(kind, {}, turn(any(), 2 * i));
    o.half_size = {0.3, 0.2, 0.4};
    o.radius = 0.15;
    o.half_length = 0.4;
    const ObstacleShape shape(o);
    // Distance by points sampled densely on the body's surface, from the signed distance of the obstacle.
    const auto distance = [&](int n) {
      double least = 1e9;
      for (uint32_t t = 0; t < s.ntri; ++t) {
        const Vec3 a = load3(&s.x[4 * s.tri[3 * t]]);
        const Vec3 b = load3(&s.x[4 * s.tri[3 * t + 1]]);
        const Vec3 c = load3(&s.x[4 * s.tri[3 * t + 2]]);
        for (int u = 0; u <= n; ++u)
          for (int v = 0; u + v <= n; ++v)
            least = std::min(
                least, shape.closest((double(u) / n) * a + (double(v) / n) * b + (double(n - u - v) / n) * c)
                           .distance);
      }
      return least;
    };
    const Vec3 way = normalized(any());
    const auto shift = [&](double by) {
      for (uint32_t v = 0; v < s.nsurfel; ++v) store3(&s.x[4 * v], load3(&s.x[4 * v]) + by * way);
    };
    shift(3);
    double d = distance(6);
    for (int k = 0; k < 100 && d > 0.08; ++k) {
      shift(-std::max(0.5 * (d - 0.04), 0.01));
      d = distance(6);
    }
    d = distance(60);
    if (d > 0.09 || d < 1e-3) continue;
    const auto contacts = scene.contacts();
    ASSERT_EQ(flaw(scene, contacts), "");
    ASSERT_FALSE(contacts.empty()) << i;
    const ContactPoint *nearest = &contacts[0];
    for (const ContactPoint &c : contacts)
      if (c.distance < nearest->distance) nearest = &c;
    EXPECT_LE(nearest->distance, d + 1e-12);
    EXPECT_GE(nearest->distance, d - 0.01) << i << " type " << int(nearest->type_a) << " shape " << int(kind);
    EXPECT_GT(dot(load3(nearest->normal), way), 0);
    ++types[nearest->type_a];
  }
  for (const int n : types) EXPECT_GT(n, 20);
}

TEST(Obstacles, InsideRecovery_LeadsOut) {
  for (const Shape kind : {Shape::plane, Shape::sphere, Shape::box, Shape::capsule}) {
    Scene scene;
    scene.add(moved(box_mesh({0.1, 0.1, 0.1}, 1, 1, 1), {}, {0.05, 0.02, 0.32}));
    ObstacleView &o = scene.add(kind, kind == Shape::plane ? Vec3{0, 0, 0.4} : Vec3{});
    o.half_size = {0.4, 0.4, 0.4};
    o.radius = 0.4;
    const auto c = scene.contacts();
    EXPECT_EQ(flaw(scene, c), "");
    size_t surfels = 0;
    for (const ContactPoint &k : c) {
      if (k.type_a != 0) continue;
      ++surfels;
      EXPECT_GT(k.normal[2], 0.8);
    }
    EXPECT_EQ(surfels, 8u);
  }
}

// A surfel slides round a box's corner: one contact throughout, the key changes with the face,
// never within it.
TEST(Box, SurfelRoundTheEdge_KeepsItsKeyOnAFace) {
  Scene scene;
  Surface &s =
      scene.add(tetrahedron_mesh({0, 0, 0}, {0.02, 0, 0.04}, {-0.02, 0.02, 0.04}, {-0.02, -0.02, 0.04}));
  const std::vector<double> rest(s.x.begin(), s.x.end());
  scene.add(Shape::box, {0, 0, 0});
  scene.obstacles[0].half_size = {0.5, 0.5, 0.5};
  std::vector<uint64_t> keys;
  for (int i = 0; i <= 100; ++i) {
    const Vec3 tip = i < 50 ? Vec3{0.4 + 0.002 * i, 0, 0.5005} : Vec3{0.5005, 0, 0.5 - 0.002 * (i - 50)};
    for (size_t k = 0; k < rest.size(); ++k) s.x[k] = rest[k] + (k % 4 < 3 ? tip[int(k % 4)] : 0);
    size_t own = 0;
    for (const ContactPoint &c : scene.contacts())
      if (c.type_a == 0 && c.feature_a == 0) {
        ++own;
        if (keys.empty() || keys.back() != c.key) keys.push_back(c.key);
      }
    ASSERT_EQ(own, 1u) << i;
  }
  EXPECT_EQ(keys.size(), 2u);
}

}  // namespace
