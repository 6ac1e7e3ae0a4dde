// Smooth bodies that are thrown at obstacles: no surfel is ever inside one, the bulges between them are by
// less than the way of a sub-step, and come out again.
#include <limits>

#include "body/make_surface.h"
#include "geometry/bulge.h"
#include "geometry/obstacle_shape.h"
#include "inside.h"
#include "world.h"

namespace {

using namespace dfm;

constexpr double kRadius = 0.1;

struct LowestPlaces { double surfel = HUGE_VAL, patch = HUGE_VAL; };

LowestPlaces lowest_over(const ObstacleShape &shape, Body &b) {
  Surface &s = b.surface;
  gather_surface(s, b.p.x.data(), b.p.v.data());
  const auto at = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]); };
  LowestPlaces out;
  for (uint32_t i = 0; i < s.nsurfel; ++i) out.surfel = std::min(out.surfel, shape.closest(at(i)).distance);
  for (uint32_t t = 0; t < s.ntri; ++t) {
    if (s.bulge_from[t] == kNone) continue;
    const Patch patch(s, t);
    for (int i = 0; i <= 6; ++i)
      for (int j = 0; i + j <= 6; ++j) {
        const double u[3] = {i / 6.0, j / 6.0, (6 - i - j) / 6.0};
        double weight[4];
        patch.weights(u, weight);
        Vec3 p;
        for (int k = 0; k < 4; ++k) p += weight[k] * at(patch.node[k]);
        out.patch = std::min(out.patch, shape.closest(p).distance);
      }
  }
  return out;
}

struct ThrowTarget {
  Shape inside;
  uint32_t shape;
  double radius, half_length;
};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(SmoothThrow, At20MetersPerSecond_StaysOutside) {
  for (const ThrowTarget &o :
       {ThrowTarget{Shape::plane, DFM_SHAPE_PLANE, 0, 0}, ThrowTarget{Shape::box, DFM_SHAPE_BOX, 0, 0},
        ThrowTarget{Shape::sphere, DFM_SHAPE_SPHERE, 0.03, 0},
        ThrowTarget{Shape::capsule, DFM_SHAPE_CAPSULE, 0.02, 0.2}})
    for (int turn = 0; turn < 2; ++turn) {
      test::Context context;
      const dfm_world world = test::make_world(context, {0, 0, 0});
      test::set_friction(world, 0.5);
      dfm_obstacle_def at = dfm_obstacle_def_default();
      ObstacleView view{};
      view.shape = o.inside;
      at.shape = o.shape;
      at.radius = view.radius = o.radius;
      at.half_length = view.half_length = o.half_length;
      view.half_size = {0.3, 0.3, 0.05};
      for (int k = 0; k < 3; ++k) at.half_size[k] = view.half_size[k];
      if (o.inside == Shape::capsule) {  // lies along x
        view.rotation = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};
        at.pose.rotation[1] = at.pose.rotation[3] = std::sqrt(0.5);
      }
      dfm_obstacle obstacle = 0;
      test::ok(dfm_obstacle_create(world, &at, &obstacle));
      test::BodyOptions soft;
      soft.young = 2e5;
      soft.damping_stiffness = 1e-4;
      soft.smooth = 40;
      soft.position = {0, 0.004 * turn, 0.25};
      soft.rotation = {std::sin(turn), 0, 0, std::cos(turn)};
      soft.velocity = {2, 0, -20};
      soft.spin = {0, 30, 0};
      test::make_body(context, world, "ball", {kRadius, 0, 0}, 500, soft);
      LowestPlaces least, now;
      for (int i = 0; i < 80; ++i) {
        test::run(world, 5e-4, 5e-4);
        now = lowest_over(ObstacleShape(view), *test::inside(world).bodies[0]);
        least.surfel = std::min(least.surfel, now.surfel);
        least.patch = std::min(least.patch, now.patch);
      }
      EXPECT_GT(least.surfel, 0) << o.shape << ' ' << turn;
      EXPECT_GT(least.patch, -20 * 0.04 / double(test::stats(world).substeps)) << o.shape << ' ' << turn;
      EXPECT_LT(least.patch, 0.01) << "they have met";
      EXPECT_GT(now.patch, -0.005 * kRadius) << o.shape << ' ' << turn;
    }
}

// Below the floor, and over it: the radius that the definition of any shape has is none of a plane.
TEST(SmoothThrow, BallInAPlane_GoesOnAsideWithoutFriction) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, 0});
  test::set_friction(world, 0);
  test::add_plane(world, "floor");
  test::BodyOptions soft;
  soft.smooth = 60;
  soft.position = {0.62, 0, 0.06};
  soft.velocity = {-1, 0, 0};
  const dfm_body ball = test::make_body(context, world, "ball", {kRadius, 0, 0}, 500, soft);
  test::run(world, 0.05, 2e-4);
  EXPECT_NEAR(test::measure(ball).velocity[0], -1, 0.01);
}

TEST(SmoothThrow, WhatIsNoAngle_IsRefused) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  for (const double wrong : {-1.0, 180.5, std::numeric_limits<double>::quiet_NaN()}) {
    test::Tet tet("drop");
    tet.def.smooth = wrong;
    dfm_body body = 0;
    EXPECT_EQ(dfm_body_create(world, &tet.def, &body), DFM_E_ARG);
    test::says({"'drop'", "smooth", "degrees", "180"});
  }
}
