// Blocks of the models modal, condensed and corotational_fem beside each other on a slope.
#include "scenes.h"

namespace {

// Micrometers per second, while they still settle.
bool holds(const test::SceneRun &run) { return run.creep_um_per_s() < 20; }

}  // namespace

TEST(ReducedModels, BlocksOnASlope_LeanAsTheirModelsLetThem) {
  // how far they slide as they land depends on the sub-step, of which the models choose different ones
  const test::SceneRun run("reduced_models", {"--set", "/time/step=0.00025"});
  run.expect_valid(30, "condensed");
  EXPECT_TRUE(holds(run)) << run.creep_um_per_s();
  const double modal = run.last("modal").com[0], condensed = run.last("condensed").com[0],
               full = run.last("full").com[0];
  EXPECT_NEAR(condensed, full, 1e-4);
  EXPECT_LT(modal, full - 4e-4) << "forty modes do not hold all of a dent";
  EXPECT_GT(modal, 0.051);
}

TEST(ReducedModels, TooLittleFriction_Slides) {
  const test::SceneRun run("reduced_models", {"--set", "/contact/friction/0/params/mu=0.3"});
  for (const char *body : {"modal", "condensed", "full"}) EXPECT_GT(run.last(body).com[0], 0.07) << body;
}

TEST(ReducedModels, JitteredRuns_Hold) { test::expect_jittered("reduced_models", 1, 10, {}, 30, holds); }
