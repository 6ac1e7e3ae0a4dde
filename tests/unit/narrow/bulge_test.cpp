// Smooth surfaces on closed-form obstacles: where they touch, and with which surfels (geometry/bulge.h).
#include "geometry/bulge.h"

#include <gtest/gtest.h>

#include "detect_scene.h"
#include "geometry/obstacle_shape.h"

namespace {

using namespace dfm;
using namespace test;

constexpr double kBulgeAngle = 60;

// The nearest contact; checks that its surfels' weights give its own point.
ContactPoint nearest_touch(const Scene &scene) {
  const auto contacts = scene.contacts();
  EXPECT_EQ(flaw(scene, contacts), "");
  EXPECT_TRUE(same_bits(contacts, scene.listed())) << "lists hold all";
  ContactPoint best{};
  best.distance = HUGE_VAL;
  for (const ContactPoint &c : contacts) {
    Vec3 p;
    double sum = 0;
    for (int k = 0; k < c.nnode; ++k) {
      p += c.weight[k] * load3(&scene.surfaces[0]->x[4 * size_t{c.node[k]}]);
      sum += c.weight[k];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LT(norm(p - load3(c.point) - (0.5 * c.distance) * load3(c.normal)), 1e-12);
    if (c.distance < best.distance) best = c;
  }
  return best;
}

struct Beneath {
  const char *name;
  Shape shape;
  double radius;
  Vec3 at;
  Quat turned{};
};

}  // namespace

// Turned by any angle, a sphere touches what lies below it near its own lowest point, to a sixth of what its
// facets miss, also what is much more curved than itself.
TEST(Bulge, SphereAtAnyAngle_TouchesAtItsLowestPoint) {
  const Quat lying = turn({0, 1, 0}, M_PI / 2);
  for (const Beneath &o : {Beneath{"plane", Shape::plane, 0, {}}, Beneath{"box", Shape::box, 0, {0, 0, -0.5}},
                           Beneath{"sphere", Shape::sphere, 2, {0, 0, -2}},
                           Beneath{"small ball", Shape::sphere, 0.2, {0.1, 0.05, -0.2}},
                           Beneath{"capsule", Shape::capsule, 2, {0, 0, -3}},
                           Beneath{"rod", Shape::capsule, 0.1, {0.1, 0.05, -0.1}, lying}}) {
    double facets = 0, smooth = 0, aside = 0;
    for (int i = 0; i < 60; ++i)
      for (const bool bulges : {false, true}) {
        Scene scene;
        const Vec3 center{0.1, 0.05, 1.0005};
        Surface &s =
            scene.add(moved(sphere_mesh(1, 2), turn({1.0 + i % 7, 2.0 - i % 5, 0.5}, 0.37 * i), center));
        if (bulges) make_bulges(s, kBulgeAngle);
        scene.offset = 0.03;
        ObstacleView &view = scene.add(o.shape, o.at, o.turned);
        view.half_size = {3, 3, 0.5};
        view.radius = o.radius;
        view.half_length = 1;
        const ContactPoint c = nearest_touch(scene);
        ASSERT_LT(c.distance, HUGE_VAL) << o.name << ' ' << i;
        const ObstaclePoint truth = ObstacleShape(view).closest(center);
        double &most = bulges ? smooth : facets;
        most = std::max(most, std::fabs(c.distance - (truth.distance - 1)));
        if (bulges) aside = std::max(aside, norm(cross(load3(c.point) - center, truth.normal)));
      }
    EXPECT_GT(facets, 0.02) << o.name;
    EXPECT_LT(smooth, facets / 6) << o.name;
    EXPECT_LT(aside, 0.1) << o.name << ": of edges of 0.4";
  }
}

// What moves as a rigid body moves its patches so; a patch that is pressed flat has no bulge left.
TEST(Bulge, Patches_FollowTheirSurfels) {
  Scene scene;
  Surface &s = scene.add(sphere_mesh(1, 1));
  make_bulges(s, kBulgeAngle);
  const Quat q = turn({1, 2, 3}, 1.1);
  const auto at = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]); };
  const auto turned = [&](uint32_t i) { return rotate(q, at(i)) + Vec3{1, 2, 3}; };
  const auto flat = [&](uint32_t i) { return Vec3{at(i).x, at(i).y, 0}; };
  for (uint32_t t = 0; t < s.ntri; ++t) {
    ASSERT_NE(s.bulge_from[t], kNone);
    const Patch patch(s, t);
    for (int k = 0; k < 3; ++k) {
      const Vec3 d = patch.off(k, at), middle = 0.5 * (at(patch.node[k]) + at(patch.node[(k + 1) % 3]));
      EXPECT_NEAR(norm(middle + d), 1, 0.03) << "on the sphere, from " << norm(middle);
      EXPECT_LT(norm(patch.off(k, turned) - rotate(q, d)), 1e-12);
      EXPECT_EQ(patch.off(k, flat).z, 0);
    }
  }
}

// Lists are as wide as a place may move when its surfels do.
TEST(Bulge, BoundOfWeights_HoldsEverywhere) {
  Scene scene;
  for (const Mesh &mesh : {sphere_mesh(1, 1), cylinder_mesh(1, 1, 16, 3)}) {
    Surface &s = scene.add(mesh);
    make_bulges(s, kBulgeAngle);
    double most = 0;
    for (uint32_t t = 0; t < s.ntri; ++t) {
      if (s.bulge_from[t] == kNone) continue;
      for (int i = 0; i <= 12; ++i)
        for (int j = 0; i + j <= 12; ++j) {
          const double u[3] = {i / 12.0, j / 12.0, (12 - i - j) / 12.0};
          double w[4];
          Patch(s, t).weights(u, w);
          most = std::max(most, std::fabs(w[0]) + std::fabs(w[1]) + std::fabs(w[2]) + std::fabs(w[3]));
        }
    }
    EXPECT_GT(most, 1.1);
    EXPECT_LE(most, s.bulge_sum);
  }
}

TEST(Bulge, FlatFacesAndCreases_AreAsWithout) {
  Scene scene;
  Surface &s = scene.add(box_mesh({1, 1, 1}, 3, 3, 3));
  make_bulges(s, kBulgeAngle);
  for (const uint32_t from : s.bulge_from) EXPECT_EQ(from, kNone);
  Surface &c = scene.add(cylinder_mesh(1, 1, 16, 3));
  make_bulges(c, kBulgeAngle);
  for (uint32_t t = 0; t < c.ntri; ++t) {
    const Vec3 normal = c.area2(t, [&](uint32_t i) { return load3(&c.x[4 * size_t{i}]); });
    EXPECT_EQ(c.bulge_from[t] == kNone, std::fabs(normal.y) > 0.5 * norm(normal))
        << "its caps alone are flat";
  }
}
