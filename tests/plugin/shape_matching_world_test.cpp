// The model shape_matching in a world, with its defaults unless a test says otherwise: on floors and slopes,
// under every law, against another model, asleep, restored, on the demo scenes, in `deform explain`.
#include <functional>

#include "block_world.h"

namespace {

constexpr double kStep = 2e-3;

using test::tilted;
using World = test::BlockWorld;
test::Block block(const char *law = "coulomb", std::array<double, 3> gravity = {0, 0, -9.81},
                  double z = 1e-4) {
  return {"shape_matching", law, gravity, z};
}

std::string explained(dfm_world w) {
  size_t bytes = 0;
  test::ok(dfm_world_explain(w, nullptr, &bytes));
  std::string text(bytes, '\0');
  test::ok(dfm_world_explain(w, text.data(), &bytes));
  return text;
}

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(ShapeMatchingWorld, DroppedBlock_RestsAndWeighsWhatItWeighs) {
  for (double step : {1e-3, 1.0 / 60}) {
    World w(block("coulomb", {0, 0, -9.81}, 0.2));
    test::run(w.world, 3, step);
    const dfm_body_measure m = test::measure(w.body);
    EXPECT_LT(m.speed_max, 1e-6) << step;
    EXPECT_NEAR(m.com[2], 0.05, 0.002) << step;
    EXPECT_NEAR(m.volume / 0.002, 1, 0.03) << step;
    test::expect_weight(w, 1e-5);
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(ShapeMatchingWorld, SlopeBelowTheLimit_HoldsUnderEveryLawWithStiction) {
  for (const char *law : {"coulomb", "karnopp", "elastoplastic", "gms"}) {
    World w(block(law, tilted(0.2)));
    test::run(w.world, 2, kStep);
    const double x = test::measure(w.body).com[0];
    test::run(w.world, 2, kStep);
    EXPECT_LT(std::abs(test::measure(w.body).com[0] - x), 1e-6) << law;
  }
}

TEST(ShapeMatchingWorld, EveryLaw_StaysOnTheSlopeAndFinite) {
  for (const char *law : {"none", "coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"}) {
    World w(block(law, tilted(0.2)));
    test::run(w.world, 0.5, kStep);
    const dfm_body_measure m = test::measure(w.body);
    EXPECT_NEAR(m.com[2], 0.05, 0.002) << law;
    // freely it would have gone 0.24 m
    if (std::string(law) == "none") EXPECT_NEAR(m.com[0] - 0.1, 0.5 * 9.81 * std::sin(0.2) * 0.25, 0.01);
    else EXPECT_LT(m.com[0] - 0.1, 0.01) << law;
  }
}

TEST(ShapeMatchingWorld, SlopeAboveTheLimit_SlidesWithCoulombsAcceleration) {
  World w(block("none", tilted(0.5)));
  test::set_friction(w.world, 0.3);
  test::run(w.world, 0.5, kStep);
  const double v = test::measure(w.body).velocity[0];
  test::run(w.world, 0.5, kStep);
  EXPECT_NEAR((test::measure(w.body).velocity[0] - v) / 0.5, 9.81 * (std::sin(0.5) - 0.3 * std::cos(0.5)),
              0.05);
}

TEST(ShapeMatchingWorld, CollisionWithEveryModel_KeepsMomentum) {
  for (const char *other : {"shape_matching", "msm", "corotational_fem"})
    test::expect_collision_keeps_momentum(block(), other, 0.1);
}

TEST(ShapeMatchingWorld, BlockAtRest_FallsAsleep) {
  World w(block());
  test::ok(dfm_world_set_sleep(w.world, true));
  bool asleep = false;
  for (int n = 0; n < 4000 && !asleep; ++n) {
    ASSERT_EQ(dfm_world_step(w.world, kStep, nullptr), DFM_OK) << dfm_last_error();
    test::ok(dfm_body_is_asleep(w.body, &asleep));
  }
  EXPECT_TRUE(asleep);
}

TEST(ShapeMatchingWorld, SnapshotInContact_ContinuesWithTheSameBits) {
  const auto make = [](test::Context &c) {
    const dfm_world world = test::make_world(c);
    dfm_mesh_handle mesh = 0;
    const double size[] = {0.2, 0.1, 0.1}, clusters = 3, creep = 30, yield = 1e-3, mode = 2;
    test::ok(dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 120, &mesh));
    dfm_body_def d = dfm_body_def_default();
    d.name = "block";
    d.model = "shape_matching";
    const dfm_param_value values[] = {{"clusters", &clusters, 1},
                                      {"plastic_creep", &creep, 1},
                                      {"plastic_yield", &yield, 1},
                                      {"mode", &mode, 1}};
    d.model_params = {sizeof(dfm_params), 4, values};
    test::lend(mesh, d);
    d.material = test::make_material(world, {});
    d.pose.position[2] = 0.3;
    d.spin[1] = 3;
    dfm_body body = 0;
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    return world;
  };
  test::Context a, b;
  const dfm_world first = make(a), second = make(b);
  test::run(first, 0.2, kStep);
  for (int n = 0; n < 100 && !test::stats(first).contacts; ++n) test::run(first, kStep, kStep);
  test::run(first, 2 * kStep, kStep);
  EXPECT_GT(test::stats(first).contacts, 0u);
  const std::string saved = test::snapshot(first);
  test::ok(dfm_world_restore(second, saved.data(), saved.size()));
  test::run(first, 0.2, kStep);
  test::run(second, 0.2, kStep);
  EXPECT_EQ(dfm_world_hash(first), dfm_world_hash(second));
}

TEST(ShapeMatchingWorld, Explain_CallsItPlausible) {
  World w(block());
  EXPECT_NE(explained(w.world).find("\"kind\":\"plausible, not physical\""), std::string::npos);
  World fem({"corotational_fem"});
  EXPECT_NE(explained(fem.world).find("\"kind\":\"physical\""), std::string::npos);
  const test::CommandResult result =
      test::deform({"explain", std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/slope_block.json", "--set",
                    R"(/bodies/0/model={"type":"shape_matching"})"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("plausible, not physical"), std::string::npos) << result.out;
}

TEST(ShapeMatchingWorld, HoldOfALivingBody_IsRefusedInOneSentence) {
  World w(block());
  const uint32_t point = 0;
  EXPECT_EQ(dfm_body_hold(w.body, 1, &point, 7), DFM_E_UNSUPPORTED);
  test::says({"body 'block'", "steps itself", "dfm_body_def.fixed"});
}

// A slope that tilts, a ball rolling down, two tubes, with the model alone named.
// unsanitized: too slow there; shorter tests run the same code
TEST(ShapeMatchingWorld, DemoScenes_MeetTheirCriteria) {
  for (const char *scene : {"slope_block", "ball_incline", "two_cylinders", "two_materials"})
    test::expect_valid_demo(scene, "shape_matching", 0.5, 2e-3);
  test::expect_valid_demo("fill_drop", "shape_matching", 0.1,
                          2e-3);  // a surface that hangs on lattice points
}
