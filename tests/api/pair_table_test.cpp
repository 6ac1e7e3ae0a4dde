// Which law holds between two things: specificity, order, the default where two materials meet, names that
// are wrong, and what is saved.
#include <gtest/gtest.h>

#include "support.h"
#include "zoned.h"

namespace {

// A block of two materials by cell, named parts left and right, on a floor with a material of its own.
struct Table {
  test::Context context;
  dfm_world world;
  dfm_body block;
  dfm_material ice, rubber, steel;
  explicit Table(double ice_friction = -1, double rubber_friction = -1, double steel_friction = -1) {
    world = test::make_world(context);
    ice = material("ice", ice_friction);
    rubber = material("rubber", rubber_friction);
    steel = material("steel", steel_friction);
    test::ZonedOptions o;
    o.name = "block";
    o.position = {-0.05, -0.05, 2e-5};
    o.velocity = {1, 0, 0};
    o.groups = {"left", "right"};
    o.group = [](const double x[3]) { return x[1] > 0.05 ? 0u : x[1] < 0.05 ? 1u : UINT32_MAX; };
    o.material = [this](const double x[3]) { return x[0] < 0.05 ? ice : rubber; };
    block = test::make_zoned_beam(context, world, {0.1, 0.1, 0.1}, 96, o);
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "floor";
    d.shape = DFM_SHAPE_PLANE;
    d.material = steel;
    dfm_obstacle floor = 0;
    test::ok(dfm_obstacle_create(world, &d, &floor));
  }
  ~Table() { dfm_world_destroy(world); }
  dfm_material material(const char *name, double friction) {
    dfm_material_def d = dfm_material_def_default();
    const dfm_param_value v{"friction", &friction, 1};
    d.name = name;
    d.young = 1e6;
    d.poisson = 0;
    d.damping_stiffness = 1e-3;
    if (friction >= 0) d.extra = {sizeof(dfm_params), 1, &v};
    dfm_material m = 0;
    test::ok(dfm_material_create(world, &d, &m));
    return m;
  }
  // Coefficient of the sliding contact in the quadrant of the block: x < 0 ice, y > 0 left.
  double mu(double x, double y) {
    for (int k = 0; k < 60; ++k) {
      test::run(world, 5e-4, 5e-4);
      for (const dfm_contact &c : test::contacts(world)) {
        const dfm_body_measure m = test::measure(block);
        const double px = c.point[0] - m.com[0], py = c.point[1] - m.com[1];
        // the corners: the line between the materials and the parts runs through the middle
        if (px * x < 0.03 * std::fabs(x) || py * y < 0.03 * std::fabs(y) || c.flags & DFM_CONTACT_STICKING ||
            !(c.fn > 1e-2))
          continue;
        return std::hypot(c.ft[0], c.ft[1]) / c.fn;
      }
    }
    return NAN;
  }
};

}  // namespace

TEST(PairTable, MostSpecificRule_WinsInAnyOrderThenTheLast) {
  struct Rule {
    const char *a, *b;
    double mu;
  };
  struct Case {
    std::vector<Rule> rules;
    double ice_left, rubber_right;
  };
  const std::vector<Case> cases = {
      {{}, 0.5, 0.5},
      {{{"*", "*", 0.1}}, 0.1, 0.1},
      {{{"*", "*", 0.1}, {"*", "*", 0.2}}, 0.2, 0.2},
      {{{"material=ice", "*", 0.1}, {"*", "*", 0.2}}, 0.1, 0.2},
      {{{"*", "material=rubber", 0.3}, {"material=steel", "material=ice", 0.1}, {"*", "*", 0.2}}, 0.1, 0.3},
      {{{"block", "*", 0.1}, {"material=ice", "*", 0.2}}, 0.1, 0.1},
      {{{"block:left", "*", 0.1}, {"block", "*", 0.2}}, 0.1, 0.2},
      {{{"floor", "block:left", 0.1}, {"block", "floor", 0.2}, {"material=rubber", "floor", 0.3}}, 0.1, 0.2},
      // 4 + 1 against 3 + 2: equal, so the last one; 3 + 3 beats 4 + 1
      {{{"block:left", "*", 0.1}, {"block", "material=steel", 0.2}}, 0.2, 0.2},
      {{{"block", "material=steel", 0.2}, {"block:left", "*", 0.1}}, 0.1, 0.2},
      {{{"block", "floor", 0.2}, {"block:left", "*", 0.1}}, 0.2, 0.2},
  };
  for (const Case &k : cases) {
    for (const bool left : {true, false}) {
      Table t;
      for (const Rule &r : k.rules) test::ok(test::friction(t.world, r.a, r.b, r.mu));
      EXPECT_NEAR(left ? t.mu(-1, 1) : t.mu(1, -1), left ? k.ice_left : k.rubber_right, 1e-6)
          << "case " << &k - cases.data() << (left ? " left" : " right");
    }
  }
}

TEST(PairTable, WithoutARule_TwoMaterialsMeetAtTheirGeometricMean) {
  Table both(0.04, 0.9, 0.16);
  EXPECT_NEAR(both.mu(-1, 1), 0.08, 1e-6);
  Table other(0.04, 0.81, 0.16);
  EXPECT_NEAR(other.mu(1, -1), 0.36, 1e-6);
  Table one(0.08, -1, -1);  // the other side has 0.5
  EXPECT_NEAR(one.mu(-1, 1), 0.2, 1e-6);
  Table none(0, -1, 2);
  EXPECT_NEAR(none.mu(-1, 1), 0, 1e-12);
  Table ruled(0.04, 0.81, 0.16);
  test::ok(test::friction(ruled.world, "*", "*", 0.3));
  EXPECT_NEAR(ruled.mu(-1, 1), 0.3, 1e-6) << "any rule that names the pair wins";
}

TEST(PairTable, WrongNames_AreRefusedWithTheNearest) {
  Table t;
  const auto says = [](const std::vector<std::string> &parts) {
    for (const std::string &p : parts)
      EXPECT_NE(std::string(dfm_last_error()).find(p), std::string::npos)
          << dfm_last_error() << " lacks " << p;
  };
  EXPECT_EQ(test::friction(t.world, "block:lefd", "*", 0.1), DFM_E_ARG);
  says({"'lefd'", "did you mean 'left'", "right"});
  EXPECT_EQ(test::friction(t.world, "blok:left", "*", 0.1), DFM_E_ARG);
  says({"'blok:left'", "block"});
  EXPECT_EQ(test::friction(t.world, "floor:left", "*", 0.1), DFM_E_ARG);
  says({"'floor'", "no surface groups"});
  EXPECT_EQ(test::friction(t.world, "material=icy", "*", 0.1), DFM_E_ARG);
  says({"material=ice"});
  EXPECT_EQ(dfm_world_filter_pair(t.world, "block:left", "floor", false), DFM_E_UNSUPPORTED);
  says({"block:left", "whole body"});
  const double minus = -1, two[] = {0.1, 0.2};
  for (const auto &[value, width] : {std::pair{&minus, 1u}, {&two[0], 2u}}) {
    const dfm_param_value v{"friction", value, width};
    dfm_material_def d = dfm_material_def_default();
    d.extra = {sizeof(dfm_params), 1, &v};
    dfm_material m = 0;
    EXPECT_EQ(dfm_material_create(t.world, &d, &m), DFM_E_ARG);
    says({"friction"});
  }
}

TEST(PairTable, WrongGroups_AreRefused) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t tet[] = {0, 1, 2, 3}, face[] = {2, 1, 0}, far[] = {0, 1, 9}, group = 0, other = 3;
  const char *const name = "foot", *const nothing = "";
  const auto create = [&](const dfm_surface_groups &g) {
    dfm_body_def d = dfm_body_def_default();
    d.npoint = 4;
    d.ntet = 1;
    d.points = points;
    d.tets = tet;
    d.groups = &g;
    dfm_body b = 0;
    return dfm_body_create(world, &d, &b);
  };
  const uint32_t size = sizeof(dfm_surface_groups);
  const std::vector<std::pair<dfm_surface_groups, std::string>> wrong = {
      {{4, 1, &name, 1, 0, face, &group}, "size"},
      {{size, 1, nullptr, 1, 0, face, &group}, "names"},
      {{size, 1, &nothing, 1, 0, face, &group}, "no name"},
      {{size, 1, &name, 1, 0, face, nullptr}, "group"},
      {{size, 1, &name, 1, 0, far, &group}, "point 9"},
      {{size, 1, &name, 1, 0, face, &other}, "group 3 of 1"},
      {{size, 1, &name, 1, 0, nullptr, &group}, "which has 4"}};
  for (const auto &[g, part] : wrong) {
    EXPECT_EQ(create(g), DFM_E_ARG) << part;
    EXPECT_NE(std::string(dfm_last_error()).find(part), std::string::npos) << dfm_last_error();
  }
  uint32_t n = 9;
  test::ok(dfm_world_bodies(world, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
  EXPECT_EQ(create({size, 1, &name, 1, 0, face, &group}), DFM_OK) << dfm_last_error();
}

TEST(PairTable, SnapshotInMidContact_ContinuesWithTheSameBits) {
  const auto rules = [](Table &t) {
    test::ok(test::friction(t.world, "block:left", "*", 0.1));
    test::ok(test::friction(t.world, "block:right", "*", 0.3));
  };
  Table a, b;
  rules(a);
  rules(b);
  test::run(a.world, 0.05, 1e-3);
  const std::string buffer = test::snapshot(a.world);
  test::ok(dfm_world_restore(b.world, buffer.data(), buffer.size()));
  test::run(a.world, 0.05, 1e-3);
  test::run(b.world, 0.05, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
  // rules are state: a world that had none goes on with those of the snapshot
  Table c;
  test::ok(dfm_world_restore(c.world, buffer.data(), buffer.size()));
  test::run(c.world, 0.05, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(c.world));
  // another coefficient of a material is another world
  Table d(0.1);
  EXPECT_LT(dfm_world_restore(d.world, buffer.data(), buffer.size()), 0);
}

TEST(PairTable, SceneWithGroups_SlidesByThem) {
  test::Context context;
  const std::string folder = test::scratch("pair_table_scene");
  // a cube of 0.1 m whose six faces are groups of an OBJ file; "foot" lies on the floor
  std::string obj;
  for (int i = 0; i < 8; ++i)
    obj += "v " + std::to_string(0.1 * (i & 1)) + " " + std::to_string(0.1 * ((i >> 1) & 1)) + " " +
           std::to_string(0.1 * (i >> 2)) + "\n";
  obj += "g foot\nf 1 3 4 2\ng rest\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  test::write_file(folder + "/cube.obj", obj);
  const auto scene = [&](const std::string &group) {
    const std::string path = folder + "/scene.json";
    test::write_file(path, R"({"format": "deform-scene", "version": 1, "time": {"duration": 1, "step": 0.001},
      "materials": {"gel": {"young": 1e6, "damping": {"stiffness": 0.001}, "friction": 0.01}},
      "bodies": [{"name": "cube", "mesh": "cube.obj", "fill": {"cells": 100}, "material": "gel",
        "pose": {"position": [0, 0, 0.0001]}, "velocity": [1, 0, 0]}],
      "obstacles": [{"name": "floor", "shape": "plane"}],
      "contact": {"friction": [{"between": ["cube:)" +
                               group + R"(", "floor"], "law": "coulomb", "params": {"mu": 0.4}}]}})");
    return path;
  };
  dfm_world world = 0;
  EXPECT_EQ(dfm_scene_load(context, scene("foots").c_str(), &world), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("/contact/friction/0"), std::string::npos) << dfm_last_error();
  EXPECT_NE(std::string(dfm_last_error()).find("did you mean 'foot'"), std::string::npos) << dfm_last_error();
  double speed[2];
  for (const bool foot : {true, false}) {
    DFM_OK_OR_DIE(dfm_scene_load(context, scene(foot ? "foot" : "rest").c_str(), &world));
    dfm_body body = 0;
    test::ok(dfm_world_find_body(world, "cube", &body));
    test::run(world, 0.2, 1e-3);
    speed[foot] = test::measure(body).velocity[0];
    test::ok(dfm_world_destroy(world));
  }
  EXPECT_NEAR(speed[1], 1 - 0.4 * 9.81 * 0.2, 0.05);
  // sqrt(0.01 * 0.5): the material's own coefficient and the floor's default
  EXPECT_NEAR(speed[0], 1 - std::sqrt(0.005) * 9.81 * 0.2, 0.02);
}
