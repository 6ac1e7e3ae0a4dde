// What a host changes of an obstacle while the world runs: place, belt, filter, material.
#include <vector>

#include "stack.h"

namespace {

// A soft block at rest on the top of a wide box, with one law for all.
struct OnATable {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, -9.81});
  dfm_obstacle table = 0;
  dfm_body block = 0;
  explicit OnATable(const char *law = "coulomb", double seconds = 0.3) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "table";
    d.shape = DFM_SHAPE_BOX;
    d.half_size[0] = d.half_size[1] = 1;
    d.half_size[2] = 0.1;
    d.pose.position[2] = -0.1;
    test::ok(dfm_obstacle_create(world, &d, &table));
    test::ok(test::add_friction(world, law));
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e5;
    o.damping_mass = 20;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 1e-4};
    block = test::make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o);
    run(seconds);
  }
  void run(double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += 1e-3) test::ok(dfm_world_step(world, 1e-3, nullptr));
  }
  dfm_body_measure now() const { return test::measure(block); }
  uint32_t touching() const {
    uint32_t n = 0;
    for (const dfm_contact &c : test::contacts(world)) n += c.fn > 0;
    return n;
  }
  dfm_pose pose() const {
    dfm_pose p{};
    test::ok(dfm_obstacle_get_pose(table, &p));
    return p;
  }
};

}  // namespace

TEST(ObstacleSet, Find_GivesTheHandleOrTheNearestName) {
  OnATable s("coulomb", 0);
  dfm_obstacle found = 0;
  test::ok(dfm_world_find_obstacle(s.world, "table", &found));
  EXPECT_EQ(found, s.table);
  EXPECT_EQ(dfm_world_find_obstacle(s.world, "tabel", &found), DFM_E_ARG);
  test::says({"'tabel'", "'table'"});
  EXPECT_EQ(dfm_world_find_obstacle(s.world, "block", &found), DFM_E_ARG);  // a body is no obstacle
  EXPECT_EQ(dfm_world_find_obstacle(s.world, nullptr, &found), DFM_E_ARG);
}

// It is the shape of a rigid body that has others alone.
TEST(ObstacleSet, ShapeNone_IsRefused) {
  test::Context context;
  dfm_world world = test::make_world(context);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_NONE;
  dfm_obstacle out = 0;
  EXPECT_EQ(dfm_obstacle_create(world, &d, &out), DFM_E_ARG);
  test::says({"shape 6 is unknown"});
}

// Sideways nothing is dragged, and what the friction remembers stays with the block's surface; downwards
// contacts end.
TEST(ObstacleSet, Teleport_DragsNothing_AndContactsThatAreGoneEnd) {
  OnATable s("elastoplastic");
  const dfm_body_measure before = s.now();
  ASSERT_GT(s.touching(), 6u);
  dfm_pose to = s.pose();
  to.position[0] += 0.4;
  to.position[1] -= 0.2;
  test::listed(dfm_world_events, s.world);
  test::ok(dfm_obstacle_teleport(s.table, &to));
  s.run(0.02);
  EXPECT_NEAR(s.now().com[0], before.com[0], 1e-7);
  EXPECT_NEAR(s.now().com[2], before.com[2], 1e-7);
  EXPECT_TRUE(test::listed(dfm_world_events, s.world).empty());
  to.position[2] -= 1;
  test::ok(dfm_obstacle_teleport(s.table, &to));
  s.run(0.02);
  EXPECT_EQ(s.touching(), 0u);
  EXPECT_NEAR(s.now().velocity[2], -9.81 / 20 * (1 - std::exp(-20 * 0.02)), 1e-2);  // with mass damping
  const auto events = test::listed(dfm_world_events, s.world);
  ASSERT_FALSE(events.empty());
  for (const dfm_contact_event &e : events) EXPECT_EQ(e.kind, uint32_t(DFM_EVENT_END));
}

TEST(ObstacleSet, Belt_CarriesTheBlockAndStops) {
  OnATable s;
  const double along[3] = {0.2, 0, 0}, still[3] = {0, 0, 0};
  test::ok(dfm_obstacle_set_velocity_surface(s.table, along));
  s.run(0.4);
  EXPECT_NEAR(s.now().velocity[0], 0.2, 1e-3);  // mu g t = 2 m/s: carried along
  EXPECT_EQ(s.pose().position[0], 0);
  dfm_obstacle_def d{};
  d.size = sizeof d;
  test::ok(dfm_obstacle_get_def(s.table, &d));
  EXPECT_EQ(d.velocity_surface[0], 0.2);
  test::ok(dfm_obstacle_set_velocity_surface(s.table, still));
  s.run(0.3);
  EXPECT_NEAR(s.now().velocity[0], 0, 1e-6);
  const double wild[3] = {NAN, 0, 0}, light[3] = {0, 3e9, 0};
  EXPECT_EQ(dfm_obstacle_set_velocity_surface(s.table, wild), DFM_E_ARG);
  EXPECT_EQ(dfm_obstacle_set_velocity_surface(s.table, light), DFM_E_ARG);
  EXPECT_EQ(dfm_obstacle_set_velocity_surface(s.table, nullptr), DFM_E_ARG);
}

// Each change wakes what lies on the obstacle, and none that changes nothing.
TEST(ObstacleSet, AChange_WakesWhoSleeps) {
  OnATable s;
  test::ok(dfm_world_set_sleep(s.world, true));
  dfm_material_def m = dfm_material_def_default();
  m.name = "ice";
  dfm_material ice = 0;
  test::ok(dfm_material_create(s.world, &m, &ice));
  const double along[3] = {0.01, 0, 0}, still[3] = {0, 0, 0};
  const auto asleep = [&] {
    bool is = false;
    test::ok(dfm_body_is_asleep(s.block, &is));
    return is;
  };
  const auto wakes = [&](const char *what, auto change, bool expected) {
    for (int i = 0; i < 200 && !asleep(); ++i) s.run(0.01);
    ASSERT_TRUE(asleep()) << what;
    test::ok(change());
    EXPECT_EQ(asleep(), !expected) << what;
  };
  wakes("belt as it is", [&] { return dfm_obstacle_set_velocity_surface(s.table, still); }, false);
  wakes("filter as it is", [&] { return dfm_obstacle_set_filter(s.table, 1, ~0u); }, false);
  wakes("no material as before", [&] { return dfm_obstacle_set_material(s.table, 0); }, false);
  wakes("filter", [&] { return dfm_obstacle_set_filter(s.table, 3, ~0u); }, true);
  wakes("material", [&] { return dfm_obstacle_set_material(s.table, ice); }, true);
  wakes("belt", [&] { return dfm_obstacle_set_velocity_surface(s.table, along); }, true);
}

TEST(ObstacleSet, Filter_LetsTheBlockThroughAndCatchesItAgain) {
  OnATable s;
  test::ok(dfm_obstacle_set_filter(s.table, 1, 2));
  s.run(0.01);
  EXPECT_EQ(s.touching(), 0u);
  EXPECT_LT(s.now().velocity[2], -0.08);  // g t, less what mass damping takes
  test::ok(dfm_obstacle_set_filter(s.table, 1, ~0u));
  s.run(0.3);
  EXPECT_GT(s.touching(), 6u);
  EXPECT_NEAR(s.now().velocity[2], 0, 1e-3);
}

// The coefficient of a pair without a rule follows the obstacle's material; a rule by material does too.
TEST(ObstacleSet, Material_ChangesTheFriction) {
  test::Context context;
  const dfm_world world = test::make_world(context, {3, 0, -9.81});
  const dfm_obstacle floor = test::add_plane(world, "floor");
  test::BodyOptions o;
  o.damping_stiffness = 2e-3;
  o.position = {0, 0, 1e-4};
  const dfm_body block = test::make_body(context, world, "beam", {0.1, 0.1, 0.02}, 40, o);
  const auto run = [&](double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += 1e-3) test::ok(dfm_world_step(world, 1e-3, nullptr));
    return test::measure(block).velocity[0];
  };
  const double held = run(0.2);
  EXPECT_NEAR(held, 0, 1e-4);  // 0.306 of the weight, below the default coefficient of 0.5
  const double none = 0;
  const dfm_param_value slippery{"friction", &none, 1};
  dfm_material_def m = dfm_material_def_default();
  m.name = "ice";
  m.extra = {sizeof(dfm_params), 1, &slippery};
  dfm_material ice = 0;
  test::ok(dfm_material_create(world, &m, &ice));
  test::ok(dfm_obstacle_set_material(floor, ice));
  const double free = run(0.1);
  EXPECT_NEAR(free, 0.3, 3e-3);  // 3 m/s2 and nothing that holds
  test::ok(test::add_friction(world, "coulomb", {}, "material=ice"));
  EXPECT_LT(run(0.5), 0.01);
  test::ok(dfm_obstacle_set_material(floor, 0));
  EXPECT_EQ(dfm_obstacle_set_material(floor, block), DFM_E_HANDLE);
  const dfm_world other = test::make_world(context, {0, 0, 0});
  dfm_material theirs = 0;
  test::ok(dfm_material_create(other, nullptr, &theirs));
  EXPECT_EQ(dfm_obstacle_set_material(floor, theirs), DFM_E_HANDLE);
  test::says({"floor", "another world"});
}

// All of it is state: a fresh world takes it over from the snapshot and continues with the same bits.
TEST(ObstacleSet, Snapshot_HoldsBeltFilterAndMaterial) {
  const auto prepared = [](OnATable &s) {
    dfm_material_def m = dfm_material_def_default();
    m.name = "felt";
    dfm_material felt = 0;
    test::ok(dfm_material_create(s.world, &m, &felt));
    return felt;
  };
  OnATable a("coulomb", 0.05), b("coulomb", 0);
  const dfm_material felt = prepared(a), other = prepared(b);
  const double along[3] = {0.05, 0.1, 0};
  test::ok(dfm_obstacle_set_velocity_surface(a.table, along));
  test::ok(dfm_obstacle_set_filter(a.table, 5, 3));
  test::ok(dfm_obstacle_set_material(a.table, felt));
  const std::string kept = test::snapshot(a.world);
  a.run(0.05);
  test::ok(dfm_world_restore(b.world, kept.data(), kept.size()));
  dfm_obstacle_def d{};
  d.size = sizeof d;
  test::ok(dfm_obstacle_get_def(b.table, &d));
  EXPECT_EQ(d.category, 5u);
  EXPECT_EQ(d.collides_with, 3u);
  EXPECT_EQ(d.velocity_surface[1], 0.1);
  EXPECT_EQ(d.material, other);
  b.run(0.05);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}

// A material may be destroyed, and what is made of it keeps it: also from a snapshot.
TEST(ObstacleSet, Snapshot_HoldsAMaterialThatIsDestroyed) {
  OnATable a("coulomb", 0.05);
  dfm_material_def m = dfm_material_def_default();
  m.name = "felt";
  dfm_material felt = 0;
  test::ok(dfm_material_create(a.world, &m, &felt));
  test::ok(dfm_obstacle_set_material(a.table, felt));
  const std::string kept = test::snapshot(a.world);
  a.run(0.05);
  const uint64_t hash = dfm_world_hash(a.world);
  test::ok(dfm_obstacle_set_material(a.table, 0));
  test::ok(dfm_material_destroy(felt));
  ASSERT_EQ(dfm_world_restore(a.world, kept.data(), kept.size()), DFM_OK) << dfm_last_error();
  a.run(0.05);
  EXPECT_EQ(dfm_world_hash(a.world), hash);
}

TEST(ObstacleSet, ARigidBody_HasAFilterAndAMaterial_NoBelt) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, 0});
  dfm_rigid_def d = dfm_rigid_def_default();
  d.name = "ball";
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &d, nullptr, nullptr};
  dfm_rigid ball = 0;
  test::ok(dfm_rigid_create(world, nullptr, &set, &ball));
  dfm_material m = 0;
  test::ok(dfm_material_create(world, nullptr, &m));
  test::ok(dfm_obstacle_set_filter(ball, 8, 16));
  test::ok(dfm_obstacle_set_material(ball, m));
  dfm_rigid_def now{};
  now.size = sizeof now;
  test::ok(dfm_rigid_get_def(ball, &now));
  EXPECT_EQ(now.category, 8u);
  EXPECT_EQ(now.collides_with, 16u);
  EXPECT_EQ(now.material, m);
  const double along[3] = {1, 0, 0};
  EXPECT_EQ(dfm_obstacle_set_velocity_surface(ball, along), DFM_E_STATE);
  test::says({"ball", "motor"});
}
