// Bodies with joints and motors of the builtin host on obstacles, on each other and on free bodies.
#include "logged_context.h"
#include "obstacle.h"
#include "tool.h"

namespace {

using namespace test::tools;
using test::go;
using test::Vec;

constexpr double kG = 9.81;
constexpr double kStep[] = {1e-3, 1.0 / 60};

dfm_obstacle add_box(dfm_world w, const char *name, Vec half, Vec at) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name;
  d.shape = DFM_SHAPE_BOX;
  for (size_t k = 0; k < 3; ++k) {
    d.half_size[k] = half[k];
    d.pose.position[k] = at[k];
  }
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

dfm_rigid_def ball(const char *name, double radius, double mass, Vec at) {
  dfm_rigid_def d = test::box(name, {}, mass, at);
  d.shape = DFM_SHAPE_SPHERE;
  d.radius = radius;
  return d;
}

// J
double energy(const std::vector<dfm_rigid> &bodies) {
  double sum = 0;
  for (const dfm_rigid r : bodies) {
    const dfm_body_measure m = test::rigid_measure(r);
    sum += m.kinetic + m.mass * kG * m.com[2];
  }
  return sum;
}

// Largest coordinate `axis` of the corners of a box.
double farthest(const dfm_rigid_state &s, Vec half, Vec along) {
  double far = -1e9;
  for (int k = 0; k < 8; ++k) {
    const Vec arm = rotate(
        s.rotation, {k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1], k & 4 ? half[2] : -half[2]});
    far = std::max(far, test::dot(test::vec(s.position), along) + test::dot(arm, along));
  }
  return far;
}

// A frame of two balls on a rod, each fixed to it.
std::vector<dfm_rigid> add_dumbbell(dfm_world w, const std::string &name, Vec at, uint32_t type) {
  const std::string names[] = {name + ".rod", name + ".left", name + ".right"};
  const Vec left = {at[0], at[1] - 0.1, at[2]}, right = {at[0], at[1] + 0.1, at[2]};
  return test::create(w,
                      {test::box(names[0].c_str(), {0.01, 0.08, 0.01}, 0.3, at),
                       ball(names[1].c_str(), 0.04, 0.5, left), ball(names[2].c_str(), 0.03, 0.4, right)},
                      {test::joint(type, 1, 0, left, {0, 1, 0}), test::joint(type, 2, 0, right, {0, 1, 0})});
}

void move(const std::vector<dfm_rigid> &bodies, Vec velocity) {
  for (const dfm_rigid r : bodies) {
    dfm_rigid_state s = test::state(r);
    std::copy(velocity.begin(), velocity.end(), s.velocity);
    test::ok(dfm_rigid_set_state(r, &s));
  }
}

// N, of contact along the normals.
double pressed(dfm_world w) {
  uint32_t n = 0;
  test::ok(dfm_world_pairs(w, 0, nullptr, &n));
  std::vector<dfm_pair_report> pairs(n);
  for (dfm_pair_report &p : pairs) p.size = sizeof p;
  test::ok(dfm_world_pairs(w, n, pairs.data(), &n));
  double sum = 0;
  for (const dfm_pair_report &p : pairs) sum += p.normal;
  return sum;
}

struct Car {
  std::vector<dfm_rigid> body;  // chassis, wheels
  explicit Car(dfm_world w, double height = 1e-6) {
    std::vector<dfm_rigid_def> bodies = {test::box("chassis", {0.2, 0.1, 0.03}, 5, {0, 0, 0.1 + height})};
    std::vector<dfm_joint_def> joints;
    const char *const names[] = {"wheel1", "wheel2", "wheel3", "wheel4"};
    for (uint32_t i = 0; i < 4; ++i) {
      const Vec at = {i & 1 ? 0.15 : -0.15, i & 2 ? 0.14 : -0.14, 0.05 + height};
      bodies.push_back(ball(names[i], 0.05, 0.5, at));
      joints.push_back(test::joint(DFM_JOINT_HINGE, i + 1, 0, at, {0, 1, 0}));
    }
    body = test::create(w, bodies, joints);
  }
  void drive(double speed, double most) const {
    for (uint32_t i = 0; i < 4; ++i) test::ok(dfm_rigid_set_motor(body[0], i, speed, most));
  }
  dfm_rigid_state state() const { return test::state(body[0]); }
};

}  // namespace

// Two links swing against a wall: no corner goes into it, and they make no energy. A pendulum in free flight
// keeps its mean energy, which oscillates with the step.
TEST(RigidJoints, APendulum_StaysBeforeAWall) {
  const Vec half = {0.02, 0.015, 0.15};
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    add_box(w, "wall", {0.1, 0.5, 1}, {0.2, 0, 0});  // its face is at x = 0.1
    const auto links = test::create(
        w, {test::box("upper", half, 1, {0, 0, -0.15}), test::box("lower", half, 0.5, {0, 0, -0.45})},
        {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 1, 0}),
         test::joint(DFM_JOINT_HINGE, 1, 0, {0, 0, -0.3}, {0, 1, 0})});
    for (const size_t i : {0, 1}) {  // swung out by 1 rad, away from the wall
      dfm_rigid_state s = test::state(links[i]);
      const double far = 0.15 + 0.3 * double(i);
      const dfm_pose p = pose({-std::sin(1.0) * far, 0, -std::cos(1.0) * far}, {0, 1, 0}, 1.0);
      std::copy_n(p.position, 3, s.position);
      std::copy_n(p.rotation, 4, s.rotation);
      test::ok(dfm_rigid_set_state(links[i], &s));
    }
    const double start = energy(links);
    double deepest = -1, most = 0;
    int hits = 0;
    for (int i = 0; i * dt < 4; ++i) {
      ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
      for (const dfm_rigid r : links)
        deepest = std::max(deepest, farthest(test::state(r), half, {1, 0, 0}) - 0.1);
      most = std::max(most, energy(links) - start);
      hits += pressed(w) > 0;
    }
    EXPECT_LT(deepest, 1e-6);
    EXPECT_GT(deepest, -1e-4) << "it has not been there";
    EXPECT_LT(most, dt);
    EXPECT_LT(energy(links), start - 1) << "hits take energy";
    EXPECT_GT(hits, 10);
  }
}

// A car stands on a floor without creep. Driven, its wheels do not slip; at a wall it stops.
TEST(RigidJoints, ACar_StandsAndDrivesAndStopsAtAWall) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::set_friction(w, 0.5);
    test::add_plane(w, "floor");
    const Car car(w);
    go(w, dt, 0.5);
    const dfm_rigid_state was = car.state();
    EXPECT_NEAR(pressed(w), 7 * kG, 1e-6 * 7 * kG);
    go(w, dt, 2);
    const dfm_rigid_state rest = car.state();
    EXPECT_LT(test::apart(test::vec(was.position), test::vec(rest.position)), 1e-12);
    car.drive(4, 2);
    go(w, dt, 1);
    EXPECT_NEAR(car.state().velocity[0], 4 * 0.05, 1e-5);
    EXPECT_NEAR(car.state().position[2], rest.position[2], 1e-9);
    const double face = car.state().position[0] + 0.3;
    add_box(w, "wall", {0.1, 1, 1}, {face + 0.1, 0, 0});
    go(w, dt, 1.5);
    const dfm_rigid_state now = car.state();
    EXPECT_NEAR(now.position[0] + 0.2, face - 1e-6, 1e-8);
    EXPECT_LT(test::norm(test::vec(now.velocity)), 1e-9);
    EXPECT_NEAR(now.position[2], rest.position[2], 1e-6);
  }
}

// A car rolls down a slope with g sin a, less what its wheels take to turn: m g sin a / (m + 4 I / r^2).
TEST(RigidJoints, ACar_RollsDown) {
  const double a = 0.2;
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {kG * std::sin(a), 0, -kG * std::cos(a)});
    test::set_friction(w, 0.8);
    test::add_plane(w, "floor");
    const Car car(w);
    go(w, dt, 1);
    EXPECT_NEAR(car.state().velocity[0], kG * std::sin(a) * 7 / (7 + 4 * 0.4 * 0.5), 2e-3);
  }
}

// A chain that falls over a post: no link goes into it or into the floor.
TEST(RigidJoints, AChain_LiesOnAPost) {
  constexpr uint32_t kLinks = 8;
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::set_friction(w, 0.5);
    test::add_plane(w, "floor");
    add_box(w, "post", {0.05, 0.05, 0.04}, {0, 0, 0.04});
    std::vector<dfm_rigid_def> bodies;
    std::vector<dfm_joint_def> joints;
    std::string names[kLinks];
    for (uint32_t i = 0; i < kLinks; ++i) {
      names[i] = "link" + std::to_string(i);
      dfm_rigid_def d = test::box(names[i].c_str(), {}, 0.1, {});
      d.shape = DFM_SHAPE_CAPSULE;
      d.radius = 0.01;
      d.half_length = 0.02;
      d.pose = pose({-0.175 + 0.05 * i, 0.01, 0.13}, {0, 1, 0}, std::acos(0.0));
      bodies.push_back(d);
      if (i > 0) joints.push_back(test::joint(DFM_JOINT_BALL, i, i - 1, {-0.2 + 0.05 * i, 0.01, 0.13}));
    }
    const auto chain = test::create(w, bodies, joints);
    const double start = energy(chain);
    double low = 1, most = 0, inside = 1;
    for (int i = 0; i * dt < 1; ++i) {
      ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
      for (const dfm_rigid r : chain) {
        const dfm_rigid_state s = test::state(r);
        const Vec end = rotate(s.rotation, {0, 0, 0.02});
        for (const double side : {-1.0, 1.0}) {
          const Vec p = {s.position[0] + side * end[0], s.position[1] + side * end[1],
                         s.position[2] + side * end[2]};
          low = std::min(low, p[2] - 0.01);
          const Vec out = {std::max(0.0, std::fabs(p[0]) - 0.05), std::max(0.0, std::fabs(p[1]) - 0.05),
                           std::max(0.0, p[2] - 0.08)};
          inside = std::min(inside, test::norm(out) - 0.01);
        }
      }
      most = std::max(most, energy(chain) - start);
    }
    EXPECT_GT(low, 0.9e-6);
    EXPECT_GT(inside, -1e-6);
    EXPECT_LT(inside, 1e-5) << "it has not touched the post";
    EXPECT_LT(most, dt * dt * 100);
  }
}

// A plate on a slider, an arm on a hinge: what stops them takes their motors to the limit.
TEST(RigidJoints, Motors_PushWithTheirLimit) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    test::set_friction(w, 0);
    add_box(w, "anvil", {0.1, 0.1, 0.1}, {0, 0, -0.1});
    const auto plate =
        test::create(w, {test::box("plate", {0.05, 0.05, 0.01}, 1, {0, 0, 0.05})},
                     {test::joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 0, 1})});
    test::ok(dfm_rigid_set_motor(plate[0], 0, -0.2, 50));
    go(w, dt, 0.5);
    EXPECT_NEAR(test::state(plate[0]).position[2], 0.010001, 1e-9);
    EXPECT_NEAR(test::reading(plate[0], 0).effort, -50, 1e-6);
    EXPECT_NEAR(pressed(w), 50, 1e-6);
    test::ok(dfm_rigid_set_motor(plate[0], 0, 0.2, 50));
    go(w, dt, 0.5);
    EXPECT_NEAR(test::state(plate[0]).position[2], 0.11, 2e-3);
    EXPECT_EQ(pressed(w), 0);

    const Vec half = {0.1, 0.02, 0.02};
    const auto arm = test::create(w, {test::box("arm", half, 1, {1.1, 0, 0.3})},
                                  {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {1, 0, 0.3}, {0, 1, 0})});
    add_box(w, "block", {0.1, 0.1, 0.1}, {1.2, 0, 0.1});
    test::ok(dfm_rigid_set_motor(arm[0], 0, 1, 5));
    go(w, dt, 0.7);
    EXPECT_NEAR(farthest(test::state(arm[0]), half, {0, 0, -1}), -0.2 - 1e-6, 1e-8);
    EXPECT_NEAR(test::reading(arm[0], 0).effort, 5, 1e-6);
    const double angle = test::reading(arm[0], 0).position;
    EXPECT_NEAR(pressed(w), 5 / (0.2 * std::cos(angle) - 0.02 * std::sin(angle)), 1e-3);
    test::ok(dfm_rigid_set_motor(arm[0], 0, -1, 5));
    go(w, dt, 0.2);
    EXPECT_LT(farthest(test::state(arm[0]), half, {0, 0, -1}), -0.2 - 0.02);
  }
}

// Two dumbbells and a box meet in free flight: their momenta last. (Not beyond half a radian in a step, where
// joints are kept by position.)
TEST(RigidJoints, Momenta_Last) {
  for (const uint32_t type : {DFM_JOINT_FIXED, DFM_JOINT_BALL, DFM_JOINT_HINGE})
    for (const double dt : {1e-3, 4e-3}) {
      SCOPED_TRACE(std::to_string(type) + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, 0});
      test::set_friction(w, 0.4);
      const auto first = add_dumbbell(w, "first", {0, 0, 0}, type),
                 second = add_dumbbell(w, "second", {0.2, 0.05, 0.01}, type);
      const dfm_rigid thing =
          test::create(w, {test::box("thing", {0.05, 0.05, 0.05}, 0.5, {-0.3, -0.08, 0})})[0];
      move(second, {-1, 0, 0});
      move({thing}, {1, 0, 0.1});
      const auto all = [&] {
        test::Momenta sum;
        for (const auto &of : {first, second, {thing}})
          for (const dfm_rigid r : of) test::add(sum, test::rigid_measure(r));
        return sum;
      };
      const test::Momenta before = all();
      const double start = energy(first) + energy(second) + energy({thing});
      go(w, dt, 0.5);
      const test::Momenta after = all();
      EXPECT_LT(test::apart(before.linear, after.linear), 1e-9 * before.size);
      EXPECT_LT(test::apart(before.angular, after.angular), 1e-9 * before.size);
      EXPECT_GT(test::norm(test::vec(test::state(first[0]).velocity)), 0.1) << "nothing has met";
      EXPECT_LT(energy(first) + energy(second) + energy({thing}) - start, 0);
    }
}

// Bodies of one group touch, except those that a joint connects, and those that overlap as created.
TEST(RigidJoints, OneGroup_TouchesItself) {
  test::LoggedContext context;
  const dfm_world w = test::make_world(context.context, {0, 0, 0});
  // two fingers on one palm close on each other; the pin lies in both of them and in the palm
  const auto hand = test::create(
      w,
      {test::box("palm", {0.05, 0.02, 0.01}, 1, {}),
       test::box("left", {0.005, 0.01, 0.03}, 0.1, {-0.03, 0, 0.045}),
       test::box("right", {0.005, 0.01, 0.03}, 0.1, {0.03, 0, 0.045}), ball("pin", 0.03, 0.1, {0, 0, 0.01})},
      {test::joint(DFM_JOINT_SLIDER, 1, 0, {}, {1, 0, 0}), test::joint(DFM_JOINT_SLIDER, 2, 0, {}, {1, 0, 0}),
       test::joint(DFM_JOINT_FIXED, 3, 0, {})});
  test::ok(dfm_rigid_set_motor(hand[0], 0, 0.1, 3));
  test::ok(dfm_rigid_set_motor(hand[0], 1, -0.1, 3));
  go(w, 1e-3, 1);
  const double apart = test::state(hand[2]).position[0] - test::state(hand[1]).position[0];
  EXPECT_NEAR(apart, 0.01 + 1e-6, 1e-8);
  EXPECT_NEAR(test::reading(hand[0], 0).effort, 3, 1e-6);
  EXPECT_EQ(context.log.find("deep in"), std::string::npos) << context.log;
}

// A door whose hinge lies in its post opens; the hinge connects the two. A crate behind it stops it.
TEST(RigidJoints, ADoorInItsPost_Opens) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::LoggedContext context;
    const dfm_world w = test::make_world(context.context, {0, 0, -kG});
    add_box(w, "post", {0.03, 0.03, 0.6}, {-0.02, 0, 0.6});
    add_box(w, "stop", {0.05, 0.05, 0.2}, {0, 0.5, 0.2});
    const Vec half = {0.4, 0.02, 0.5};
    const auto door =
        test::create(w, {test::box("door", half, 10, {0.4, 0, 0.52})},
                     {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.5}, {0, 0, 1})});
    test::ok(dfm_rigid_set_motor(door[0], 0, 1, 20));
    go(w, dt, 2);
    const double angle = test::reading(door[0], 0).position;
    EXPECT_GT(angle, 1.3);
    EXPECT_LT(angle, 1.57);
    EXPECT_NEAR(test::reading(door[0], 0).effort, 20, 1e-6);
    EXPECT_EQ(context.log, "");
  }
}

// A plate that is led along the hinge of a gate, or onto a box that lies on a floor: the two have no way to
// go. The step says so, and leaves the state as it was before it.
TEST(RigidJoints, WhatCannotYieldToADrivenPlate_EndsTheRun) {
  for (const double dt : kStep)
    for (const bool hinged : {true, false}) {
      SCOPED_TRACE(std::to_string(dt) + (hinged ? " hinged" : " on a floor"));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -kG});
      const dfm_rigid_def gate = test::box("gate", {0.1, 0.02, 0.1}, 1, {0, 0, 0.11});
      const dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.11}, {0, 0, 1});
      if (!hinged) test::add_plane(w, "floor");
      add_box(w, "table", {0.2, 0.2, 0.1}, {3, 0, 0.1});
      test::create(w, {test::box("load", {0.1, 0.1, 0.1}, 500, {3, 0, 0.3})});  // which is not in the way
      const dfm_rigid body = test::create(
          w, {gate}, hinged ? std::vector<dfm_joint_def>{hinge} : std::vector<dfm_joint_def>{})[0];
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.name = "plate";
      d.shape = DFM_SHAPE_BOX;
      std::fill_n(d.half_size, 3, 0.05);
      const dfm_pose_key keys[] = {{0, pose({0, 0, 0.3})}, {1, pose({0, 0, 0.1})}};
      d.keys = keys;
      d.nkey = 2;
      dfm_obstacle plate = 0;
      test::ok(dfm_obstacle_create(w, &d, &plate));
      dfm_status status = DFM_OK;
      dfm_rigid_state before{};
      while (status == DFM_OK && dfm_world_time(w) < 1) {
        before = test::state(body);
        status = dfm_world_step(w, dt, nullptr);
      }
      EXPECT_NE(status, DFM_OK);
      const std::string told = dfm_last_error();
      EXPECT_NE(told.find("squeezed until nothing can move"), std::string::npos) << told;
      EXPECT_NE(told.find("'gate'"), std::string::npos) << told;
      EXPECT_EQ(told.find("'load'"), std::string::npos) << told;
      EXPECT_NEAR(test::state(body).position[2], 0.11, hinged ? 1e-9 : 0.011);
      dfm_pose at{};
      test::ok(dfm_obstacle_get_pose(plate, &at));
      EXPECT_GT(at.position[2] - 0.05, test::state(body).position[2] + 0.1 - 1e-4);
    }
}

// Boxes that tumble on a floor and off a turning bar are no jam, though corners move on arcs, and though an
// obstacle is driven elsewhere and beside them.
TEST(RigidJoints, WhatTumblesBesideADrivenBar_GoesOn) {
  for (const double dt : {1e-3, 0.01, 1.0 / 60}) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::add_plane(w, "floor");
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "bar";
    d.shape = DFM_SHAPE_BOX;
    d.half_size[0] = 0.5;
    d.half_size[1] = d.half_size[2] = 0.03;
    std::vector<dfm_pose_key> keys;
    for (int i = 0; i <= 40; ++i) keys.push_back({0.05 * i, pose({0, 0, 0.2}, {0, 0, 1}, 0.4 * i)});
    d.keys = keys.data();
    d.nkey = uint32_t(keys.size());
    dfm_obstacle bar = 0;
    test::ok(dfm_obstacle_create(w, &d, &bar));
    std::vector<dfm_rigid_def> boxes;
    std::vector<std::string> names;
    for (int i = 0; i < 6; ++i) names.push_back("box" + std::to_string(i));
    for (int i = 0; i < 6; ++i) {
      const double at = double(i);
      boxes.push_back(test::box(names[size_t(i)].c_str(), {0.1, 0.06, 0.03}, 1,
                                {0.3 * std::cos(at), 0.3 * std::sin(at), 0.5 + 0.2 * at}));
      boxes.back().spin[0] = 8;
      boxes.back().spin[1] = 5 - at;
    }
    test::create(w, boxes);
    for (double t = 0; t < 2; t += dt) ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
  }
}

// An arm that a motor turns until it meets a stop: a snapshot knows the motor, whatever it has become since,
// and so does a world made anew.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidJoints, Motors_ComeBackWithASnapshot) {
  struct Arm {
    test::Context context;
    dfm_world w = test::make_world(context, {0, 0, 0});
    dfm_rigid arm;
    Arm() {
      add_box(w, "stop", {0.05, 0.05, 0.1}, {0.3, 0.2, 0});
      arm = test::create(w, {test::box("arm", {0.2, 0.02, 0.02}, 1, {0.2, 0, 0})},
                         {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 0, 1})})[0];
    }
    void motor(double velocity, double max) { test::ok(dfm_rigid_set_motor(arm, 0, velocity, max)); }
    void restore(const std::string &data) { test::ok(dfm_world_restore(w, data.data(), data.size())); }
  };
  for (const double max : {50.0, 1e4}) {
    Arm a, anew;
    a.motor(1, max);
    go(a.w, 1e-3, 0.1);
    const std::string data = test::snapshot(a.w);
    go(a.w, 1e-3, 0.9);
    const uint64_t hash = dfm_world_hash(a.w);
    const double angle = test::reading(a.arm, 0).position;
    a.motor(0, 0);
    for (Arm *const b : {&a, &anew}) {
      b->restore(data);
      EXPECT_TRUE(test::snapshot(b->w) == data);
      go(b->w, 1e-3, 0.9);
      EXPECT_EQ(dfm_world_hash(b->w), hash);
      EXPECT_EQ(test::reading(b->arm, 0).position, angle);
    }
  }
}

// The rest distance of the first step is that of the bodies that the world has then: what a door hangs on is
// decided by it, and stays so.
TEST(RigidJoints, ADoorBesideItsPost_IsTheSameAfterARestore) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  add_box(w, "post", {0.03, 0.03, 0.6}, {-0.0301, 0, 0.6});
  const auto door = test::create(w, {test::box("door", {0.4, 0.02, 0.5}, 10, {0.39, 0, 0.52})},
                                 {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.5}, {0, 0, 1})});
  test::ok(dfm_rigid_set_motor(door[0], 0, 1, 20));
  test::BodyOptions o;
  o.position = {5, 0, 0};
  test::make_body(context, w, "beam", {0.4, 0.4, 0.4}, 40, o);
  go(w, 1e-3, 0.01);
  const std::string data = test::snapshot(w);
  go(w, 1e-3, 0.05);
  const uint64_t hash = dfm_world_hash(w);
  test::ok(dfm_world_restore(w, data.data(), data.size()));
  go(w, 1e-3, 0.05);
  EXPECT_EQ(dfm_world_hash(w), hash);
}

// A driven tool and a coupled one open a door, do not go into it, and feel what it is pushed with.
TEST(RigidJoints, Tools_OpenADoor) {
  for (const double stiffness : {0.0, 1000.0}) {
    SCOPED_TRACE(stiffness);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    test::set_friction(w, 0);
    const Vec half = {0.2, 0.02, 0.15};
    const dfm_rigid door =
        test::create(w, {test::box("door", half, 1, {0.2, 0, 0})},
                     {test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 0, 1})})[0];
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "hand";
    d.shape = DFM_TOOL_SPHERE;
    d.radius = 0.01;
    d.stiffness = stiffness;
    d.damping = stiffness > 0 ? 14 : 0;
    d.turn_stiffness = stiffness > 0 ? 2 : 0;
    d.turn_damping = stiffness > 0 ? 0.009 : 0;
    d.pose = pose({0.3, -0.05, 0});
    dfm_tool tool = 0;
    test::ok(dfm_tool_create(w, &d, &tool));
    double deepest = 0, pushed = 0;
    for (int i = 1; i <= 500; ++i) {
      const dfm_pose to = pose({0.3, -0.05 + 0.1 * i / 500, 0});
      test::ok(dfm_tool_set_pose(tool, &to, nullptr));
      test::ok(dfm_world_step(w, 1e-3, nullptr));
      dfm_tool_state s{};
      s.size = sizeof s;
      test::ok(dfm_tool_get_state(tool, &s));
      const dfm_rigid_state now = test::state(door);
      const Vec normal = rotate(now.rotation, {0, -1, 0});
      const Vec apart = {s.pose.position[0] - now.position[0], s.pose.position[1] - now.position[1], 0};
      deepest = std::max(deepest, 0.03 - test::dot(apart, normal));
      double force[3], torque[3];
      test::ok(dfm_tool_force(tool, force, torque));
      pushed = std::max(pushed, test::norm(test::vec(force)));
      EXPECT_NEAR(pressed(w), test::norm(test::vec(force)), 1e-9 * (1 + pressed(w)));
    }
    EXPECT_LT(deepest, 1e-6);
    EXPECT_GT(pushed, 0.1);
    EXPECT_GT(test::reading(door, 0).position, 0.1);
  }
}

// Four boxes on three joints of each type, thrown into a pit: no corner goes through a wall, and an impulse
// at one end makes no energy, beyond what swings in flight as well (SHAKE keeps the mean).
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidJoints, WhatIsThrownIntoAPit_StaysThere) {
  const double s = std::sqrt(0.5), wall = 0.4;
  const Vec half = {0.02, 0.03, 0.06};
  uint64_t seed = 17;
  const auto next = [&] {  // -1 to 1
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return double(seed >> 11) / double(1ull << 53) * 2 - 1;
  };
  for (const double dt : kStep)
    for (const uint32_t type : {DFM_JOINT_HINGE, DFM_JOINT_SLIDER, DFM_JOINT_BALL, DFM_JOINT_FIXED}) {
      SCOPED_TRACE(std::to_string(type) + " " + std::to_string(dt));
      double deepest = 0, made = 0;
      for (int run = 0; run < (dt > 0.01 ? 9 : 1); ++run) {
        const double speed = run % 3 == 0 ? 2 : run % 3 == 1 ? 6 : 20;
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, -kG});
        test::set_friction(w, 0.5);
        test::add_plane(w, "floor");
        test::add_plane(w, "left", {-wall, 0, 0}, {0, s, 0, s});
        test::add_plane(w, "right", {wall, 0, 0}, {0, -s, 0, s});
        test::add_plane(w, "front", {0, -wall, 0}, {-s, 0, 0, s});
        test::add_plane(w, "back", {0, wall, 0}, {s, 0, 0, s});
        std::vector<dfm_rigid_def> bodies;
        std::vector<dfm_joint_def> joints;
        const char *const names[] = {"first", "second", "third", "fourth"};
        for (uint32_t i = 0; i < 4; ++i) {
          bodies.push_back(test::box(names[i], half, 0.5 + 0.3 * i, {0, 0, 0.2 + 0.13 * i}));
          if (i > 0) joints.push_back(test::joint(type, i, i - 1, {0, 0, 0.135 + 0.13 * i}, {0, 1, 0}));
        }
        const auto chain = test::create(w, bodies, joints);
        const Vec velocity = {speed * next(), speed * next(), speed * next()},
                  spin = {2 * speed * next(), 2 * speed * next(), 2 * speed * next()};
        for (const dfm_rigid r : chain) {  // as one
          dfm_rigid_state start = test::state(r);
          const Vec turns = cross(spin, {0, 0, start.position[2] - 0.4});
          for (size_t k = 0; k < 3; ++k) {
            start.velocity[k] = velocity[k] + turns[k];
            start.spin[k] = spin[k];
          }
          test::ok(dfm_rigid_set_state(r, &start));
        }
        const double all = energy(chain);
        double last = all;
        for (int i = 0; i * dt < 0.8; ++i) {
          ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
          for (const dfm_rigid r : chain) {
            const dfm_rigid_state now = test::state(r);
            deepest =
                std::max({deepest, farthest(now, half, {0, 0, -1}), farthest(now, half, {1, 0, 0}) - wall,
                          farthest(now, half, {-1, 0, 0}) - wall, farthest(now, half, {0, 1, 0}) - wall,
                          farthest(now, half, {0, -1, 0}) - wall});
          }
          made = std::max(made, (energy(chain) - last) / all);
          last = energy(chain);
        }
      }
      EXPECT_LT(deepest, 1e-6);
      EXPECT_LT(made, dt > 0.01 ? 0.03 : 1e-3);
    }
}
