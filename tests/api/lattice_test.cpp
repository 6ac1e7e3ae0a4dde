// Lattices in worlds and scenes: they rest on a floor by their fine surface, are saved and written; what they
// cannot be made of says so.
#include <cmath>

#include "support.h"
#include "world.h"
#include "written.h"

namespace {

constexpr double kRadius = 0.1, kFlat = 0.6;

dfm_mesh_handle ball(dfm_context *context, double triangles = 1000) {
  const double size[3] = {kRadius, 0, 0};
  dfm_mesh_handle out = 0;
  test::ok(dfm_mesh_make(context, "ball", size, DFM_MESH_SURFACE, uint32_t(triangles), &out));
  return out;
}

// The ball, flatter: it does not roll.
dfm_mesh_handle pebble(dfm_context *context) {
  const dfm_mesh_handle round = ball(context);
  const dfm_mesh_info info = test::info_of(round);
  const double *const x = info.points;
  const uint32_t *const triangles = info.faces;
  std::vector<double> points(x, x + 3 * info.npoint);
  for (size_t i = 2; i < points.size(); i += 3) points[i] *= kFlat;
  dfm_mesh_handle out = 0;
  test::ok(dfm_mesh_create(context, info.npoint, points.data(), info.ntriangle, triangles, &out));
  return out;
}

struct Worn {
  dfm_surface_def def{};
  explicit Worn(dfm_mesh_handle skin) {
    const dfm_mesh_info info = test::info_of(skin);
    def.size = sizeof def;
    def.npoint = info.npoint;
    def.ntriangle = info.ntriangle;
    def.points = info.points;
    def.triangles = info.faces;
  }
};

struct Resting {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  explicit Resting(int32_t integrator, uint32_t cells, const char *model = "corotational_fem") {
    world = test::make_world(context, {0, 0, -9.81}, integrator);
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    const dfm_mesh_handle skin = pebble(context);
    const Worn worn(skin);
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_lattice(skin, cells, 0, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    d.model = model;
    d.surface = &worn.def;
    test::BodyOptions o;
    o.young = 1e5;
    o.damping_mass = 10;
    o.damping_stiffness = 1e-3;
    d.material = test::make_material(world, o);
    d.pose.position[2] = kFlat * kRadius + 0.002;
    test::ok(dfm_body_create(world, &d, &body));
  }
  ~Resting() { dfm_world_destroy(world); }
};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(Lattice, PebbleOnAFloor_RestsWithItsWeightAndDoesNotCreep) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER})
    for (const uint32_t cells : {8u, 64u}) {
      Resting r(integrator, cells);
      test::run(r.world, 1.5, 2e-3);
      const dfm_body_measure before = test::measure(r.body);
      test::run(r.world, 1.0, 2e-3);
      const dfm_body_measure after = test::measure(r.body);
      const double weight = 9.81 * after.mass;
      EXPECT_NEAR(after.contact_impulse[2] - before.contact_impulse[2], weight, 1e-4 * weight) << cells;
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.com[k], before.com[k], 1e-5 * kRadius) << cells;
      EXPECT_LT(after.com[2], kFlat * kRadius);
      EXPECT_GT(after.com[2], 0.9 * kFlat * kRadius);
      EXPECT_EQ(after.inverted, 0u);
    }
}

// Condensed to its surface the pebble sags as its cells do, but for their large strains.
// unsanitized: too slow there; shorter tests run the same code
TEST(Lattice, PebbleOfModes_RestsAndCondensedItSagsAsItsCells) {
  std::vector<double> sag;
  for (const char *const model : {"corotational_fem", "modal", "condensed"}) {
    Resting r(DFM_INTEGRATOR_IMPLICIT_EULER, 64, model), other(DFM_INTEGRATOR_IMPLICIT_EULER, 64, model);
    test::run(r.world, 2.0, 2e-3);
    const dfm_body_measure before = test::measure(r.body);
    const std::string kept = test::snapshot(r.world);
    test::run(r.world, 1.0, 2e-3);
    const dfm_body_measure after = test::measure(r.body);
    const double weight = 9.81 * after.mass;
    EXPECT_NEAR(after.contact_impulse[2] - before.contact_impulse[2], weight, 1e-4 * weight) << model;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.com[k], before.com[k], 1e-5 * kRadius) << model;
    sag.push_back(kFlat * kRadius - after.com[2]);
    test::ok(dfm_world_restore(other.world, kept.data(), kept.size()));
    test::run(other.world, 1.0, 2e-3);
    EXPECT_TRUE(test::snapshot(r.world) == test::snapshot(other.world)) << model;
  }
  EXPECT_NEAR(sag[2] / sag[0], 1, 0.03);
  EXPECT_LT(sag[1], sag[2]);
  EXPECT_GT(sag[1], 0);
}

TEST(Lattice, Snapshot_ContinuesWithTheSameBits) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Resting r(integrator, 27), other(integrator, 27), coarse(integrator, 8);
    test::run(r.world, 0.1, 2e-3);
    const std::string kept = test::snapshot(r.world);
    test::ok(dfm_world_restore(other.world, kept.data(), kept.size()));
    EXPECT_NE(dfm_world_restore(coarse.world, kept.data(), kept.size()), DFM_OK);
    test::run(r.world, 0.1, 2e-3);
    test::run(other.world, 0.1, 2e-3);
    EXPECT_TRUE(test::snapshot(r.world) == test::snapshot(other.world));
  }
}

// By a linear field every surfel is exact, and by a product of coordinates too, whichever tetrahedra a
// hexahedron is divided into.
TEST(Lattice, SurfaceFollowsTrilinearFields) {
  Resting r(DFM_INTEGRATOR_IMPLICIT_EULER, 1);
  const auto field = [](double *x) {
    const double a = x[0], b = x[1], c = x[2];
    x[0] += 0.2 * b * c + 30 * a * b * c;
    x[1] += 0.3 * c * a;
    x[2] += 0.1 * a - a * b;
  };
  uint32_t n = 0;
  std::vector<double> x(24), seen(3 * 2000);
  test::ok(dfm_body_get_state(r.body, 8, x.data(), nullptr, &n));
  for (double *p = x.data(); p < x.data() + 24; p += 3) {
    p[2] -= kFlat * kRadius + 0.002;
    field(p);
  }
  test::ok(dfm_body_set_state(r.body, n, x.data(), nullptr));
  const dfm_mesh_handle skin = pebble(r.context);
  const Worn worn(skin);
  std::vector<double> want(worn.def.points, worn.def.points + 3 * worn.def.npoint);
  for (size_t i = 0; i < want.size(); i += 3) field(&want[i]);
  test::ok(dfm_surface_positions(r.body, 2000, seen.data(), &n));
  ASSERT_EQ(3 * n, want.size());
  for (size_t i = 0; i < want.size(); ++i) EXPECT_NEAR(seen[i], want[i], 1e-15);
}

constexpr const char *kScene = R"({"format": "deform-scene", "version": 1,
  "time": {"duration": 0.02, "step": 0.01}, "gravity": [0, 0, -9.81],
  "bodies": [
    {"name": "ball", "mesh": "ball.stl", "lattice": {"cells": 30}, "model": {"type": "corotational_fem"},
     "fix": [{"box": [[-1, -1, -1], [1, 1, -0.09]]}]},
    {"name": "fine", "mesh": "ball.stl", "lattice": {"size": 0.05}, "model": {"type": "linear_fem"},
     "pose": {"position": [0, 1, 0], "scale": 0.5}}]})";

TEST(Lattice, Scene_MakesItAndAWrittenSceneHasIt) {
  test::Context context;
  const std::string folder = test::scratch("lattice_scene");
  test::ok(dfm_mesh_write(ball(context), (folder + "/ball.stl").c_str()));
  const test::Written both(context, folder, kScene);
  for (const char *name : {"ball", "fine"}) {
    const dfm_body a = both.same(name);
    const dfm_body_measure m = test::measure(a);
    const double whole = 4000 * M_PI / 3 * std::pow(kRadius, 3) * (std::string(name) == "fine" ? 0.125 : 1);
    EXPECT_NEAR(m.mass, whole, 0.02 * whole);
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(a, &info));
    if (std::string(name) == "fine") {
      EXPECT_EQ(info.ntet, 6u * 8);  // 2 x 2 x 2 cells, of which none is nearly empty
    }
  }
}

// "fix" holds what it selects: the surface there follows corners of hexahedra, all of which are held.
TEST(Lattice, HeldSurface_Stays) {
  test::Context context;
  const std::string folder = test::scratch("lattice_held"), path = folder + "/scene.json";
  const double size[3] = {1, 0.3, 0.3};
  dfm_mesh_handle straight = 0, askew = 0;
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_SURFACE, 400, &straight));
  const Worn worn(straight);
  std::vector<double> points(worn.def.points, worn.def.points + 3 * size_t{worn.def.npoint});
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (size_t i = 0; i < points.size(); i += 3) {
    const double x = points[i], y = points[i + 1];
    points[i] = c * x - s * y;
    points[i + 1] = s * x + c * y;
  }
  test::ok(dfm_mesh_create(context, worn.def.npoint, points.data(), worn.def.ntriangle, worn.def.triangles,
                           &askew));
  test::ok(dfm_mesh_write(askew, (folder + "/bar.stl").c_str()));
  for (const int cells : {3, 12, 40}) {
    test::write_file(path,
                     R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.2, "step": 0.01},
      "gravity": [0, 0, -9.81], "bodies": [{"name": "bar", "mesh": "bar.stl", "lattice": {"cells": )" +
                         std::to_string(cells) + R"(}, "model": {"type": "corotational_fem"},
      "material": "soft", "fix": [{"box": [[-1, -1, -1], [0.15, 1, 1]]}]}],
      "materials": {"soft": {"young": 5e4}}})");
    dfm_world world = 0;
    DFM_OK_OR_DIE(dfm_scene_load(context, path.c_str(), &world));
    dfm_body body = 0;
    test::ok(dfm_world_find_body(world, "bar", &body));
    uint32_t n = 0;
    test::ok(dfm_surface_positions(body, 0, nullptr, &n));
    std::vector<double> before(3 * size_t{n}), after(before.size());
    test::ok(dfm_surface_positions(body, n, before.data(), &n));
    test::run(world, 0.2, 0.01);
    test::ok(dfm_surface_positions(body, n, after.data(), &n));
    double most = 0, free = 0;
    for (size_t i = 0; i < before.size(); i += 3) {
      const double moved =
          std::hypot(after[i] - before[i], after[i + 1] - before[i + 1], after[i + 2] - before[i + 2]);
      (before[i] <= 0.15 ? most : free) = std::max(before[i] <= 0.15 ? most : free, moved);
    }
    EXPECT_LT(most, 1e-12) << cells;
    EXPECT_GT(free, 1e-3) << cells;
    dfm_world_destroy(world);
  }
}

TEST(Lattice, WhatCannotBeOne_SaysSo) {
  test::Context context;
  const dfm_mesh_handle whole = ball(context);
  dfm_mesh_handle mesh = 0;
  EXPECT_EQ(dfm_mesh_lattice(whole, 0, 0, &mesh), DFM_E_ARG);
  test::says({"either a number of cells", "or their size"});
  EXPECT_EQ(dfm_mesh_lattice(whole, 5, 0.1, &mesh), DFM_E_ARG);
  EXPECT_EQ(dfm_mesh_lattice(whole, 2000000, 0, &mesh), DFM_E_ARG);
  test::says({"1 to 1000000"});
  EXPECT_EQ(dfm_mesh_lattice(whole, 0, 1e-4, &mesh), DFM_E_ARG);
  test::says({"cells of 0.0001 m", "at most 1000000"});
  EXPECT_EQ(dfm_mesh_lattice(whole, 0, 0.3, &mesh), DFM_E_ARG);
  test::says({"cells of 0.3 m are larger than the surface"});
  const Worn worn(whole);
  dfm_mesh_handle open = 0;
  test::ok(dfm_mesh_create(context, worn.def.npoint, worn.def.points, worn.def.ntriangle - 1,
                           worn.def.triangles, &open));
  EXPECT_EQ(dfm_mesh_lattice(open, 8, 0, &mesh), DFM_E_FORMAT);
  test::says({"the surface is open", "3 edges", "fill"});
  std::vector<double> points(worn.def.points, worn.def.points + 3 * worn.def.npoint);
  std::vector<uint32_t> triangles(worn.def.triangles, worn.def.triangles + 3 * worn.def.ntriangle);
  for (size_t i = 0; i < size_t{3} * worn.def.npoint; ++i) points.push_back(points[i] + (i % 3 ? 0 : 0.03));
  for (size_t i = 0; i < size_t{3} * worn.def.ntriangle; ++i)
    triangles.push_back(triangles[i] + worn.def.npoint);
  dfm_mesh_handle crossing = 0;
  test::ok(dfm_mesh_create(context, 2 * worn.def.npoint, points.data(), 2 * worn.def.ntriangle,
                           triangles.data(), &crossing));
  EXPECT_EQ(dfm_mesh_lattice(crossing, 100, 0, &mesh), DFM_E_FORMAT);
  test::says({"crosses itself", "fill"});

  // askew to the axes, so that it is in many cells and fills none
  const double thin = 1e-9;
  const std::vector<double> needle{0, 0, 0, thin, -thin, 0, 0, thin, -thin, 1, 1, 1};
  const std::vector<uint32_t> sides{0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  dfm_mesh_handle hair = 0;
  test::ok(dfm_mesh_create(context, 4, needle.data(), 4, sides.data(), &hair));
  for (const double size : {0.0, 0.5}) {
    EXPECT_EQ(dfm_mesh_lattice(hair, size > 0 ? 0 : 10, size, &mesh), DFM_E_FORMAT);
    test::says({"encloses less than 1e-12 of every cell"});
  }

  test::ok(dfm_mesh_lattice(whole, 8, 0, &mesh));
  const dfm_world world = test::make_world(context);
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  d.model = "msm";
  dfm_body body = 0;
  EXPECT_EQ(dfm_body_create(world, &d, &body), DFM_E_UNSUPPORTED);
  test::says({"msm", "hexahedra"});
  d.model = "corotational_fem";
  const std::vector<double> none(27 * 8);
  d.cell_inside = none.data();
  EXPECT_EQ(dfm_body_create(world, &d, &body), DFM_E_ARG);
  test::says({"weights of cell 0", "more than 0"});
  dfm_world_destroy(world);

  const std::string folder = test::scratch("lattice_errors"), path = folder + "/scene.json";
  test::ok(dfm_mesh_write(whole, (folder + "/ball.stl").c_str()));
  const auto reported = [&](const std::string &keys, std::initializer_list<const char *> parts) {
    test::write_file(path, R"({"format": "deform-scene", "version": 1,
      "time": {"duration": 0.02, "step": 0.01},
      "bodies": [{"name": "ball", "model": {"type": "linear_fem"}, )" +
                               keys + "}]}");
    dfm_world w = 0;
    EXPECT_NE(dfm_scene_load(context, path.c_str(), &w), DFM_OK);
    test::says(parts);
  };
  reported(R"("mesh": "ball.stl", "lattice": {})", {"/bodies/0/lattice", "either \"cells\"", "\"size\""});
  reported(R"("mesh": "ball.stl", "lattice": {"cells": 8, "size": 0.1})", {"/bodies/0/lattice", "either"});
  reported(R"("mesh": "ball.stl", "lattice": {"cells": 8}, "fill": {"cells": 80})",
           {"/bodies/0/lattice", "\"fill\" too"});
  reported(R"("mesh": "ball.stl", "lattice": {"size": 1})", {"/bodies/0/lattice", "larger than the surface"});
}
