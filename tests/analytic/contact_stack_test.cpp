// Three cubes on each other, a little off their grids, so that edges cross edges and no points face points:
// the normal force of each interface is the weight above it, and the stack stays. Source:
// reference/contact (box_stack); verification F6, F9.
#include "world.h"

TEST(Stack, ThreeCubes_InterfacesCarryTheWeightAboveAndRest) {
  constexpr double kG = 9.81, kEdge = 0.1, kMu = 0.5, kGap = 5e-5;
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  std::vector<dfm_body> cubes;
  for (int k = 0; k < 3; ++k) {
    test::BodyOptions o;
    o.name = "cube" + std::to_string(k);
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.damping_mass = 20;
    o.position = {0.003 * k, 0.002 * k, kGap + k * (kEdge + kGap)};
    cubes.push_back(test::make_body(context, world, "beam", {kEdge, kEdge, kEdge}, 60, o));
  }
  const dfm_obstacle floor = test::add_plane(world, "floor");
  test::set_friction(world, kMu);
  test::run(world, 2, 1e-3);
  const dfm_body_measure top = test::measure(cubes[2]);
  const double weight = top.mass * kG;
  test::ok(dfm_world_hold_begin(world));
  for (int step = 0; step < 500; ++step) {
    test::run(world, 1e-3, 1e-3);
    dfm_pair_report pairs[4];
    uint32_t n = 0;
    ASSERT_EQ(dfm_world_pairs(world, 4, pairs, &n), DFM_OK) << dfm_last_error();
    ASSERT_EQ(n, 3u);
    for (const dfm_pair_report &p : pairs) {
      if (&p == pairs + n) break;
      const double above = p.b == floor ? 3 : p.a == cubes[0] ? 2 : 1;
      EXPECT_NEAR(p.normal, above * weight, 1e-3 * above * weight)
          << "step " << step << ", " << above << " cubes above";
    }
    EXPECT_LT(test::measure(cubes[2]).speed_max, 1e-5);
  }
  double creep = NAN;
  uint32_t held = 0;
  test::ok(dfm_world_hold(world, &creep, &held));
  EXPECT_GT(held, 12u);
  EXPECT_LT(creep, 1e-6) << "m/s";
  const dfm_body_measure end = test::measure(cubes[2]);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(end.com[k], top.com[k], 1e-6);

  std::vector<dfm_contact> contacts(256);
  uint32_t n = 0;
  ASSERT_EQ(dfm_world_contacts(world, 256, contacts.data(), &n), DFM_OK) << dfm_last_error();
  for (uint32_t i = 0; i < n; ++i) {
    EXPECT_GE(contacts[i].fn, 0);
    EXPECT_LE(std::hypot(contacts[i].ft[0], contacts[i].ft[1]), kMu * contacts[i].fn * (1 + 1e-9));
  }
}

// The automatic rest distance follows the bodies' edges. It must not grow under bodies that already rest.
TEST(Stack, CoarseBodyAddedElsewhere_LeavesRestAlone) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  test::BodyOptions small, large;
  small.name = "small";
  small.young = 1e6;
  small.damping_stiffness = 1e-3;
  small.position = {0, 0, 5e-5};
  large.name = "large";
  large.young = 1e6;
  large.position = {5, 5, 0.01};
  const dfm_body body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, small);
  test::add_plane(world, "floor");
  test::run(world, 0.5, 1e-3);
  const double height = test::measure(body).com[2];
  test::make_body(context, world, "beam", {1, 1, 1}, 60, large);
  for (int step = 0; step < 100; ++step) {
    test::run(world, 1e-3, 1e-3);
    ASSERT_NEAR(test::measure(body).com[2], height, 1e-7) << "step " << step;
  }
}

// A block that overhangs a narrower box bends over its rim: inner edges of the bending face meet the rim, and
// everything rests.
TEST(Stack, BlockOverhangingABox_ComesToRest) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 2;
  o.position = {-0.1, -0.05, 1e-4};
  const dfm_body block = test::make_body(context, world, "beam", {0.2, 0.1, 0.05}, 300, o);
  dfm_obstacle_def box = dfm_obstacle_def_default();
  box.name = "box";
  box.shape = DFM_SHAPE_BOX;
  box.pose.position[2] = -0.05;
  box.half_size[0] = 0.06;
  box.half_size[1] = 0.2;
  box.half_size[2] = 0.05;
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(world, &box, &obstacle));
  test::set_friction(world, 0.5);
  test::run(world, 1.5, 1e-3);
  for (int i = 0; i < 100; ++i) {
    test::run(world, 1e-3, 1e-3);
    ASSERT_LT(test::measure(block).speed_max, 1e-8) << "m/s, step " << i;
  }
  EXPECT_GT(test::stats(world).contacts, 5u);
}
