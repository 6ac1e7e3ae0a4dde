// Steps of what dfm_world_stable_step answers, asked anew before each ("step": "auto"): they change rarely,
// and undamped bodies keep their energy. The whole study: tests/bench/step_study.cpp.
#include "obstacle.h"
#include "step_energy.h"
#include "support.h"

using namespace test::step_energy;

namespace {

constexpr const char *kData = DEFORM_SOURCE_DIR "/examples/data/";

void keeps(const Case &c, uint64_t steps, double share = 1) {
  test::Context context;
  const Result r = run_case(context, c, steps, 20, share);
  EXPECT_FALSE(r.stopped) << c.name << " after " << r.steps << " steps";
  EXPECT_GT(r.least, -0.02) << c.name;
  EXPECT_LT(r.most, 0.02) << c.name;
  EXPECT_LE(r.changes, 3u) << c.name;
}

}  // namespace

// When a step stood on the bound and flipped between one and two sub-steps these had a thousand times their
// energy after 2,281, 533, 6,513 and 361 steps.
TEST(AutoStep, UndampedBodies_KeepTheirEnergy) {
  keeps({"tube", kData + std::string("tube.msh"), "spin", 1}, 5000);
  keeps({"cylinder", kData + std::string("cylinder_slim.msh"), "spin", 0}, 5000);
  keeps({"beam", kData + std::string("beam.msh"), "hung", 1}, 20000);
  keeps({"ball", kData + std::string("ball_small.msh"), "ring", 1}, 40000);
}

TEST(AutoStep, HostThatTakesAShareOfIt_ChangesRarelyToo) {
  for (const double share : {0.5, 0.7, 0.95, 1.5})
    keeps({"bar", kData + std::string("bar.msh"), "ring", 1}, 10000, share);
}

TEST(AutoStep, ThesisCylinderThatSpins_KeepsItsEnergy) {
  const std::string mesh = test::mesh_dir() + "/thesis/cyl_coarse.msh";
  keeps({"cyl_coarse", mesh, "spin", 1}, 8000);
}

namespace {

// kReach: m, of contacts in a step without sub-steps. kLeastEdge: m, no edge is shorter.
constexpr double kStep = 1.0 / 60, kFall = 6, kReach = 2 * kFall * kStep, kLeastEdge = 0.04;

dfm_body fast_block(test::Context &context, dfm_world w, const char *model, double z, double v) {
  test::BodyOptions o;
  o.model = model;
  o.position = {0, 0, z};
  const dfm_body body = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  test::set_velocity(body, {0, 0, v});
  return body;
}

uint32_t substeps_of_step(dfm_world w) {
  test::ok(dfm_world_step(w, kStep, nullptr));
  return test::stats(w).last_substeps;
}

}  // namespace

// A body that goes with its floor does so in whole steps, however fast.
TEST(Substeps, OfABodyThatFallsOnAMesh_ReachAsFarAsAnEdge) {
  for (const char *model : {"shape_matching", "modal"}) {
    test::Context context;
    const dfm_world w = test::make_world(context);
    test::set_friction(w, 0.8);
    const auto flat = test::height_field(1, 40, [](double, double) { return 0.0; });
    const dfm_obstacle floor = test::add_mesh(w, "floor", flat);
    const dfm_body body = fast_block(context, w, model, 0.2, -kFall);
    uint32_t most = 0;
    for (int k = 0; k < 90; ++k) {
      const std::string before = test::snapshot(w);
      const uint32_t n = substeps_of_step(w);
      if (n > most) {  // the same after a restore
        const uint64_t hash = dfm_world_hash(w);
        test::ok(dfm_world_restore(w, before.data(), before.size()));
        test::ok(dfm_world_step(w, kStep, nullptr));
        EXPECT_EQ(dfm_world_hash(w), hash) << model;
      }
      most = std::max(most, n);
    }
    EXPECT_GE(most, 4u) << model;
    EXPECT_LE(most, uint32_t(std::ceil(kReach / kLeastEdge))) << model;
    EXPECT_EQ(test::stats(w).last_substeps, 1u) << model;
    dfm_pose pose = dfm_obstacle_def_default().pose;
    for (int k = 1; k <= 120; ++k) {  // down, to 6 m/s at 4 m/s2, then on
      const double t = k * kStep, ramp = std::min(t, 1.5);
      pose.position[2] = -(2 * ramp * ramp + 6 * (t - ramp));
      test::ok(dfm_obstacle_move_to(floor, &pose));
      EXPECT_EQ(substeps_of_step(w), 1u) << model << ", step " << k;
    }
    EXPECT_NEAR(test::measure(body).velocity[2], -6, 0.2) << model;
  }
}

// Before there is any contact between them; not of two that fly together, nor of two that pass far away.
TEST(Substeps, OfBodiesThatMeetInAStep_AreTakenFromTheFirst) {
  for (const char *model : {"shape_matching", "modal"}) {
    test::Context context;
    const auto substeps = [&](double height, double of_lower) {
      const dfm_world w = test::make_world(context);
      fast_block(context, w, model, height, -kFall);
      fast_block(context, w, model, 0, of_lower);
      return substeps_of_step(w);
    };
    const uint32_t n = substeps(0.15, 0);
    EXPECT_GE(n, 4u) << model;
    EXPECT_LE(n, uint32_t(std::ceil(kReach / kLeastEdge))) << model;
    EXPECT_GE(substeps(0.25, kFall), 2 * n - 1) << model;
    EXPECT_EQ(substeps(0.15, -kFall), 1u) << model;
    EXPECT_EQ(substeps(1, 0), 1u) << model;
    const dfm_world w = test::make_world(context);  // a surfel has few contacts with a simple shape
    test::add_plane(w, "floor");
    fast_block(context, w, model, 0.05, -kFall);
    EXPECT_EQ(substeps_of_step(w), 1u) << model;
  }
}
