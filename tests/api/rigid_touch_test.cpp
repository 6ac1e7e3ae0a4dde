// Free rigid bodies of the builtin host on obstacles and on each other: they rest without creep, slide and
// roll as the formulas say, and pass through nothing.
#include "logged_context.h"
#include "obstacle.h"
#include "tool.h"

namespace {

using namespace test::tools;
using test::go;
using test::push;
using test::Vec;

constexpr double kG = 9.81;
constexpr double kStep[] = {1e-3, 1.0 / 60};

dfm_obstacle make(dfm_world w, dfm_obstacle_def d, const char *name, Vec at = {}) {
  d.name = name;
  std::copy(at.begin(), at.end(), d.pose.position);
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

dfm_obstacle_def box_def(Vec half) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_BOX;
  std::copy(half.begin(), half.end(), d.half_size);
  return d;
}

// A floor whose top is the plane z = 0.
const char *const kFloors[] = {"plane", "box", "triangles", "voxels", "fixed body"};
void put_floor(dfm_world w, const std::string &kind) {
  dfm_obstacle_def d = box_def({0.5, 0.5, 0.05});
  if (kind == "plane") {
    test::add_plane(w, "floor");
  } else if (kind == "box") {
    make(w, d, "floor", {0, 0, -0.05});
  } else if (kind == "fixed body") {
    dfm_rigid_def r = test::box("floor", {0.5, 0.5, 0.05}, 1, {0, 0, -0.05});
    r.fixed = 1;
    test::create(w, {r});
  } else if (kind == "triangles") {
    const test::Triangles m = test::height_field(0.5, 9, [](double, double) { return 0.0; });
    make(w, test::mesh_def("floor", m), "floor");
  } else {
    const test::Triangles m = test::box_surface({0.5, 0.5, 0.05}, 1);
    d = test::mesh_def("floor", m, DFM_SHAPE_VOXELS);
    d.cells = 20000;
    make(w, d, "floor", {0, 0, -0.05});
  }
}

// A floor and four walls, `half` from the middle.
void add_pit(dfm_world w, double half) {
  const double s = std::sqrt(0.5);
  test::add_plane(w, "floor");
  test::add_plane(w, "left", {-half, 0, 0}, {0, s, 0, s});
  test::add_plane(w, "right", {half, 0, 0}, {0, -s, 0, s});
  test::add_plane(w, "front", {0, -half, 0}, {-s, 0, 0, s});
  test::add_plane(w, "back", {0, half, 0}, {s, 0, 0, s});
}

const char *const kThings[] = {"box", "ball", "capsule", "triangles"};
// Its lowest point is at z = low; a capsule lies along y.
dfm_rigid put(dfm_world w, const std::string &kind, double low, const char *name = "thing", double mass = 1) {
  const Vec half = {0.05, 0.06, 0.04};
  dfm_rigid_def d = test::box(name, half, mass, {0.013, -0.021, low + half[2]});
  if (kind == "box") return test::create(w, {d})[0];
  if (kind == "triangles") {
    const test::Triangles m = test::box_surface(half, 2);
    d.shape = DFM_SHAPE_NONE;
    for (size_t k = 0; k < 3; ++k) d.inertia[k] = mass / 3 * (test::dot(half, half) - half[k] * half[k]);
    const dfm_rigid r = test::create(w, {d})[0];
    const std::string surface = std::string(name) + ".surface";
    const dfm_obstacle_def of = test::mesh_def(surface.c_str(), m);
    dfm_obstacle shape = 0;
    test::ok(dfm_rigid_add_shape(r, &of, &shape));
    return r;
  }
  d.shape = kind == "ball" ? DFM_SHAPE_SPHERE : DFM_SHAPE_CAPSULE;
  d.radius = half[2];
  d.half_length = 0.03;
  const dfm_pose lies = pose({0.013, -0.021, low + half[2]}, {1, 0, 0}, std::acos(0.0));
  if (kind == "capsule") d.pose = lies;
  return test::create(w, {d})[0];
}

// m, of its center and of what is 5 cm from it
double moved(const dfm_rigid_state &a, const dfm_rigid_state &b) {
  double turn = 0;
  for (size_t k = 0; k < 4; ++k) turn = std::max(turn, std::fabs(a.rotation[k] - b.rotation[k]));
  return test::apart(test::vec(a.position), test::vec(b.position)) + 0.1 * turn;
}

}  // namespace

// Dropped from 2 cm, all of them lie on every kind of floor and stay where they are.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, WhatLies_DoesNotCreep) {
  for (const char *floor : kFloors)
    for (const char *thing : kThings)
      for (const double dt : kStep) {
        SCOPED_TRACE(std::string(thing) + " on " + floor + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, -kG});
        put_floor(w, floor);
        const dfm_rigid r = put(w, thing, 0.02);
        go(w, dt, 1);
        const dfm_rigid_state start = test::state(r);
        go(w, dt, 5);
        EXPECT_LT(moved(start, test::state(r)), 1e-12);
        EXPECT_NEAR(test::state(r).position[2], 0.04, 3e-6);
      }
}

// On a slope: below the angle of friction it stays, above it slides with g (sin a - mu cos a).
TEST(RigidTouch, OnASlope_FrictionHoldsUpToMu) {
  const double mu = 0.4;
  for (const char *law : {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"})
    for (const double slope : {0.9 * mu, 1.5 * mu}) {
      SCOPED_TRACE(std::string(law) + " " + std::to_string(slope));
      const double c = 1 / std::sqrt(1 + slope * slope), s = slope * c, dt = 1e-3;
      test::Context context;
      const dfm_world w = test::make_world(context, {kG * s, 0, -kG * c});
      test::set_friction(w, mu, law);
      test::add_plane(w, "floor");
      const dfm_rigid r = put(w, "box", 1e-6);
      go(w, dt, 0.2);
      const dfm_rigid_state start = test::state(r);
      go(w, dt, 0.5);
      const bool springs = law[0] == 'd' || law[0] == 'l' || law[0] == 'e' || law[0] == 'g';
      if (slope < mu) {
        EXPECT_LT(moved(start, test::state(r)), springs ? 1e-4 : 1e-12) << "bristles swing";
      } else {
        const double a = kG * (s - mu * c);
        EXPECT_NEAR(test::state(r).velocity[0], 0.7 * a, (springs ? 0.02 : 0.001) * a) << "m/s";
      }
    }
}

// Thrown along a floor a box goes v^2 / (2 mu g).
TEST(RigidTouch, ABoxThatSlides_StopsWhereItShould) {
  for (const char *floor : kFloors) {
    SCOPED_TRACE(floor);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::set_friction(w, 0.5);
    put_floor(w, floor);
    const dfm_rigid r = put(w, "box", 1e-6);
    go(w, 1e-3, 0.01);
    const double x = test::state(r).position[0];
    push(r, {1, 0, 0});
    go(w, 1e-3, 1);
    const double way = 1 / (2 * 0.5 * kG);
    EXPECT_NEAR(test::state(r).position[0] - x, way, 1.1e-3 * 0.5) << "a sub-step ends at its new velocity";
    EXPECT_LT(test::norm(test::vec(test::state(r).velocity)), 1e-12);
  }
}

// A ball rolls down with 5/7 of g sin a where friction can turn it, and its place on the floor does not slip.
TEST(RigidTouch, ABall_RollsDownASlope) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    const double a = 0.3, g = kG * std::sin(a);
    test::Context context;
    const dfm_world w = test::make_world(context, {g, 0, -kG * std::cos(a)});
    test::add_plane(w, "floor");
    const dfm_rigid r = put(w, "ball", 1e-6);
    go(w, dt, 1);
    const dfm_rigid_state s = test::state(r);
    EXPECT_NEAR(s.velocity[0], 5.0 / 7 * g, 2e-3 * g);
    EXPECT_NEAR(s.spin[1] * 0.04, s.velocity[0], 1e-4 * s.velocity[0]);
    EXPECT_NEAR(s.position[2], 0.04, 3e-6);
  }
}

// A box on a turntable stays where it is on it, up to the speed at which friction cannot hold it.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, OnATurntable_NothingCreepsOutward) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::set_friction(w, 0.5);
    const dfm_obstacle table = make(w, box_def({0.3, 0.3, 0.01}), "table", {0, 0, -0.01});
    dfm_rigid_def d = test::box("box", {0.03, 0.03, 0.03}, 1, {0.15, 0, 0.03 + 1e-6});
    const dfm_rigid r = test::create(w, {d})[0];
    const double half_turn = std::acos(-1.0);
    double start = 0, most = 0, behind = 0, slipped = 0, spin = 0, angle = 0;
    for (int i = 0; i * dt < 5; ++i) {
      spin = std::min(spin + dt * 4, 3.0);
      angle += spin * dt;
      const dfm_pose to = pose({0, 0, -0.01}, {0, 0, 1}, angle);
      test::ok(dfm_obstacle_move_to(table, &to));
      ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
      const dfm_rigid_state s = test::state(r);
      const double far = std::hypot(s.position[0], s.position[1]);
      const double lag = std::remainder(angle - std::atan2(s.position[1], s.position[0]), 2 * half_turn);
      if (i * dt < 1) {
        start = far;
        behind = lag;
      }
      most = std::max(most, std::fabs(far - start));
      slipped = std::max(slipped, std::fabs(lag - behind) * far);
    }
    EXPECT_LT(most, 1e-6) << "m, in two turns";
    EXPECT_LT(slipped, 1e-6) << "m, the box is carried around";
  }
}

// A belt takes a box along to its own speed; a plate lifts it.
TEST(RigidTouch, WhatMoves_TakesItAlong) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  dfm_obstacle_def d = box_def({5, 0.2, 0.01});
  d.velocity_surface[0] = 0.5;
  const dfm_obstacle plate = make(w, d, "belt", {0, 0, -0.01});
  const dfm_rigid r = put(w, "box", 1e-6);
  go(w, 1e-3, 1);
  EXPECT_NEAR(test::state(r).velocity[0], 0.5, 1e-9);
  for (int i = 1; i <= 500; ++i) {
    const dfm_pose to = pose({0, 0, -0.01 + 2e-4 * i});
    test::ok(dfm_obstacle_move_to(plate, &to));
    ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
  }
  EXPECT_NEAR(test::state(r).velocity[2], 0.2, 1e-9);
  EXPECT_NEAR(test::state(r).position[2], 0.14, 3e-6);
}

// A tower of five, and it stays. Edges that are parallel but for 1e-9 rad cross anywhere, so each sub-step
// shares the load in another way, which its solve finds to a hundredth of what may creep at rest.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, ATower_Stands) {
  for (const double dt : kStep) {
    SCOPED_TRACE(dt);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::add_plane(w, "floor");
    std::vector<dfm_rigid_def> boxes;
    const char *const names[] = {"a", "b", "c", "d", "e"};
    for (size_t i = 0; i < 5; ++i)
      boxes.push_back(test::box(names[i], {0.05, 0.05, 0.02}, 1.0 + double(i),
                                {0.004 * double(i % 2), 0, 0.02 + double(i) * 0.041}));
    const std::vector<dfm_rigid> r = test::create(w, boxes);
    go(w, dt, 1);
    std::vector<dfm_rigid_state> start;
    for (const dfm_rigid one : r) start.push_back(test::state(one));
    go(w, dt, 5);
    for (size_t i = 0; i < r.size(); ++i) {
      EXPECT_LT(moved(start[i], test::state(r[i])), 1e-9) << i;
      EXPECT_NEAR(test::state(r[i]).position[2], 0.02 + 0.04 * double(i), 1e-5);
    }
  }
}

// Both momenta of two boxes that meet in the air.
TEST(RigidTouch, TwoBoxesThatMeet_KeepBothMomenta) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  dfm_rigid_def a = test::box("a", {0.05, 0.04, 0.03}, 1),
                b = test::box("b", {0.03, 0.06, 0.05}, 3, {0.2, 0.03, 0.02});
  a.velocity[0] = 2;
  a.spin[1] = 3;
  b.spin[0] = -2;
  b.spin[2] = 4;
  const std::vector<dfm_rigid> r = test::create(w, {a, b});
  const auto sum = [&](double &kinetic) {
    test::Momenta out;
    for (const dfm_rigid one : r) {
      test::add(out, test::rigid_measure(one));
      kinetic += test::rigid_measure(one).kinetic;
    }
    return out;
  };
  double had = 0, has = 0;
  const test::Momenta before = sum(had);
  go(w, 1e-3, 0.5);
  const test::Momenta after = sum(has);
  EXPECT_LT(test::apart(before.linear, after.linear), 1e-13);
  EXPECT_LT(test::apart(before.angular, after.angular), 1e-12);
  EXPECT_LT(has, had);
  EXPECT_GT(test::state(r[1]).velocity[0], 0.1) << "pushed";
}

// Thrown about in a box of planes at up to 6 m/s: no corner is ever deep in a wall, and no energy comes from
// nowhere.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, Tumbling_StaysInside) {
  for (const double dt : kStep) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    add_pit(w, 0.3);
    uint64_t seed = 7;
    const auto next = [&] {
      seed = seed * 6364136223846793005ull + 1442695040888963407ull;
      return 2 * (double(seed >> 11) / 9007199254740992.0) - 1;
    };
    double deepest = 0, made = 0;
    const Vec half = {0.05, 0.04, 0.03};
    const dfm_rigid r = test::create(w, {test::box("box", half, 1, {0, 0, 0.2})})[0];
    for (int run = 0; run < 20; ++run) {
      dfm_rigid_state start = test::state(r);
      for (double &x : start.position) x = 0.15 * next();
      start.position[2] += 0.3;
      test::ok(dfm_rigid_set_state(r, &start));
      const double turn = 30;  // rad/s
      push(r, {6 * next(), 6 * next(), 6 * next()}, {turn * next(), turn * next(), turn * next()});
      const auto energy = [&] { return test::rigid_measure(r).kinetic + kG * test::state(r).position[2]; };
      double last = energy();
      for (int i = 0; i * dt < 1.5; ++i) {
        ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
        const dfm_rigid_state now = test::state(r);
        for (int k = 0; k < 8; ++k) {
          const Vec arm = rotate(now.rotation, {k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1],
                                                k & 4 ? half[2] : -half[2]});
          deepest = std::max({deepest, -(now.position[2] + arm[2]), std::fabs(now.position[0] + arm[0]) - 0.3,
                              std::fabs(now.position[1] + arm[1]) - 0.3});
        }
        // falling ends a sub-step at its new velocity: m g^2 h^2 / 2 less than it had
        made = std::max(made, energy() - last);
        last = energy();
      }
    }
    EXPECT_LT(deepest, 1e-4);
    EXPECT_LT(made, 1e-3);
  }
}

// Twelve things of three kinds fall on a heap between walls: none goes through the floor or a wall, not even
// in a step in which another one strikes it. Starts that differ by nanometers make other heaps.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, Heaps_StayBetweenTheirWalls) {
  for (const double shift : {0.0, 11e-9}) {
    SCOPED_TRACE(shift);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    add_pit(w, 0.15);
    std::vector<dfm_rigid> things;
    for (int i = 0; i < 12; ++i) {
      const std::string name = "thing" + std::to_string(i);
      things.push_back(put(w, kThings[i % 3], 0.1 + 0.13 * i + shift, name.c_str(), 1 + 0.3 * (i % 4)));
      push(things.back(), {0.1 * (i % 3 - 1), 0.1 * (i % 5 - 2), 0}, {0.5 * (i % 4), 0.3 * i, 1});
    }
    for (int k = 0; k < 240; ++k) {
      go(w, 1.0 / 60, 1.0 / 60);
      for (const dfm_rigid r : things) ASSERT_GT(test::state(r).position[2], 0.04 - 1e-5) << "step " << k;
    }
    for (const dfm_rigid r : things) {
      const dfm_rigid_state now = test::state(r);
      EXPECT_LT(now.position[2], 0.4);
      EXPECT_LT(std::max(std::fabs(now.position[0]), std::fabs(now.position[1])), 0.111);
      EXPECT_LT(test::norm(test::vec(now.velocity)), 0.3);
    }
  }
}

// What lies on a floor is the same after a snapshot is read again, and filters part it from the floor.
TEST(RigidTouch, SnapshotsAndFilters_Count) {
  test::Context context;
  const dfm_world w = test::make_world(context, {1, 0, -kG});
  test::set_friction(w, 0.3, "lugre");
  test::add_plane(w, "floor");
  const dfm_rigid r = put(w, "box", 0.001);
  go(w, 1e-3, 0.2);
  const std::string data = test::snapshot(w);
  go(w, 1e-3, 0.2);
  const uint64_t hash = dfm_world_hash(w);
  test::ok(dfm_world_restore(w, data.data(), data.size()));
  go(w, 1e-3, 0.2);
  EXPECT_EQ(dfm_world_hash(w), hash);
  test::ok(dfm_obstacle_set_filter(r, 1, 0));
  go(w, 1e-3, 0.2);
  EXPECT_LT(test::state(r).position[2], -0.1);
}

// Boxes that lie on each other do not rise when a soft body comes far away, with whose size the rest distance
// would grow.
TEST(RigidTouch, ATower_StaysWhenASoftBodyComes) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  test::add_plane(w, "floor");
  std::vector<dfm_rigid> boxes;
  for (int i = 0; i < 5; ++i)
    boxes.push_back(test::create(
        w, {test::box(("box" + std::to_string(i)).c_str(), {0.1, 0.1, 0.1}, 1, {0, 0, 0.1 + 0.2 * i})})[0]);
  go(w, 1e-4, 0.5);
  test::BodyOptions o;
  o.position = {5, 0, 5};
  test::make_body(context, w, "beam", {0.4, 0.4, 0.4}, 40, o);
  double fastest = 0;
  for (int i = 0; i < 20; ++i) {
    go(w, 1e-4, 1e-4);
    for (const dfm_rigid r : boxes) fastest = std::max(fastest, test::state(r).velocity[2]);
  }
  EXPECT_LT(fastest, 1e-3);
}

// What a hinge connects falls on the floor and stays there, and nothing is to be told.
TEST(RigidTouch, WhatAHingeConnects_StaysOnAFloor) {
  test::LoggedContext context;
  const dfm_world w = test::make_world(context.context, {0, 0, -kG});
  test::add_plane(w, "floor");
  const std::vector<dfm_rigid_def> bodies = {test::box("cart", {0.05, 0.05, 0.05}, 1, {0, 0, 0.1}),
                                             test::box("arm", {0.05, 0.05, 0.05}, 1, {0, 0, 0.3})};
  const auto set = test::create(w, bodies, {test::joint(DFM_JOINT_HINGE, 1, 0, {0, 0, 0.2}, {0, 1, 0})});
  const std::vector<dfm_rigid_def> free = {test::box("free", {0.05, 0.05, 0.05}, 1, {1, 0, 0.1})};
  test::create(w, free);
  const std::string plan = test::explain(w);
  EXPECT_EQ(plan.find("pass through obstacles"), std::string::npos) << plan;
  EXPECT_NE(plan.find("5 pairs of rigid bodies with each other and with obstacles"), std::string::npos)
      << plan;
  go(w, 1e-2, 0.5);
  EXPECT_NEAR(test::state(set[0]).position[2], 0.05, 2e-6);
  EXPECT_EQ(context.log, "");
}

// Thrown with a fast spin onto a plane at 60 Hz: a corner goes along its arc, and none is deep in the plane.
// Energy is compared where free flight keeps it: not at 200 rad/s, 3 rad in a sub-step.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, FastSpin_LeavesNothingInTheFloor) {
  const double dt = 1.0 / 60;
  for (const double spin : {40.0, 200.0})
    for (const Vec half : {Vec{0.05, 0.05, 0.05}, Vec{0.05, 0.04, 0.03}, Vec{0.1, 0.03, 0.02}}) {
      SCOPED_TRACE(std::to_string(spin) + " rad/s " + std::to_string(half[0]));
      double deepest = 0, made = 0;
      for (int run = 0; run < 24; ++run) {
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, -kG});
        test::add_plane(w, "floor");
        const dfm_rigid r = test::create(w, {test::box("box", half, 1, {0, 0, 0.2 + 0.01 * run})})[0];
        const double a = 0.5 * run, c = std::cos(a), s = std::sin(a);
        push(r, {0.2, 0.1, -2}, {spin * c, spin * s * std::cos(3 * a), spin * s * std::sin(3 * a)});
        const auto energy = [&] { return test::rigid_measure(r).kinetic + kG * test::state(r).position[2]; };
        double last = energy();
        for (int i = 0; i * dt < 1.5; ++i) {
          ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
          const dfm_rigid_state now = test::state(r);
          for (int k = 0; k < 8; ++k) {
            const Vec arm = rotate(now.rotation, {k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1],
                                                  k & 4 ? half[2] : -half[2]});
            deepest = std::max(deepest, -(now.position[2] + arm[2]));
          }
          made = std::max(made, energy() - last);
          last = energy();
        }
      }
      EXPECT_LT(deepest, 1e-5) << "m";
      if (spin < 50) {
        EXPECT_LT(made, 1e-6) << "J";
      }
    }
}

// A body of voxels has no corners that could meet a plane: one sentence says so, and the plan names it.
TEST(RigidTouch, VoxelsOnAPlane_AreReported) {
  test::LoggedContext context;
  const dfm_world w = test::make_world(context.context, {0, 0, -kG});
  test::add_plane(w, "floor");
  dfm_rigid_def d = test::box("lump", {0.05, 0.05, 0.05}, 1, {0, 0, 0.1});
  d.shape = DFM_SHAPE_NONE;
  for (double &moment : d.inertia) moment = 2e-3;
  const dfm_rigid r = test::create(w, {d})[0];
  const test::Triangles m = test::box_surface({0.05, 0.05, 0.05}, 1);
  dfm_obstacle_def of = test::mesh_def("lump.grid", m, DFM_SHAPE_VOXELS);
  of.cells = 1000;
  dfm_obstacle shape = 0;
  test::ok(dfm_rigid_add_shape(r, &of, &shape));
  const std::string plan = test::explain(w);
  EXPECT_NE(plan.find("these pass through obstacles: lump.grid"), std::string::npos) << plan;
  go(w, 1e-2, 0.5);
  const size_t first = context.log.find("'lump.grid' is ");
  EXPECT_NE(first, std::string::npos) << context.log;
  EXPECT_NE(context.log.find("deep in 'floor'"), std::string::npos);
  EXPECT_EQ(context.log.find("'lump.grid' is ", first + 1), std::string::npos) << "once";
}

// Twenty boxes that fall on a heap: no step has more energy than the one before, from the fall to rest.
// Starts that differ by a nanometer make other heaps.
// unsanitized: too slow there; shorter tests run the same code
TEST(RigidTouch, HeapsOfBoxes_MakeNoEnergy) {
  const double dt = 1.0 / 60;
  for (int shift = 0; shift < 2; ++shift) {
    SCOPED_TRACE(shift);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::add_plane(w, "floor");
    std::vector<dfm_rigid> r;
    for (int i = 0; i < 20; ++i) {
      const std::string name = "box" + std::to_string(i);
      dfm_rigid_def d =
          test::box(name.c_str(), {0.05, 0.04, 0.03}, 1 + 0.2 * (i % 4),
                    {0.13 * (i % 3 - 1) + 1e-9 * shift, 0.11 * (i / 3 % 3 - 1), 0.06 + 0.13 * (i / 9)});
      d.spin[0] = i % 5 - 2;
      d.spin[2] = i % 3;
      r.push_back(test::create(w, {d})[0]);
    }
    const auto energy = [&] {
      double sum = 0;
      for (size_t i = 0; i < r.size(); ++i)
        sum += test::rigid_measure(r[i]).kinetic +
               (1 + 0.2 * double(i % 4)) * kG * test::state(r[i]).position[2];
      return sum;
    };
    const double start = energy();
    double last = start, made = 0;
    for (int i = 0; i * dt < 2; ++i) {
      ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
      made = std::max(made, energy() - last);
      last = energy();
    }
    EXPECT_LT(made, 1e-6 * start) << "J in a step";
    EXPECT_LT(last, 0.8 * start) << "they have fallen";
  }
}

namespace {

// m, how far two boxes of the same size overlap along the axis where it is least; not above 0: not at all
double overlap(const dfm_rigid_state &a, const dfm_rigid_state &b, const Vec &half) {
  Vec of_a[3], of_b[3], apart;
  for (size_t k = 0; k < 3; ++k) {
    Vec e{};
    e[k] = 1;
    of_a[k] = rotate(a.rotation, e);
    of_b[k] = rotate(b.rotation, e);
    apart[k] = b.position[k] - a.position[k];
  }
  double least = HUGE_VAL;
  const auto look = [&](const Vec &n) {
    const double length = test::norm(n);
    if (!(length > 1e-3)) return;
    double reach = 0;
    for (size_t k = 0; k < 3; ++k)
      reach += half[k] * (std::fabs(test::dot(n, of_a[k])) + std::fabs(test::dot(n, of_b[k])));
    least = std::min(least, (reach - std::fabs(test::dot(n, apart))) / length);
  };
  for (const Vec &p : of_a) {
    look(p);
    for (const Vec &q : of_b)
      look({p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]});
  }
  for (const Vec &q : of_b) look(q);
  return least;
}

}  // namespace

// A box falls on another one, turns past its face, and lies on edges that did not face each other before.
TEST(RigidTouch, EdgesThatTurnTowardsEachOther_Meet) {
  for (const auto &[dt, spin] : {std::pair(1e-3, -2.0), std::pair(1e-3, -5.0), std::pair(1e-3, -14.0),
                                 std::pair(1.0 / 60, -2.0), std::pair(1.0 / 60, -5.0)})
    for (int run = 0; run < 4; ++run) {
      double deepest = -HUGE_VAL;
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -kG});
      const Vec half = {0.05, 0.06, 0.04};
      dfm_rigid_def lower = test::box("lower", half, 1),
                    upper = test::box("upper", half, 1, {0.013, 0.01 + 0.011 * run, 0.1});
      lower.fixed = 1;
      const dfm_rigid a = test::create(w, {lower})[0], b = test::create(w, {upper})[0];
      dfm_rigid_state s = test::state(b);
      s.rotation[2] = std::sin(0.1 + 0.1 * run);
      s.rotation[3] = std::cos(0.1 + 0.1 * run);
      s.spin[0] = spin;
      test::ok(dfm_rigid_set_state(b, &s));
      for (int i = 0; i * dt < 0.3; ++i) {
        ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
        deepest = std::max(deepest, overlap(test::state(a), test::state(b), half));
      }
      EXPECT_NEAR(deepest, 0, 1e-4) << "m, " << spin << " rad/s, " << dt << " s, " << run;
    }
}

namespace {

// m, by which two boxes of the same half size are in each other: the least overlap along the axes that can
// separate them (S. Gottschalk, M. C. Lin, D. Manocha, OBBTree, SIGGRAPH 1996).
double overlap_of(const dfm_rigid_state &a, const dfm_rigid_state &b, const Vec &half) {
  std::vector<Vec> axes;
  for (const dfm_rigid_state *const s : {&a, &b})
    for (size_t k = 0; k < 3; ++k) {
      Vec unit{};
      unit[k] = 1;
      axes.push_back(rotate(s->rotation, unit));
    }
  double least = HUGE_VAL;
  const auto look = [&](const Vec &n) {
    const double length = test::norm(n);
    if (length < 1e-3) return;
    double room = 0, apart = 0;
    for (size_t k = 0; k < 3; ++k) {
      room += half[k] * (std::fabs(test::dot(n, axes[k])) + std::fabs(test::dot(n, axes[3 + k])));
      apart += n[k] * (b.position[k] - a.position[k]);
    }
    least = std::min(least, (room - std::fabs(apart)) / length);
  };
  for (const Vec &n : axes) look(n);
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 3; j < 6; ++j) look(cross(axes[i], axes[j]));
  return least;
}

// m, J, and pairs of boxes that are more than 1 mm in each other, over all steps
struct ShaftFall {
  double deepest = 0, made = 0, start = 0, last = 0;
  int overlaps = 0;
};

// Twenty boxes that fall into a shaft of six times their size, moved by `shift` at the start.
void fall_into_shaft(double shift, ShaftFall &out) {
  const double half = 0.15;
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  add_pit(w, half);
  const Vec size = {0.05, 0.06, 0.04};
  std::vector<dfm_rigid> r;
  for (int i = 0; i < 20; ++i) {
    const std::string name = "box" + std::to_string(i);
    dfm_rigid_def d = test::box(name.c_str(), size, 1 + 0.3 * (i % 4),
                                {0.013 + shift + 0.002 * (i % 5), -0.021, 0.1 + 0.13 * i});
    d.velocity[0] = 0.1 * (i % 3 - 1);
    d.velocity[1] = 0.1 * (i % 5 - 2);
    d.spin[0] = 0.5 * (i % 4);
    d.spin[1] = 0.06 * i;
    d.spin[2] = 1;
    r.push_back(test::create(w, {d})[0]);
  }
  const auto energy = [&] {
    double sum = 0;
    for (size_t i = 0; i < r.size(); ++i)
      sum +=
          test::rigid_measure(r[i]).kinetic + (1 + 0.3 * double(i % 4)) * kG * test::state(r[i]).position[2];
    return sum;
  };
  const double start = energy();
  double last = start, made = 0, deepest = 0;
  int overlaps = 0;
  for (int i = 0; i < 80; ++i) {
    ASSERT_EQ(dfm_world_step(w, 1.0 / 60, nullptr), DFM_OK) << dfm_last_error();
    made = std::max(made, energy() - last);
    last = energy();
    for (size_t n = 0; n < r.size(); ++n) {
      const dfm_rigid_state now = test::state(r[n]);
      for (size_t m = 0; m < n; ++m) overlaps += overlap_of(now, test::state(r[m]), size) > 1e-3;
      for (int k = 0; k < 8; ++k) {
        const Vec arm = rotate(now.rotation, {k & 1 ? size[0] : -size[0], k & 2 ? size[1] : -size[1],
                                              k & 4 ? size[2] : -size[2]});
        deepest = std::max({deepest, -(now.position[2] + arm[2]), std::fabs(now.position[0] + arm[0]) - half,
                            std::fabs(now.position[1] + arm[1]) - half});
      }
    }
  }
  out = {deepest, made, start, last, overlaps};
}

}  // namespace

// Also off what is thinner than a dent.
TEST(RigidTouch, APlateOnAPlate_IsLiftedOff) {
  for (const double half : {5e-4, 5e-5, 5e-6}) {
    test::Context c;
    const dfm_world w = test::make_world(c, {0, 0, 0});
    dfm_rigid_def lower = test::box("lower", {2e-3, 2e-3, half}, 1), upper = lower;
    lower.fixed = 1;
    upper.name = "upper";
    upper.pose.position[2] = 2 * half + 1e-6;
    upper.pose.rotation[2] = std::sin(3.14159265358979 / 8);
    upper.pose.rotation[3] = std::cos(3.14159265358979 / 8);
    upper.velocity[2] = 0.3;
    test::create(w, {lower});
    const dfm_rigid plate = test::create(w, {upper})[0];
    test::run(w, 0.01, 1e-3);
    EXPECT_NEAR(test::state(plate).velocity[2], 0.3, 1e-9) << half;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(test::state(plate).spin[k], 0, 1e-6) << half;
  }
}

// They jam, turn and carry each other: no corner goes into a wall or the floor, few boxes into others, and no
// step makes energy.
// soak: a minute; the table of doc/decisions/rigid_bodies_and_tools.md has the deepest of these
TEST(RigidTouch, EightShafts_AreNotPassed) {
  double deepest = 0;
  for (int i = 0; i < 8; ++i) {
    ShaftFall fall;
    fall_into_shaft(0.0007 * i, fall);
    deepest = std::max(deepest, fall.deepest);
    std::printf("%d: pairs and steps over 1 mm deep %d, energy left %.3f\n", i, fall.overlaps,
                fall.last / fall.start);
    EXPECT_LT(fall.made, 1e-6 * fall.start) << i;
    EXPECT_LT(fall.last, 0.4 * fall.start) << i << ": they have fallen";
  }
  std::printf("deepest of eight shafts: %.3g m\n", deepest);
  EXPECT_LT(deepest, 5e-6);
}

// A rod and a plate that fly and turn by more than a radian in a step keep their energy and angular momentum.
TEST(RigidTouch, FastSpinInFreeFlight_KeepsEnergy) {
  for (const Vec half : {Vec{0.1, 0.03, 0.02}, Vec{0.1, 0.08, 0.01}})
    for (const double spin : {20.0, 80.0, 170.0}) {
      SCOPED_TRACE(std::to_string(spin) + " rad/s " + std::to_string(half[1]));
      test::Context context;
      const dfm_world w = test::make_world(context, {});
      const dfm_rigid r = test::create(w, {test::box("thing", half, 1)})[0];
      push(r, {}, {0.6 * spin, 0.64 * spin, 0.48 * spin});
      const dfm_body_measure start = test::rigid_measure(r);
      for (int i = 0; i < 120; ++i) {
        ASSERT_EQ(dfm_world_step(w, 1.0 / 60, nullptr), DFM_OK) << dfm_last_error();
        const dfm_body_measure now = test::rigid_measure(r);
        EXPECT_NEAR(now.kinetic, start.kinetic, 0.02 * start.kinetic);
        EXPECT_LT(test::apart(test::vec(now.angular), test::vec(start.angular)),
                  1e-11 * test::norm(test::vec(start.angular)));
      }
    }
}

// A rod put 5 mm into the middle of another one that crosses it is led out on its own side.
TEST(RigidTouch, RodsThatCrossInEachOther_AreLedApart) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, -kG});
  const auto rod = [](const char *name, Vec axis, double height) {
    dfm_rigid_def d = test::box(name, {0.1, 0.1, 1}, 1);
    d.shape = DFM_SHAPE_CAPSULE;
    d.radius = 0.1;
    d.half_length = 1;
    d.pose = pose({0, 0, height}, axis, std::acos(0.0));
    return d;
  };
  dfm_rigid_def low = rod("low", {0, 1, 0}, 0);
  low.fixed = 1;
  test::create(w, {low});
  const dfm_rigid high = test::create(w, {rod("high", {1, 0, 0}, 0.195)})[0];
  test::run(w, 1, 1e-3);
  EXPECT_GT(test::state(high).position[2], 0.195);
  EXPECT_LT(test::state(high).position[2], 0.21);
  dfm_world_destroy(w);
}
