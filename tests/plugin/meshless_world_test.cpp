// The model meshless in a world: explicit and implicit, on floors and slopes, under every law, against other
// models, filled from a surface, restored, at rest under a load beside the beam's closed form.
#include <sstream>

#include "block_world.h"

namespace {

constexpr double kStep = 2e-3;

using test::tilted;
struct World : test::BlockWorld {
  World(const char *law, int32_t integrator, std::array<double, 3> gravity = {0, 0, -9.81}, double z = 1e-4)
      : BlockWorld({"meshless", law, gravity, z, integrator, 2e5, 2e-3}) {}
};
constexpr int32_t kIntegrators[] = {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(MeshlessWorld, DroppedBlock_RestsAndWeighsWhatItWeighs) {
  for (const int32_t integrator : kIntegrators) {
    World w("coulomb", integrator, {0, 0, -9.81}, 0.05);
    test::run(w.world, 1.5, kStep);
    const dfm_body_measure m = test::measure(w.body);
    EXPECT_LT(m.speed_max, 1e-5) << integrator;
    EXPECT_NEAR(m.com[2], 0.05, 1e-3) << integrator;
    test::expect_weight(w, 1e-4);
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(MeshlessWorld, SlopeBelowTheLimit_HoldsUnderEveryLawWithStiction) {
  for (const char *law : {"coulomb", "karnopp", "elastoplastic", "gms"}) {
    World w(law, DFM_INTEGRATOR_IMPLICIT_EULER, tilted(0.2));
    test::run(w.world, 0.6, 2 * kStep);
    const double x = test::measure(w.body).com[0];
    test::run(w.world, 0.2, kStep);
    EXPECT_LT(std::abs(test::measure(w.body).com[0] - x), 1e-6) << law;
  }
}

TEST(MeshlessWorld, EveryLaw_StaysOnTheSlope) {
  for (const char *law : {"none", "coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"}) {
    World w(law, DFM_INTEGRATOR_SYMPLECTIC_EULER, tilted(0.2));
    test::run(w.world, 0.25, kStep);
    const dfm_body_measure m = test::measure(w.body);
    EXPECT_NEAR(m.com[2], 0.05, 0.002) << law;
    if (std::string(law) == "none") EXPECT_NEAR(m.com[0] - 0.1, 0.061, 0.005);
    else EXPECT_LT(m.com[0] - 0.1, 0.005) << law;
  }
}

TEST(MeshlessWorld, CollisionWithEveryModel_KeepsMomentum) {
  test::Block block{"meshless"};
  block.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  for (const char *other : {"meshless", "msm", "shape_matching"})
    test::expect_collision_keeps_momentum(block, other, 0.1);
}

TEST(MeshlessWorld, BlockAtRest_FallsAsleep) {
  World w("coulomb", DFM_INTEGRATOR_IMPLICIT_EULER);
  test::ok(dfm_world_set_sleep(w.world, true));
  bool asleep = false;
  for (int n = 0; n < 2000 && !asleep; ++n) {
    ASSERT_EQ(dfm_world_step(w.world, kStep, nullptr), DFM_OK) << dfm_last_error();
    test::ok(dfm_body_is_asleep(w.body, &asleep));
  }
  EXPECT_TRUE(asleep);
}

TEST(MeshlessWorld, SnapshotInContact_ContinuesWithTheSameBits) {
  World a("lugre", DFM_INTEGRATOR_AUTO, {0, 0, -9.81}, 0.01),
      b("lugre", DFM_INTEGRATOR_AUTO, {0, 0, -9.81}, 0.01);
  test::run(a.world, 0.1, kStep);
  EXPECT_GT(test::stats(a.world).contacts, 0u);
  const std::string saved = test::snapshot(a.world);
  test::ok(dfm_world_restore(b.world, saved.data(), saved.size()));
  test::run(a.world, 0.05, kStep);
  test::run(b.world, 0.05, kStep);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}

// Points of the lattice that fills a surface, which hangs on them.
// unsanitized: too slow there; shorter tests run the same code
TEST(MeshlessWorld, DemoScenes_MeetTheirCriteria) {
  test::expect_valid_demo("slope_block", "meshless", 0.4, 0);
  for (const char *scene : {"ball_incline", "two_materials", "fill_drop"})
    test::expect_valid_demo(scene, "meshless", 0.01, 0);
}

// w L^3/(E I) = 0.1 at poisson 0.3: the sag of Timoshenko's beam is 0.0126 L. Where linear tetrahedra of the
// same 426 points give 0.78 of it, this gives 1.05.
TEST(MeshlessWorld, ClampedBarUnderItsWeight_SagsWithinSixPercent) {
  const auto sag = [](const std::string &model) {
    const std::string path = test::scratch("meshless_bar") + ".json", out = test::scratch("meshless_bar_out");
    test::write_file(path, R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
      "time": {"mode": "static", "duration": 1, "step": 1},
      "materials": {"bar": {"density": 1000, "young": 117720000, "poisson": 0.3}},
      "bodies": [{"name": "bar", "mesh": {"make": "beam", "size": [1, 0.1, 0.1], "cells": 1620},
        "material": "bar", "model": {"type": ")" +
                               model + R"("},
        "fix": [{"box": [[-1e-6, -1, -1], [1e-6, 1, 1]]}]}],
      "probes": [{"name": "tip", "body": "bar", "point": [1, 0.05, 0.05]}], "output": {"every": 1}})");
    const test::CommandResult result = test::deform({"run", path, "--out", out, "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::stringstream rows(test::read_file(out + "/probes.csv"));
    std::string row, field;
    std::vector<double> z;
    std::getline(rows, row);
    while (std::getline(rows, row)) {
      std::stringstream fields(row);
      for (int k = 0; k < 5; ++k) std::getline(fields, field, ',');
      z.push_back(std::stod(field));
    }
    return z.empty() ? 0 : z.front() - z.back();
  };
  const double beam = 0.1 / 8 * 1.0078;
  EXPECT_NEAR(sag("meshless") / beam, 1.05, 0.01);
  EXPECT_NEAR(sag("corotational_fem") / beam, 0.776, 0.01);
}
