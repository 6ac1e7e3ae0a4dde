// Tools and free rigid bodies: what a grasper holds by friction alone does not creep, whatever its shape and
// the law of the pair, and a tool pushes a rigid body against a soft one.
#include "tool.h"

namespace {

using namespace test::tools;
using test::Vec;

dfm_tool_def table() {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "table";
  d.shape = DFM_TOOL_BOX;
  d.half_size[0] = d.half_size[1] = 0.1;
  d.half_size[2] = 0.01;
  d.pose = pose({0, 0, -0.01});
  return d;
}

dfm_tool_def grasper(double high) {
  return test::tools::grasper({0.003, 0.006, 0.02}, 0.4, pose({0, 0, high}));
}

struct Thing {
  const char *name;
  uint32_t shape;
  Vec half;  // of its box, m; a capsule lies along y
};
const Thing kCube{"cube", DFM_SHAPE_BOX, {0.005, 0.005, 0.005}},
    kMesh{"mesh", DFM_SHAPE_MESH, {0.005, 0.006, 0.005}},
    kBall{"ball", DFM_SHAPE_SPHERE, {0.005, 0.005, 0.005}},
    kNeedle{"needle", DFM_SHAPE_BOX, {0.005, 0.03, 0.004}},
    kRod{"rod", DFM_SHAPE_CAPSULE, {0.005, 0.025, 0.005}};

dfm_rigid put(dfm_world w, const Thing &thing, double mass) {
  dfm_rigid_def d = test::box(thing.name, thing.half, mass, {0, 0, thing.half[2] + 1e-5});
  if (thing.shape == DFM_SHAPE_SPHERE || thing.shape == DFM_SHAPE_CAPSULE) {
    d.shape = thing.shape;
    d.radius = thing.half[0];
    d.half_length = thing.half[1] - thing.half[0];
  }
  if (thing.shape == DFM_SHAPE_CAPSULE)
    d.pose = pose({0, 0, thing.half[2] + 1e-5}, {1, 0, 0}, std::acos(0.0));
  if (thing.shape != DFM_SHAPE_MESH) return test::create(w, {d})[0];
  const BoxMesh mesh(thing.half);
  d.shape = DFM_SHAPE_NONE;
  for (size_t k = 0; k < 3; ++k)
    d.inertia[k] = mass / 3 * (test::dot(thing.half, thing.half) - thing.half[k] * thing.half[k]);
  const dfm_rigid made = test::create(w, {d})[0];
  dfm_obstacle_def of = dfm_obstacle_def_default();
  of.name = "triangles";
  mesh.put(of);
  dfm_obstacle shape = 0;
  test::ok(dfm_rigid_add_shape(made, &of, &shape));
  return made;
}

// Where it is in the frame of the grasper.
struct Held {
  Vec at;
  std::array<double, 4> turn;
};
std::array<double, 4> times(const double a[4], const double b[4]) {
  const Vec u = {a[0], a[1], a[2]}, v = {b[0], b[1], b[2]}, c = cross(u, v);
  return {a[3] * b[0] + b[3] * a[0] + c[0], a[3] * b[1] + b[3] * a[1] + c[1],
          a[3] * b[2] + b[3] * a[2] + c[2], a[3] * b[3] - test::dot(u, v)};
}
Held held(dfm_tool t, dfm_rigid r) {
  const dfm_pose p = state(t).pose;
  const dfm_rigid_state s = test::state(r);
  const double back[4] = {-p.rotation[0], -p.rotation[1], -p.rotation[2], p.rotation[3]};
  Vec way{};
  for (size_t k = 0; k < 3; ++k) way[k] = s.position[k] - p.position[k];
  return {rotate(back, way), times(back, s.rotation)};
}
// m, and m at the end of an arm of 1 cm
double crept(const Held &a, const Held &b) {
  double turn = 0;
  for (size_t k = 0; k < 4; ++k) turn = std::max(turn, std::fabs(a.turn[k] - b.turn[k]));
  return test::apart(a.at, b.at) + 0.02 * turn;
}

}  // namespace

// It closes on a thing that lies on a table, lifts it by 10 cm, and holds it for 5 s.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolLift, ByFrictionAlone_NothingCreeps) {
  for (const Thing &thing : {kCube, kMesh, kBall, kNeedle, kRod})
    for (const double dt : {1e-3, 1.0 / 60}) {
      SCOPED_TRACE(std::string(thing.name) + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -9.81});
      test::set_friction(w, 0.6);
      const double high = thing.half[2] + 0.035;
      const dfm_tool g = make(w, grasper(high));
      make(w, table());
      const dfm_rigid r = put(w, thing, 0.05);
      Held start{};
      double most = 0;
      for (int i = 1; i * dt < 7.2; ++i) {
        const double t = i * dt;
        test::ok(dfm_tool_set_opening(g, std::max(0.4 - std::max(t - 0.3, 0.0), 0.2)));
        const dfm_pose to = pose({0, 0, high + 0.1 * std::min(std::max((t - 0.8) / 1.0, 0.0), 1.0)});
        test::ok(dfm_tool_set_pose(g, &to, nullptr));
        ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
        if (t < 2.1) start = held(g, r);
        most = std::max(most, crept(start, held(g, r)) * (t >= 2.1));
      }
      EXPECT_LT(most, 1e-9);
      EXPECT_NEAR(test::state(r).position[2], 0.1 + thing.half[2], 1e-3) << "lifted";
      double force[3], torque[3];
      test::ok(dfm_tool_force(g, force, torque));
      EXPECT_NEAR(force[2], -0.05 * 9.81, 1e-6);
    }
}

// The laws of the pair, with their memory.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolLift, ByEveryLaw_NothingCreeps) {
  for (const char *law : {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"}) {
    SCOPED_TRACE(law);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -9.81});
    test::set_friction(w, 0.6, law);
    const dfm_tool g = make(w, grasper(0.04));
    make(w, table());
    const dfm_rigid r = put(w, kCube, 0.05);
    Held start{};
    double most = 0;
    for (int i = 1; i <= 4000; ++i) {
      const double t = 1e-3 * i;
      test::ok(dfm_tool_set_opening(g, std::max(0.4 - std::max(t - 0.3, 0.0), 0.2)));
      const dfm_pose to = pose({0, 0, 0.04 + 0.1 * std::min(std::max((t - 0.8) / 1.0, 0.0), 1.0)});
      test::ok(dfm_tool_set_pose(g, &to, nullptr));
      ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
      if (i < 2500) start = held(g, r);
      most = std::max(most, crept(start, held(g, r)));
    }
    EXPECT_LT(most, 1e-8);
    EXPECT_NEAR(test::state(r).position[2], 0.105, 1e-3) << "lifted";
  }
}

// A held needle, whose moments differ 50 times, is turned and tilted and carried about, and a snapshot in the
// middle of it continues with the same bits.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolLift, ANeedleThatIsTurned_StaysInTheJaws) {
  for (const double dt : {1e-3, 1.0 / 120}) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -9.81});
    test::set_friction(w, 0.6);
    const dfm_tool g = make(w, grasper(0.039));
    make(w, table());
    const dfm_rigid r = put(w, kNeedle, 0.01);
    const auto step = [&](int i) {
      const double t = i * dt, s = std::min(std::max((t - 1.5) / 0.8, 0.0), 1.0);
      test::ok(dfm_tool_set_opening(g, std::max(0.4 - std::max(t - 0.3, 0.0), 0.2)));
      dfm_pose to = pose({0.05 * s, 0.02 * s, 0.039 + 0.1 * std::min(std::max((t - 0.8) / 0.5, 0.0), 1.0)},
                         {0.3, 0.2, 1}, 2.0 * s);
      test::ok(dfm_tool_set_pose(g, &to, nullptr));
      ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
    };
    const int before = int(1.45 / dt), middle = int(1.8 / dt), end = int(3 / dt);
    for (int i = 1; i <= middle; ++i) {
      step(i);
      if (i == before) break;
    }
    const Held start = held(g, r);
    for (int i = before + 1; i <= middle; ++i) step(i);
    const std::string data = test::snapshot(w);
    for (int i = middle + 1; i <= end; ++i) step(i);
    const uint64_t hash = dfm_world_hash(w);
    EXPECT_LT(crept(start, held(g, r)), 1e-5) << "the jaws give way as the load turns";
    const Held there = held(g, r);
    for (int i = end + 1; i <= 2 * end; ++i) step(i);
    EXPECT_LT(crept(there, held(g, r)), 1e-9);
    test::ok(dfm_world_restore(w, data.data(), data.size()));
    EXPECT_EQ(test::snapshot(w), data);
    for (int i = middle + 1; i <= end; ++i) step(i);
    EXPECT_EQ(dfm_world_hash(w), hash);
  }
}

// Jaws that close to nothing on a soft bar of 0.5 g. They yield, so that it stays between them; with jaws
// that did not, it was shot out at 150 m/s, or the run ended.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolLift, JawsThatCloseOnABar_DoNotShootItOut) {
  for (const char *model : {"shape_matching", "modal", "linear_fem", "msm"})
    for (const char *law : {"coulomb", "lugre"}) {
      SCOPED_TRACE(std::string(model) + " " + law);
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, 0});
      test::set_friction(w, 0.5, law);
      test::BodyOptions o;
      o.model = model;
      o.young = 3e4;
      if (model == std::string("linear_fem")) o.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
      o.density = 5e-4 / (0.008 * 0.008 * 0.02);
      o.damping_stiffness = 2e-3;
      o.position = {-0.004, -0.004, -0.01};
      const dfm_body bar = test::make_body(context, w, "beam", {0.008, 0.008, 0.02}, 60, o);
      dfm_tool_def d = grasper(0.03);
      d.opening = 0.8;
      const dfm_tool g = make(w, d);
      double most = 0;
      for (int i = 1; i <= 450; ++i) {
        test::ok(dfm_tool_set_opening(g, std::max(0.8 - 0.002 * i, 0.0)));
        ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
        most = std::max(most, test::measure(bar).kinetic);
      }
      EXPECT_LT(most, 1e-5) << "J";
      EXPECT_GT(test::stats(w).contacts, 0u) << "it stays between them";
      EXPECT_EQ(test::stats(w).unconverged, 0u);
    }
}

// Bristles: below the limit a ball on a slab gives way as a spring of sigma0 times one square centimeter, and
// comes back.
TEST(ToolLift, ALawWithMemory_IsASpring) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::ok(test::add_friction(w, "elastoplastic", {{"mu", 0.5}, {"sigma0", 1e7}}));
  dfm_tool_def d = table();
  make(w, d);
  d = dfm_tool_def_default();
  d.name = "ball";
  d.pose = pose({0, 0, 0.0055});
  d.stiffness = 500;
  d.turn_stiffness = 10;
  d.damping = 2 * std::sqrt(d.stiffness * d.mass);
  d.turn_damping = 2 * std::sqrt(d.turn_stiffness * d.inertia);
  const dfm_tool ball = make(w, d);
  const auto go = [&](double x, double z) {
    const dfm_pose to = pose({x, 0, z});
    for (int i = 0; i < 400; ++i) {
      test::ok(dfm_tool_set_pose(ball, &to, nullptr));
      test::ok(dfm_world_step(w, 1e-3, nullptr));
    }
    return state(ball).pose.position[0];
  };
  const double start = go(0, 0.002), way = go(1e-4, 0.002) - start;
  EXPECT_NEAR(way, 1e-4 * 500 / (500 + 1e7 * 1e-4), 0.05 * way);
  EXPECT_NEAR(go(0, 0.002), start, 0.02 * way);
}

// A finger presses a free brick on a soft block: what the finger feels the block gets, and the brick stays
// between.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolLift, ABrickBetweenAToolAndASoftBlock_HandsTheForceOn) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::set_friction(w, 0.5);
  const dfm_body block = soft_block(context, w, 20);
  test::hold_bottom(block);
  const dfm_rigid brick =
      test::create(w, {test::box("brick", {0.015, 0.015, 0.005}, 0.05, {0, 0, 0.0055})})[0];
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "finger";
  d.pose = pose({0, 0, 0.017});
  const dfm_tool finger = make(w, d);
  for (int i = 1; i <= 3000; ++i) {
    const double s = std::min(i / 1000.0, 1.0), side = 0.002 * std::min(std::max(i / 1000.0 - 1, 0.0), 1.0);
    const dfm_pose to = pose({side, 0, 0.017 - 0.006 * s});
    test::ok(dfm_tool_set_pose(finger, &to, nullptr));
    ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
  }
  double force[3], torque[3];
  test::ok(dfm_tool_force(finger, force, torque));
  const dfm_rigid_state s = test::state(brick);
  EXPECT_GT(force[2], 1);
  EXPECT_LT(force[0], -0.05) << "it is held back sideways";
  EXPECT_NEAR(s.position[0], 0.002, 3e-4) << "carried along by friction";
  EXPECT_LT(std::fabs(s.velocity[0]) + std::fabs(s.velocity[2]), 1e-4);
}

// The list of pairs is made anew after a restore: how long it is shows in no snapshot.
TEST(ToolLift, SnapshotOfABrickBetweenAToolAndASoftBlock_GoesOnToTheSameBytes) {
  const auto made = [](dfm_context *c) {
    const dfm_world w = test::make_world(c);
    test::set_friction(w, 0.4);
    test::add_plane(w, "floor", {0, 0, -0.04});
    soft_block(c, w, 5);
    test::create(w, {test::box("brick", {0.015, 0.015, 0.005}, 0.05, {0, 0, 0.0055})});
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "finger";
    d.pose = pose({0, 0, 0.017});
    const dfm_pose to = pose({0.002, 0, 0.011});
    test::ok(dfm_tool_set_pose(make(w, d), &to, nullptr));
    return w;
  };
  const auto go = [](dfm_world w, int n) {
    for (int i = 0; i < n; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
  };
  test::Context context;
  const dfm_world w = made(context), other = made(context);
  go(w, 5);
  const std::string half = test::snapshot(w);
  go(w, 60);
  EXPECT_GT(test::stats(w).pairs_tested, 0u);
  const std::string end = test::snapshot(w);
  for (const dfm_world again : {w, other}) {
    test::ok(dfm_world_restore(again, half.data(), half.size()));
    EXPECT_TRUE(test::snapshot(again) == half);
    go(again, 60);
    EXPECT_TRUE(test::snapshot(again) == end);
  }
}
