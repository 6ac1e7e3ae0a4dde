// Bodies of second-order tetrahedra and of hexahedra in worlds and scenes: they fall on a floor, swing, are
// saved and written; what does not take them says so.
#include <deform/plugin.h>

#include "mapped_solid.h"
#include "support.h"
#include "world.h"
#include "written.h"

namespace {

struct Kind {
  const char *make;
  bool second;
  std::array<double, 3> size;
  uint32_t cells;
};
constexpr Kind kBall = {"ball", true, {0.1, 0, 0}, 160}, kBricks = {"bricks", false, {0.2, 0.2, 0.2}, 27},
               kBlock = {"beam", true, {0.2, 0.2, 0.2}, 96}, kFine = {"bricks", true, {0.2, 0.2, 0.2}, 8},
               kTwenty = {"bricks of 20 points", false, {0.2, 0.2, 0.2}, 8};

dfm_mesh_handle made(dfm_context *context, const Kind &kind) {
  dfm_mesh_handle mesh = 0;
  if (kind.make == kTwenty.make) {
    const auto at = [](double a, double b, double c) { return test::Vec{0.2 * a, 0.2 * b, 0.2 * c}; };
    const std::string file = test::Grid(test::kHex20, {{{2, 2, 2}, at}}).file();
    test::ok(dfm_mesh_load(context, file.c_str(), DFM_MESH_CELLS, &mesh));
    return mesh;
  }
  test::ok(dfm_mesh_make(context, kind.make, kind.size.data(), DFM_MESH_CELLS, kind.cells, &mesh));
  if (kind.second) test::ok(dfm_mesh_second_order(mesh, &mesh));
  return mesh;
}

dfm_body_def def_of(dfm_mesh_handle mesh, const char *model) {
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  d.model = model;
  return d;
}

struct Drop {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  explicit Drop(const Kind &kind, int32_t integrator, double young = 2e5, double height = 0.3) {
    world = test::make_world(context, {0, 0, -9.81}, integrator);
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    dfm_mesh_handle mesh = made(context, kind);
    dfm_body_def d = def_of(mesh, "corotational_fem");
    test::BodyOptions o;
    o.young = young;
    d.material = test::make_material(world, o);
    d.pose.position[2] = height;
    d.spin[0] = 3;
    d.spin[1] = 1;
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
  }
  ~Drop() { dfm_world_destroy(world); }
};

// unsanitized: too slow there; shorter tests run the same code
TEST(CellWorlds, BodiesDroppedOnAFloor_BounceWithoutNewEnergyAndDoNotCross) {
  for (const Kind &kind : {kBall, kBricks, kFine, kTwenty})
    for (int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
      Drop d(kind, integrator);
      const double before = test::total_energy(d.body), h = 2e-3;
      uint32_t seen = 0, touched = 0;
      double most = 0;
      for (int n = 0; n < 300; ++n) {
        uint32_t trouble = 0;
        ASSERT_EQ(dfm_world_step(d.world, h, &trouble), DFM_OK) << dfm_last_error();
        seen |= trouble;
        touched += !test::contacts(d.world).empty();
        most = std::max(most, test::total_energy(d.body));
        ASSERT_EQ(test::measure(d.body).inverted, 0u);
      }
      EXPECT_EQ(seen & ~uint32_t(DFM_TROUBLE_SUBSTEPS), 0u) << kind.make << " " << integrator;
      EXPECT_GT(touched, 10u);
      EXPECT_LT(most, before * 1.01);
      uint32_t n = 0;
      std::vector<double> x(3 * 2000);
      test::ok(dfm_body_get_state(d.body, 2000, x.data(), nullptr, &n));
      for (uint32_t i = 0; i < n; ++i) EXPECT_GT(x[3 * i + 2], -1e-4);
    }
}

// Modes and condensation of such cells: a block on a slope that friction holds neither creeps nor sinks, and
// goes on from a snapshot with the same bits.
// unsanitized: too slow there; shorter tests run the same code
TEST(CellWorlds, BlocksOfModesOnASlope_NeitherCreepNorSink) {
  constexpr double kTilt = 0.3;
  struct Slope {
    test::Context context;
    dfm_world world;
    dfm_body body = 0;
    Slope(const Kind &kind, const char *model) {
      world = test::make_world(context, {9.81 * std::sin(kTilt), 0, -9.81 * std::cos(kTilt)});
      test::add_plane(world, "floor");
      test::set_friction(world, 0.6);
      const dfm_mesh_handle mesh = made(context, kind);
      dfm_body_def d = def_of(mesh, model);
      test::BodyOptions o;
      o.young = 2e5;
      o.damping_stiffness = 2e-3;
      d.material = test::make_material(world, o);
      d.pose.position[2] = 1e-4;
      test::ok(dfm_body_create(world, &d, &body));
    }
    ~Slope() { dfm_world_destroy(world); }
  };
  for (const Kind &kind : {kBlock, kBricks})
    for (const char *const model : {"modal", "condensed"}) {
      Slope s(kind, model), other(kind, model);
      test::run(s.world, 3.0, 2e-3);
      const dfm_body_measure before = test::measure(s.body);
      const std::string kept = test::snapshot(s.world);
      test::run(s.world, 2.0, 2e-3);
      const dfm_body_measure after = test::measure(s.body);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.com[k], before.com[k], 1e-8) << kind.make << model;
      const double normal = 2.0 * 9.81 * std::cos(kTilt) * after.mass;
      EXPECT_NEAR(after.contact_impulse[2] - before.contact_impulse[2], normal, 1e-4 * normal);
      test::ok(dfm_world_restore(other.world, kept.data(), kept.size()));
      test::run(other.world, 2.0, 2e-3);
      EXPECT_TRUE(test::snapshot(s.world) == test::snapshot(other.world)) << kind.make << model;
    }
}

TEST(CellWorlds, MassAndVolume_AreThoseOfTheShape) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  for (const Kind &kind : {kBall, kBricks, kFine}) {
    dfm_mesh_handle mesh = made(context, kind);
    const dfm_mesh_info info = test::info_of(mesh);
    EXPECT_EQ(info.ncell, kind.cells);
    const bool bricks = std::string(kind.make) == "bricks";
    EXPECT_EQ(info.cell, uint32_t(!bricks ? DFM_CELL_TET10 : kind.second ? DFM_CELL_HEX27 : DFM_CELL_HEX8));
    const dfm_body_def d = def_of(mesh, "corotational_fem");
    dfm_body body = 0;
    test::ok(dfm_body_create(world, &d, &body));
    const dfm_body_measure m = test::measure(body);
    EXPECT_NEAR(m.mass, 1000 * info.volume, 1e-9);
    EXPECT_NEAR(m.rest_volume, info.volume, 1e-12);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(m.com[k], (info.lo[k] + info.hi[k]) / 2, 1e-12);
  }
  dfm_world_destroy(world);
}

TEST(CellWorlds, MaterialsThatDifferWithinACell_AreThatOfItsFirstTetrahedron) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  test::BodyOptions light, heavy;
  light.density = 500;
  heavy.density = 2000;
  heavy.name = "heavy";
  const dfm_material a = test::make_material(world, light), b = test::make_material(world, heavy);
  for (const Kind &kind : {kBall, kBricks}) {
    dfm_mesh_handle mesh = made(context, kind);
    dfm_body_def d = def_of(mesh, "corotational_fem");
    const uint32_t each = kind.second ? 8 : 6;
    std::vector<dfm_material> mixed(d.ntet, b);
    for (uint32_t t = 0; t < d.ntet; t += each) mixed[t] = a;
    d.cell_materials = mixed.data();
    dfm_body body = 0;
    test::ok(dfm_body_create(world, &d, &body));
    const dfm_body_measure m = test::measure(body);
    EXPECT_NEAR(m.mass, 500 * m.rest_volume, 1e-9);
    test::ok(dfm_mesh_destroy(mesh));
  }
  dfm_world_destroy(world);
}

TEST(CellWorlds, Snapshot_ContinuesWithTheSameBits) {
  for (const Kind &kind : {kBall, kTwenty}) {
    Drop d(kind, DFM_INTEGRATOR_SYMPLECTIC_EULER), other(kind, DFM_INTEGRATOR_SYMPLECTIC_EULER);
    test::run(d.world, 0.3, 2e-3);
    const std::string kept = test::snapshot(d.world);
    test::ok(dfm_world_restore(other.world, kept.data(), kept.size()));
    test::run(d.world, 0.1, 2e-3);
    test::run(other.world, 0.1, 2e-3);
    EXPECT_TRUE(test::snapshot(d.world) == test::snapshot(other.world)) << kind.make;
  }
}

// A sphere, in part outside the cells, follows a field that is quadratic where they are slanted boxes and
// their parts, and one that is linear where they are curved.
TEST(CellWorlds, SurfaceOfItsOwn_FollowsQuadraticFields) {
  const auto straight = [](double a, double b, double c) { return test::Vec{a + 0.3 * b, b, c - 0.2 * a}; };
  const auto curved = [&](double a, double b, double c) {
    return straight(a + 0.1 * b * b, b + 0.1 * std::sin(2 * c), c + 0.1 * a * b);
  };
  test::Context context;
  const dfm_world world = test::make_world(context);
  const double radius[3] = {0.45};
  dfm_mesh_handle ball = 0;
  test::ok(dfm_mesh_make(context, "ball", radius, DFM_MESH_SURFACE, 600, &ball));
  const dfm_mesh_info skin = test::info_of(ball);
  std::vector<double> points(skin.points, skin.points + 3 * skin.npoint), seen(points), cells(3 * 2000);
  for (size_t i = 0; i < points.size(); ++i) points[i] += std::array{0.8, 0.5, 0.4}[i % 3];
  dfm_surface_def surface{};
  surface.size = sizeof surface;
  surface.npoint = skin.npoint;
  surface.ntriangle = skin.ntriangle;
  surface.points = points.data();
  surface.triangles = skin.faces;
  for (const uint32_t kind : {test::kTet10, test::kHex20, test::kHex27})
    for (const double square : {0.2, 0.0}) {
      const auto field = [&](double *x) {
        const double a = x[0], b = x[1], c = x[2];
        x[0] += square * (b * c - a * a) + 0.1 * b;
        x[1] += square * (c * a + b * b) - 0.2 * c;
        x[2] += square * (a * b - 2 * c * c) + 0.3 * a;
      };
      const test::Grid grid =
          square > 0 ? test::Grid(kind, {{{2, 2, 2}, straight}}) : test::Grid(kind, {{{2, 2, 2}, curved}});
      dfm_mesh_handle mesh = 0;
      test::ok(dfm_mesh_load(context, grid.file().c_str(), DFM_MESH_CELLS, &mesh));
      dfm_body_def d = def_of(mesh, "linear_fem");
      d.surface = &surface;
      dfm_body body = 0;
      test::ok(dfm_body_create(world, &d, &body));
      uint32_t n = 0;
      test::ok(dfm_body_get_state(body, 2000, cells.data(), nullptr, &n));
      for (uint32_t i = 0; i < n; ++i) field(&cells[3 * size_t{i}]);
      test::ok(dfm_body_set_state(body, n, cells.data(), nullptr));
      test::ok(dfm_surface_positions(body, skin.npoint, seen.data(), &n));
      ASSERT_EQ(n, skin.npoint);
      double most = 0;
      for (size_t s = 0; s < points.size(); s += 3) {
        test::Vec want = {points[s], points[s + 1], points[s + 2]};
        field(want.data());
        for (size_t k = 0; k < 3; ++k) most = std::max(most, std::abs(seen[s + k] - want[k]));
      }
      EXPECT_LT(most, 1e-12) << kind << " " << square;
      test::ok(dfm_body_destroy(body));
      test::ok(dfm_mesh_destroy(mesh));
    }
  dfm_world_destroy(world);
}

// Each tetrahedron of a cell has the cell's.
TEST(CellWorlds, StressAndEnergy_AreThatOfTheCell) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  dfm_mesh_handle mesh = made(context, kBricks);
  dfm_body_def d = def_of(mesh, "corotational_fem");
  dfm_body body = 0;
  test::ok(dfm_body_create(world, &d, &body));
  std::vector<double> x(d.points, d.points + 3 * d.npoint);
  for (size_t i = 0; i < x.size(); i += 3) x[i] *= 1 + 0.1 * x[i];
  test::ok(dfm_body_set_state(body, d.npoint, x.data(), nullptr));
  std::vector<double> stress(6 * size_t(d.ntet));
  test::ok(dfm_body_stress(body, d.ntet, stress.data()));
  for (uint32_t t = 0; t < d.ntet; ++t)
    for (uint32_t k = 0; k < 6; ++k) EXPECT_EQ(stress[6 * t + k], stress[6 * (t / 6 * 6) + k]);
  EXPECT_NE(stress[0], stress[6 * size_t(d.ntet - 1)]);
  for (size_t i = 0; i < x.size(); ++i) x[i] = d.points[i] * (i % 3 == 0 ? 1.1 : 1);
  test::ok(dfm_body_set_state(body, d.npoint, x.data(), nullptr));
  test::ok(dfm_body_stress(body, d.ntet, stress.data()));
  std::vector<double> there(6 * size_t(d.npoint));
  EXPECT_EQ(dfm_body_point_stress(body, d.npoint - 1, there.data()), DFM_E_ARG);
  test::ok(dfm_body_point_stress(body, d.npoint, there.data()));
  for (size_t i = 0; i < there.size(); ++i) EXPECT_NEAR(there[i], stress[i % 6], 1e-9 * stress[0]) << i;
  dfm_world_destroy(world);
}

TEST(CellWorlds, WhatTakesNoSuchCells_SaysSo) {
  Drop d(kBricks, DFM_INTEGRATOR_IMPLICIT_EULER);
  dfm_cut_def cut = dfm_cut_def_default();
  cut.half_size[0] = cut.half_size[1] = cut.half_size[2] = 1;
  EXPECT_EQ(dfm_body_cut(d.body, &cut, nullptr), DFM_E_UNSUPPORTED);
  test::says({"neither cut nor torn", "hexahedra", "first-order tetrahedra"});
  EXPECT_EQ(dfm_body_set_model(d.body, "msm", nullptr), DFM_E_UNSUPPORTED);
  test::says({"msm", "does not accept hexahedra", "corotational_fem", "condensed"});
  dfm_mesh_handle mesh = made(d.context, kBall);
  dfm_body body = 0;
  for (const char *model : {"msm", "shape_matching", "boundary", "meshless"}) {
    const dfm_body_def def = def_of(mesh, model);
    EXPECT_EQ(dfm_body_create(d.world, &def, &body), DFM_E_UNSUPPORTED) << model;
    test::says({model, "does not accept second-order tetrahedra"});
  }
  dfm_body_def def = def_of(mesh, "corotational_fem");
  def.ntet -= 8;
  std::vector<uint32_t> tets(def.tets, def.tets + 4 * def.ntet);
  def.tets = tets.data();
  tets[0] = def.tets[5];
  EXPECT_NE(dfm_body_create(d.world, &def, &body), DFM_OK);
  def = def_of(mesh, "corotational_fem");
  def.cell = 3;
  EXPECT_EQ(dfm_body_create(d.world, &def, &body), DFM_E_ARG);
  test::says({"3 is no kind of cell"});
  for (const bool first_order : {false, true}) {
    def = def_of(mesh, "corotational_fem");
    if (first_order) def.cell = DFM_CELL_TET;
    else def.cells = nullptr;
    EXPECT_EQ(dfm_body_create(d.world, &def, &body), DFM_E_ARG);
    test::says({"tetrahedra need no cells", "dfm_mesh_get_info"});
  }
  const double one = 1;
  const dfm_param_value value{"locking", &one, 1};
  def = def_of(mesh, "corotational_fem");
  def.model_params = {sizeof(dfm_params), 1, &value};
  EXPECT_EQ(dfm_body_create(d.world, &def, &body), DFM_E_ARG);
  test::says({"locking", "first-order tetrahedra alone"});
}

constexpr const char *kScene = R"({"format": "deform-scene", "version": 1,
  "time": {"duration": 0.02, "step": 0.01},
  "bodies": [
    {"name": "second", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 48, "order": 2},
     "device": "auto", "fix": [{"box": [[-1, -1, -1], [0.001, 1, 1]]}]},
    {"name": "bricks", "mesh": {"make": "bricks", "size": [0.4, 0.1, 0.1], "cells": 4},
     "model": {"type": "linear_fem"}, "pose": {"position": [0, 1, 0]},
     "fix": [{"box": [[-1, -1, -1], [0.001, 1, 1]]}]}]})";

TEST(CellWorlds, Scene_MakesThemAndAWrittenSceneHasThem) {
  test::Context context;
  const std::string folder = test::scratch("cell_scene"), path = folder + "/scene.json";
  const test::Written both(context, folder, kScene);
  for (const char *name : {"second", "bricks"}) both.same(name);
  dfm_body_info second{};
  test::ok(dfm_body_get_info(both.same("second"), &second));
  EXPECT_STREQ(second.model, "org.deform.corotational_fem");  // it names none
  std::string bricks = kScene;
  bricks.replace(bricks.find("\"beam\""), 6, "\"bricks\"");
  const test::Written of_bricks(context, folder, bricks.c_str());
  of_bricks.same("second");
}

}  // namespace
