// Tools that touch each other and rigid bodies: forces, both momenta, energy, and no way through.
#include <span>

#include "tool.h"

namespace {

using namespace test::tools;
using test::Vec;

struct Spring { double way, turn, damping; };  // N/m, N m/rad, of the critical one

constexpr uint32_t kShapes[] = {DFM_TOOL_SPHERE,    DFM_TOOL_CAPSULE, DFM_TOOL_BOX,     DFM_TOOL_MESH,
                                DFM_TOOL_ELLIPSOID, DFM_TOOL_BLADE,   DFM_TOOL_GRASPER, DFM_TOOL_SCISSORS};

dfm_tool_def shape_def(const char *name, uint32_t shape, dfm_pose at, Spring spring = {500, 0.2, 1}) {
  static const BoxMesh mesh({0.012, 0.015, 0.02});
  dfm_tool_def d = dfm_tool_def_default();
  d.name = name;
  d.shape = shape;
  d.pose = at;
  d.radius = 0.01;
  d.half_length = 0.02;
  d.half_size[0] = 0.012;
  d.half_size[1] = 0.015;
  d.half_size[2] = 0.02;
  if (shape == DFM_TOOL_MESH) mesh.put(d);
  d.stiffness = spring.way;
  d.turn_stiffness = spring.turn;
  d.damping = 2 * spring.damping * std::sqrt(spring.way * d.mass);
  d.turn_damping = 2 * spring.damping * std::sqrt(spring.turn * d.inertia);
  return d;
}

// What acts on the tool, about the world's origin.
struct Felt { Vec force, torque; };
Felt felt(dfm_tool t) {
  double force[3], torque[3];
  test::ok(dfm_tool_force(t, force, torque));
  const dfm_tool_state s = state(t);
  const Vec f = rotate(s.pose.rotation, test::vec(force)), own = rotate(s.pose.rotation, test::vec(torque));
  const Vec arm = cross(test::vec(s.pose.position), f);
  return {f, {own[0] + arm[0], own[1] + arm[1], own[2] + arm[2]}};
}

}  // namespace

// Two balls whose devices go 4 mm into each other stand apart by the contact offset, each spring half as far
// out, and each feels the other.
TEST(ToolTouch, TwoCoupledBalls_ShareTheWay) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const dfm_tool a = make(w, shape_def("a", DFM_TOOL_SPHERE, pose({-0.012, 0, 0}))),
                 b = make(w, shape_def("b", DFM_TOOL_SPHERE, pose({0.012, 0, 0})));
  const dfm_pose to_a = pose({-0.008, 0, 0}), to_b = pose({0.008, 0, 0});
  for (int i = 0; i < 300; ++i) {
    test::ok(dfm_tool_set_pose(a, &to_a, nullptr));
    test::ok(dfm_tool_set_pose(b, &to_b, nullptr));
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    EXPECT_GT(state(b).pose.position[0] - state(a).pose.position[0], 0.02 - 1e-12);
  }
  const double apart = state(b).pose.position[0] - state(a).pose.position[0];
  EXPECT_LT(apart, 0.0205);
  const double force = 500 * 0.5 * (apart - 0.016);
  EXPECT_NEAR(felt(a).force[0], -force, 1e-9 * force);
  EXPECT_NEAR(felt(b).force[0], force, 1e-9 * force);
  double hand[3], turn[3];
  test::ok(dfm_tool_feedback(a, hand, turn));
  EXPECT_NEAR(hand[0], -force, 1e-6 * force) << "the hand at it feels the same";
}

// Tools of every shape, pressed at each other askew while one turns: both momenta are kept, and no tool
// goes through the other.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolTouch, BothMomenta_AreKept) {
  for (const uint32_t first : kShapes)
    for (const uint32_t second : kShapes)
      for (const double dt : {1e-3, 1.0 / 60}) {
        SCOPED_TRACE(std::to_string(first) + " on " + std::to_string(second) + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0});
        const dfm_tool a = make(w, shape_def("a", first, pose({-0.035, 0.003, 0.002}, {1, 2, 0}, 0.4))),
                       b = make(w, shape_def("b", second, pose({0.035, 0, 0}, {0, 1, 1}, 1.1)));
        double scale = 0;
        for (int i = 1; i <= int(0.5 / dt); ++i) {
          const double s = std::min(i * dt / 0.3, 1.0);
          const dfm_pose to_a = pose({-0.035 + 0.03 * s, 0.003, 0.002}, {1, 2, 0}, 0.4 + 0.8 * s),
                         to_b = pose({0.035 - 0.03 * s, 0, 0}, {0, 1, 1}, 1.1);
          test::ok(dfm_tool_set_pose(a, &to_a, nullptr));
          test::ok(dfm_tool_set_pose(b, &to_b, nullptr));
          test::ok(dfm_world_step(w, dt, nullptr));
          const Felt on_a = felt(a), on_b = felt(b);
          scale = std::max(scale, test::norm(on_a.force));
          for (size_t k = 0; k < 3; ++k) {
            ASSERT_NEAR(on_a.force[k], -on_b.force[k], 1e-12 * scale);
            ASSERT_NEAR(on_a.torque[k], -on_b.torque[k], 1e-12 * 0.1 * scale);
          }
        }
        EXPECT_GT(scale, 0.5) << "they have met";
        EXPECT_LT(state(a).pose.position[0], state(b).pose.position[0] - 0.015) << "none is through";
      }
}

// Undamped springs throw tools at each other for a second: the energy of both never rises once the hands
// rest. Not of jaws, whose springs hold energy, too.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolTouch, Energy_NeverRises) {
  for (const uint32_t shape : std::span(kShapes).first(6))
    for (const double dt : {2e-4, 2e-3}) {
      SCOPED_TRACE(std::to_string(shape) + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, 0});
      const dfm_tool a = make(w, shape_def("a", shape, pose({-0.035, 0.003, 0.002}), {200, 0.1, 0})),
                     b = make(
                         w, shape_def("b", DFM_TOOL_BOX, pose({0.03, 0, 0}, {0, 1, 1}, 0.7), {300, 0.1, 0}));
      const dfm_pose to = pose({0.01, 0.003, 0.002});
      test::ok(dfm_tool_set_pose(a, &to, nullptr));
      test::ok(dfm_world_step(w, dt, nullptr));
      double before = tool_energy(a) + tool_energy(b), pushed = 0;
      const double first = before;
      for (int i = 0; i < int(1 / dt); ++i) {
        test::ok(dfm_world_step(w, dt, nullptr));
        const double now = tool_energy(a) + tool_energy(b);
        ASSERT_LT(now, before + 1e-9 * first) << i;
        before = now;
        pushed = std::max(pushed, test::norm(felt(b).force));
      }
      EXPECT_GT(pushed, 0.1) << "they have met";
    }
}

// A tool without a coupling is driven: it pushes one that has one, feels it, and passes another driven one.
TEST(ToolTouch, ADrivenTool_PushesACoupledOneAndPassesADrivenOne) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  dfm_tool_def d = shape_def("driven", DFM_TOOL_CAPSULE, pose({0, 0, 0.05}));
  d.stiffness = d.damping = d.turn_stiffness = d.turn_damping = 0;
  const dfm_tool driven = make(w, d);
  const dfm_tool coupled = make(w, shape_def("coupled", DFM_TOOL_SPHERE, pose({0, 0, 0})));
  d.name = "other";
  d.pose = pose({0.05, 0, 0});
  const dfm_tool other = make(w, d);
  for (int i = 1; i <= 200; ++i) {
    const dfm_pose to = pose({0, 0, 0.05 - 0.02 * i / 200}), through = pose({0.05 - 0.05 * i / 200, 0, 0.06});
    test::ok(dfm_tool_set_pose(driven, &to, nullptr));
    test::ok(dfm_tool_set_pose(other, &through, nullptr));
    test::ok(dfm_world_step(w, 1e-3, nullptr));
  }
  const double lower = state(driven).pose.position[2] - 0.03;  // of its lower cap
  EXPECT_NEAR(state(driven).pose.position[2], 0.03, 1e-12);
  EXPECT_LT(state(coupled).pose.position[2], lower - 0.01 + 1e-12);
  EXPECT_GT(felt(driven).force[2], 1);
  EXPECT_NEAR(felt(driven).force[2], -felt(coupled).force[2], 1e-12);
  EXPECT_EQ(test::norm(felt(other).force), 0);
  // filters count
  test::ok(dfm_tool_destroy(other));
  dfm_tool_def apart = shape_def("apart", DFM_TOOL_SPHERE, pose({0.005, 0, 0}));
  apart.collides_with = 0;
  const dfm_tool free = make(w, apart);
  for (int i = 0; i < 50; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(test::norm(felt(free).force), 0);
}

// A coupled tool pushes a free rigid body. A block lies below two tools that touch each other, too: what it
// gets is what tools gave, without what they gave each other.
TEST(ToolTouch, RigidAndSoftBodiesBeside_GetTheirShare) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::set_friction(w, 0.4);
  const dfm_body block = soft_block(context, w);
  dfm_rigid_def brick = test::box("brick", {0.02, 0.02, 0.02}, 0.1, {0, 0.06, 0.05});
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &brick, nullptr, nullptr};
  dfm_rigid stone = 0;
  test::ok(dfm_rigid_create(w, nullptr, &set, &stone));
  const dfm_tool a = make(w, shape_def("a", DFM_TOOL_SPHERE, pose({-0.0115, 0, 0.012}))),
                 b = make(w, shape_def("b", DFM_TOOL_SPHERE, pose({0.0115, 0, 0.012}))),
                 c = make(w, shape_def("c", DFM_TOOL_SPHERE, pose({0, 0.03, 0.055})));
  dfm_body_measure before = test::measure(block);
  double scale = 0, met = 0;
  for (int i = 1; i <= 200; ++i) {
    const double s = i / 200.0;
    const dfm_pose to_a = pose({-0.0115 + 4e-3 * s, 0, 0.012 - 5e-3 * s}),
                   to_b = pose({0.0115 - 4e-3 * s, 0, 0.012 - 5e-3 * s}),
                   to_c = pose({0, 0.03 + 0.02 * s, 0.055});
    test::ok(dfm_tool_set_pose(a, &to_a, nullptr));
    test::ok(dfm_tool_set_pose(b, &to_b, nullptr));
    test::ok(dfm_tool_set_pose(c, &to_c, nullptr));
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    const dfm_body_measure after = test::measure(block);
    const Felt on_a = felt(a), on_b = felt(b);
    scale = std::max(scale, test::norm(on_a.force));
    met = std::max(met, -on_a.force[0]);
    for (size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(after.momentum[k] - before.momentum[k], -1e-3 * (on_a.force[k] + on_b.force[k]),
                  1e-15 * scale + 1e-18)
          << i;
    before = after;
    EXPECT_GT(state(b).pose.position[0] - state(a).pose.position[0], 0.02 - 1e-4);
  }
  EXPECT_GT(met, 0.2) << "the two balls press each other";
  const dfm_body_measure m = [&] {
    dfm_body_measure out{};
    out.size = sizeof out;
    test::ok(dfm_rigid_get_measure(stone, &out));
    return out;
  }();
  EXPECT_GT(m.momentum[1], 1e-3) << "the brick was pushed";
}
