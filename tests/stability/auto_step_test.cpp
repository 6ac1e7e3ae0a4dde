// Steps of what dfm_world_stable_step answers, asked anew before each ("step": "auto"): they change rarely,
// and undamped bodies keep their energy. The whole study: tests/bench/step_study.cpp.
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
