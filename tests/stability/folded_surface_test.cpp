// A surface with faces that look inward, as a file gives it whose concave polygons are cut into fans: what
// comes near such a face from outside is behind it, but has not come through it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "coupled.h"
#include "obstacle.h"

namespace {

// A star of ten corners in the plane, 0.12 m high, on the box [0, 0.6] x [0, 0.6]. Its two caps are fans
// about one corner: some of their triangles lie outside of the star, and some look inward.
test::Skin fanned_star() {
  test::detail::Weld w;
  const auto at = [](int i, double z) {
    const double r = i % 2 ? 0.12 : 0.3, angle = M_PI * i / 5;
    return test::detail::Point{0.3 + r * std::cos(angle), 0.3 + r * std::sin(angle), z};
  };
  for (int i = 0; i < 10; ++i) {
    const int j = (i + 1) % 10;
    w.triangle(at(i, 0), at(j, 0), at(j, 0.12));
    w.triangle(at(i, 0), at(j, 0.12), at(i, 0.12));
  }
  for (int i = 2; i < 10; ++i) {
    w.triangle(at(0, 0), at(i, 0), at(i - 1, 0));
    w.triangle(at(0, 0.12), at(i - 1, 0.12), at(i, 0.12));
  }
  return w.skin;
}

}  // namespace

namespace {

// What bodies and contact do in 0.3 s without gravity.
struct Flight {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0});
  std::vector<dfm_body> bodies;
  double before = 0, most = 0;

  Flight() { test::set_friction(world, 0.5); }
  void add_star(double speed) {
    const test::Skin skin = fanned_star();
    const dfm_surface_def surface = skin.def();
    test::BodyOptions o;
    o.name = "star";
    o.surface = &surface;
    o.velocity = {0, 0, speed};
    bodies.push_back(test::make_body(context, world, "beam", {0.6, 0.6, 0.12}, 400, o));
  }
  double energy() const {
    double sum = 0;
    for (const dfm_body b : bodies) {
      const dfm_body_measure m = test::measure(b);
      sum += m.kinetic + m.elastic;
    }
    return sum;
  }
  void go() {
    most = before = energy();
    for (int k = 0; k < 300; ++k) {
      uint32_t trouble = 0;
      test::ok(dfm_world_step(world, 1e-3, &trouble));
      most = std::max(most, energy());
    }
    const dfm_world_stats s = test::stats(world);
    std::printf("%g J at first, %g J at most; %g sub-steps, %g unconverged, %g solves of the guard\n", before,
                most, double(s.substeps), double(s.unconverged), double(s.guard_solves));
    EXPECT_LT(most, 1.01 * before);
    EXPECT_LT(s.unconverged, 50u);
    EXPECT_LT(s.guard_solves, 200u);
  }
};

}  // namespace

TEST(FoldedSurface, HitByABall_GivesNoEnergy) {
  Flight run;
  run.add_star(0);
  test::BodyOptions o;
  o.name = "ball";
  o.position = {0.4, 0.3, 0.3};
  o.velocity = {0, 0, -2};
  run.bodies.push_back(test::make_body(run.context, run.world, "ball", {0.15, 0, 0}, 400, o));
  run.go();
}

TEST(FoldedSurface, ThrownAtAMesh_GainsNoEnergy) {
  Flight run;
  const double radius[3] = {0.15, 0, 0};
  dfm_mesh_handle mesh = 0;
  dfm_mesh_info info{};
  info.size = sizeof info;
  test::ok(dfm_mesh_make(run.context, "ball", radius, DFM_MESH_SURFACE, 320, &mesh));
  test::ok(dfm_mesh_get_info(mesh, &info));
  const double *const points = info.points;
  const uint32_t *const tris = info.faces;
  test::Triangles ball{{points, points + 3 * info.npoint}, {tris, tris + 3 * info.ntriangle}};
  test::ok(dfm_mesh_destroy(mesh));
  for (size_t p = 0; p < ball.points.size(); p += 3) {
    ball.points[p] += 0.4;
    ball.points[p + 1] += 0.3;
    ball.points[p + 2] += 0.3;
  }
  test::add_mesh(run.world, "ball", ball);
  run.add_star(2);
  run.go();
}
