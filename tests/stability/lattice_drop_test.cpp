// An organ and a rabbit of a few hexahedra each, dropped on a floor by their fine surfaces.
#include "scenes.h"

namespace {

bool stand(const test::SceneRun &run) {
  bool there = true;
  for (const char *body : {"organ", "rabbit"}) {
    const test::BodyRow row = run.last(body);
    there = there && row.com[2] > 0.03 && row.com[2] < 0.07 && std::fabs(row.com[1]) < 0.1;
  }
  return there;
}

const std::vector<std::string> kLanding = {"--time", "0.6"};

}  // namespace

TEST(LatticeDrop, Bodies_LandAndKeepTheirVolumeWithoutCrossing) {
  const test::SceneRun run("lattice_drop", {});
  run.expect_valid(8, "lattices");
  EXPECT_TRUE(stand(run));
  double kinetic = 0;
  for (const char *body : {"organ", "rabbit"}) {
    kinetic += run.last(body).kinetic;
    EXPECT_NEAR(run.last(body).volume, run.rows(body).front().volume, 0.02 * run.last(body).volume) << body;
  }
  EXPECT_LT(kinetic, 5e-3) << "joule; the drop is worth 2";
}

// soak: long, and a jittered run of what another test runs
TEST(LatticeDrop, JitteredRuns_DoNotCross) {
  test::expect_jittered("lattice_drop", 1, 10, kLanding, 8, stand);
}
