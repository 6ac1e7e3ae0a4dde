// Coupled tools against what stands or goes its way: they stop on it, the hand feels it, with friction and
// without energy of its own.
#include <random>

#include "logged_context.h"
#include "obstacle.h"
#include "tool.h"

namespace {

using namespace test::tools;
using test::Vec;

constexpr double kStiff = 500, kHalfSize[3] = {0.012, 0.015, 0.02};

struct Shape {
  const char *name;
  uint32_t shape;
  double below;  // m, of its lowest place from its origin
};
constexpr Shape kShapes[] = {
    {"sphere", DFM_TOOL_SPHERE, 0.01},
    {"capsule", DFM_TOOL_CAPSULE, 0.03},
    {"box", DFM_TOOL_BOX, 0.02},
    {"mesh", DFM_TOOL_MESH, 0.02},
    {"ellipsoid", DFM_TOOL_ELLIPSOID, 0.02},
    {"blade", DFM_TOOL_BLADE, 0.02},
    {"grasper", DFM_TOOL_GRASPER, 0.04},
    {"scissors", DFM_TOOL_SCISSORS, 0.04},
};
bool jaws(const Shape &s) { return s.shape == DFM_TOOL_GRASPER || s.shape == DFM_TOOL_SCISSORS; }

const test::tools::BoxMesh &box_mesh() {
  static const BoxMesh mesh({kHalfSize[0], kHalfSize[1], kHalfSize[2]});
  return mesh;
}

dfm_tool_def def_of(const Shape &shape, Vec at, double critical = 1) {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = shape.name;
  d.shape = shape.shape;
  d.pose = pose(at);
  d.radius = jaws(shape) ? 0 : 0.01;
  d.half_length = 0.02;
  for (int k = 0; k < 3; ++k) d.half_size[k] = kHalfSize[k];
  if (shape.shape == DFM_TOOL_MESH) box_mesh().put(d);
  d.stiffness = kStiff;
  d.turn_stiffness = 0.2;
  d.damping = 2 * critical * std::sqrt(d.stiffness * d.mass);
  d.turn_damping = 2 * critical * std::sqrt(d.turn_stiffness * d.inertia);
  return d;
}

// The top of each is at z = 0.
const char *const kFloors[] = {"plane", "box", "sphere", "capsule", "mesh", "sheet", "voxels", "fixed"};

void put_floor(dfm_world w, const std::string &kind) {
  const Vec half = {0.3, 0.3, 0.05};
  dfm_obstacle_def d = dfm_obstacle_def_default();
  const test::Triangles slab = test::box_surface(half, 5),
                        sheet = test::height_field(0.3, 9, [](double, double) { return 0.0; });
  if (kind == "fixed") {
    dfm_rigid_def r = test::box("floor", half, 1, {0, 0, -half[2]});
    r.fixed = 1;
    test::create(w, {r});
    return;
  }
  if (kind == "mesh") d = test::mesh_def("floor", slab);
  if (kind == "sheet") d = test::mesh_def("floor", sheet);
  if (kind == "voxels") d = test::mesh_def("floor", slab, DFM_SHAPE_VOXELS);
  d.cells = 20000;
  d.name = "floor";
  if (kind == "plane") d.shape = DFM_SHAPE_PLANE;
  if (kind == "box") d.shape = DFM_SHAPE_BOX;
  if (kind == "sphere") d.shape = DFM_SHAPE_SPHERE;
  if (kind == "capsule") d.shape = DFM_SHAPE_CAPSULE;
  std::copy(half.begin(), half.end(), d.half_size);
  d.radius = 0.1;
  d.half_length = 0.2;
  const bool round = kind == "sphere" || kind == "capsule", flat = kind == "plane" || kind == "sheet";
  const double lies = kind == "capsule" ? std::acos(0.0) : 0;
  d.pose = pose({0, 0, flat ? 0 : round ? -0.1 : -half[2]}, {1, 0, 0}, lies);
  dfm_obstacle out = 0;
  test::ok(dfm_obstacle_create(w, &d, &out));
}

void step_to(dfm_world w, dfm_tool t, const dfm_pose &p, double dt) {
  test::ok(dfm_tool_set_pose(t, &p, nullptr));
  ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
}

Vec fed_back(dfm_tool t) {
  double force[3], torque[3];
  test::ok(dfm_tool_feedback(t, force, torque));
  return rotate(state(t).device.rotation, test::vec(force));
}

// m, of its origin and of what is 5 cm from it
double moved(const dfm_tool_state &a, const dfm_tool_state &b) {
  double turn = 0;
  for (size_t k = 0; k < 4; ++k) turn = std::max(turn, std::fabs(a.pose.rotation[k] - b.pose.rotation[k]));
  return test::apart(test::vec(a.pose.position), test::vec(b.pose.position)) + 0.1 * turn;
}

}  // namespace

// A device goes 1 cm into the floor. The tool stops at its surface, the hand feels the spring, and nothing
// creeps.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolObstacle, PressedDown_EachShapeStopsOnEachFloor) {
  for (const char *const floor : kFloors)
    for (const Shape &shape : kShapes)
      for (const double dt : {1e-3, 1.0 / 60}) {
        SCOPED_TRACE(std::string(shape.name) + " on " + floor + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0});
        test::set_friction(w, 0.5);
        put_floor(w, floor);
        const Vec at = {0.003, 0.002, shape.below + 0.004};
        const dfm_tool t = make(w, def_of(shape, at));
        dfm_pose to = pose(at);
        for (int i = 1; i <= std::lround(1 / dt); ++i) {
          to.position[2] = at[2] - 0.014 * std::min(i * dt / 0.2, 1.0);
          step_to(w, t, to, dt);
        }
        const dfm_tool_state rests = state(t);
        const double way = rests.pose.position[2] - to.position[2];
        EXPECT_NEAR(way, 0.01, 2e-3);
        const Vec force = force_on(t), felt = fed_back(t);
        EXPECT_NEAR(force[2], kStiff * way, 1e-9 * kStiff * way);
        EXPECT_NEAR(felt[2], force[2], 1e-9 * force[2]);
        for (int i = 0; i < std::lround(2 / dt); ++i) step_to(w, t, to, dt);
        EXPECT_LT(moved(state(t), rests), 1e-9);
      }
}

// A device that jitters throws an undamped tool at a plane and at triangles, with friction: what the tool and
// its spring have, less what the hand has put in, never rises by more than rounding.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolObstacle, AJitteringDevice_MakesNoEnergy) {
  for (const char *const floor : {"plane", "mesh", "sheet"})
    for (const Shape &shape : kShapes)
      for (const double dt : {1e-3, 1.0 / 240}) {
        if (jaws(shape)) continue;  // their springs have energy of their own
        SCOPED_TRACE(std::string(shape.name) + " on " + floor + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0});
        test::set_friction(w, 0.5);
        put_floor(w, floor);
        const Vec at = {0.003, 0.002, shape.below + 0.01};
        const dfm_tool t = make(w, def_of(shape, at, 0));
        std::mt19937 random(7);
        std::uniform_real_distribution<double> any(-1, 1);
        double before = 0, most = 0, met = 0, rise = 0;
        for (int i = 1; i <= std::lround(1 / dt); ++i) {
          const Vec axis = {any(random), any(random), 1};
          const double down = 0.015 * std::min(i * dt / 0.2, 1.0);
          const dfm_pose to = pose({at[0] + 1e-3 * any(random), at[1] + 0.05 * std::sin(3 * i * dt),
                                    at[2] - down + 1e-3 * any(random)},
                                   axis, 0.1 * any(random));
          if (any(random) > -0.4) test::ok(dfm_tool_set_pose(t, &to, nullptr));  // 30 % are lost
          ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
          const double has = tool_energy(t), net = has - state(t).work;
          most = std::max(most, has);
          rise = std::max(rise, net - before);
          before = net;
          met = std::max(met, test::norm(force_on(t)));
        }
        EXPECT_LT(rise, 1e-9 * most);
        EXPECT_GT(met, 0.5);
      }
}

// Drawn aside, the tool slides under mu N; within the cone it stays where it is.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolObstacle, DrawnAside_FrictionIsThatOfThePair) {
  for (const char *const floor : {"plane", "box", "mesh", "sheet"})
    for (const Shape &shape : kShapes) {
      SCOPED_TRACE(std::string(shape.name) + " on " + floor);
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, 0});
      test::set_friction(w, 0.4);
      put_floor(w, floor);
      const Vec at = {0.003, 0.002, shape.below};
      dfm_tool_def d = def_of(shape, at);
      d.turn_stiffness = 2;  // upright under what draws it
      d.turn_damping = 2 * std::sqrt(d.turn_stiffness * d.inertia);
      const dfm_tool t = make(w, d);
      dfm_pose to = pose({at[0], at[1], at[2] - 0.01});
      for (int i = 0; i < 500; ++i) step_to(w, t, to, 1e-3);
      for (int i = 0; i < 500; ++i) {
        to.position[1] = at[1] + 1e-3 * std::min(i / 300.0, 1.0);
        step_to(w, t, to, 1e-3);
      }
      const dfm_tool_state held = state(t);
      const double way = 1e-3 + at[1] - held.pose.position[1];  // what is round rolls a little
      EXPECT_NEAR(force_on(t)[1], -kStiff * way, 1e-9);
      EXPECT_GT(way, 7e-4) << "held by the floor";
      for (int i = 0; i < 500; ++i) step_to(w, t, to, 1e-3);
      EXPECT_LT(moved(state(t), held), 1e-9);
      for (int i = 0; i < 600; ++i) {
        to.position[1] = at[1] + 1e-3 + 5e-5 * i;
        step_to(w, t, to, 1e-3);
      }
      const Vec force = force_on(t);
      EXPECT_NEAR(force[1], -0.4 * force[2], 0.02 * force[2]);
      EXPECT_GT(state(t).pose.position[1], 0.015);
    }
}

// A driven tool goes where it is told, through a floor too: one sentence says so. One that was put into the
// floor is told of as well, and filters count.
TEST(ToolObstacle, WhatIsInAFloor_IsReportedOnce) {
  for (const char *const floor : {"plane", "box", "mesh", "voxels"}) {
    SCOPED_TRACE(floor);
    test::LoggedContext context;
    const dfm_world w = test::make_world(context.context, {0, 0, 0});
    put_floor(w, floor);
    dfm_tool_def d = def_of(kShapes[2], {0, 0, 0.03});
    d.stiffness = d.damping = d.turn_stiffness = d.turn_damping = 0;
    d.name = "driven";
    const dfm_tool driven = make(w, d);
    for (int i = 0; i < 200; ++i) step_to(w, driven, pose({0, 0, 0.03 - 1e-4 * i}), 1e-3);
    const size_t first = context.log.find("tool 'driven' is "), put = context.log.find("'inside' is ");
    EXPECT_NE(first, std::string::npos) << context.log;
    EXPECT_EQ(context.log.find("tool 'driven' is ", first + 1), std::string::npos) << context.log;
    EXPECT_NE(context.log.find("deep in 'floor'"), std::string::npos) << context.log;
    EXPECT_EQ(force_on(driven)[2], 0);
    EXPECT_NEAR(state(driven).pose.position[2], 0.03 - 0.0199, 1e-12);
    EXPECT_EQ(put, std::string::npos);
    d = def_of(kShapes[2], {0.1, 0, 0.015});
    d.name = "inside";
    const dfm_tool inside = make(w, d);
    d = def_of(kShapes[0], {0.2, 0, 0.1});
    d.name = "apart";
    d.collides_with = 0;
    const dfm_tool apart = make(w, d);
    for (int i = 0; i < 50; ++i) step_to(w, apart, pose({0.2, 0, -0.01}), 1e-3);
    const size_t second = context.log.find("'inside' is ");
    const bool hollow = floor == std::string("mesh");
    EXPECT_TRUE(hollow || second != std::string::npos) << context.log;
    EXPECT_EQ(context.log.find("'inside' is ", second + 1), std::string::npos) << context.log;
    EXPECT_EQ(context.log.find("'apart'"), std::string::npos) << context.log;
    EXPECT_LT(state(apart).pose.position[2], 0.05);
    EXPECT_GT(state(inside).pose.position[2], 0.015 - 1e-12);
  }
}

// A snapshot of a tool that slides with a law that has memory continues to the same bytes.
TEST(ToolObstacle, Snapshot_GoesOnToTheSameBits) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::set_friction(w, 0.4);
  put_floor(w, "mesh");
  const Vec at = {0.003, 0.002, 0.02};
  const dfm_tool t = make(w, def_of(kShapes[2], at));
  const auto go = [&](int from, int to) {
    for (int i = from; i < to; ++i) step_to(w, t, pose({at[0], at[1] + 4e-5 * i, at[2] - 0.01}), 1e-3);
  };
  go(0, 300);
  const std::string saved = test::snapshot(w);
  go(300, 500);
  const uint64_t hash = dfm_world_hash(w);
  test::ok(dfm_world_restore(w, saved.data(), saved.size()));
  go(300, 500);
  EXPECT_EQ(dfm_world_hash(w), hash);
}

// A soft block between the tool and the floor, and the tool beside it on the floor: both bear.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolObstacle, ABlockBeside_BearsItsShare) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::set_friction(w, 0.4);
  const dfm_body block = soft_block(context, w, 5);
  test::hold_bottom(block);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "step";
  d.shape = DFM_SHAPE_BOX;
  d.half_size[0] = d.half_size[1] = d.half_size[2] = 0.02;
  d.pose.position[0] = 0.045;
  d.pose.position[2] = -0.025;
  dfm_obstacle step = 0;
  test::ok(dfm_obstacle_create(w, &d, &step));
  dfm_tool_def of = def_of(kShapes[2], {0.015, 0, 0.021});
  of.half_size[0] = 0.03;
  const dfm_tool t = make(w, of);
  for (int i = 0; i < 1500; ++i) {
    step_to(w, t, pose({0.015, 0, 0.021 - 0.016 * std::min(i / 500.0, 1.0)}), 1e-3);
    ASSERT_GT(state(t).pose.position[2], 0.01);
  }
  const Vec force = force_on(t);
  const double way = state(t).pose.position[2] - 0.005;
  EXPECT_NEAR(force[2], kStiff * way, 1e-3 * kStiff * way);
  const dfm_body_measure m = test::measure(block);
  EXPECT_LT(m.contact_impulse[2], 0) << "the block bears a part";
}
