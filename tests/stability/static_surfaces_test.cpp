// Soft bodies on static surfaces: an open terrain of triangles, and a closed, folded basin as voxels. Nothing
// sinks in, nothing passes, and everything comes to rest inside.
#include "scenes.h"

namespace {

bool lies(const test::SceneRun &run, std::initializer_list<const char *> bodies, double half_width,
          double low, double high) {
  bool good = true;
  for (const char *body : bodies) {
    const test::BodyRow row = run.last(body);
    good = good && std::hypot(row.com[0], row.com[1]) < half_width && row.com[2] > low && row.com[2] < high;
  }
  return good;
}
bool in_the_dale(const test::SceneRun &run) {
  return lies(run, {"ball1", "ball2", "bar", "block"}, 0.8, 0.02, 0.6);
}
bool in_the_basin(const test::SceneRun &run) { return lies(run, {"ball", "bar", "block"}, 0.4, 0.05, 0.3); }

const std::string kNoDale = R"(/contact/filter=[{"between": ["dale", "*"]}])",
                  kNoBasin = R"(/contact/filter=[{"between": ["basin", "*"]}])";
const std::vector<std::string> kShort = {"--time", "1.2", "--set", "/output/every=0.01"};

}  // namespace

TEST(Terrain, BodiesDropped_ComeToRestWithoutCrossing) {
  const test::SceneRun run("terrain", {"--time", "4", "--set", "/output/every=0.02"});
  run.expect_valid(15, "terrain");
  EXPECT_TRUE(in_the_dale(run));
  double kinetic = 0;
  for (const char *body : {"ball1", "ball2", "bar", "block"}) kinetic += run.last(body).kinetic;
  EXPECT_LT(kinetic, 0.02) << "joule; the drop is worth 25";
}

// The check must see triangles of obstacles too, or the runs above prove nothing.
TEST(Terrain, ThatLetsThrough_IsCrossed) {
  const test::SceneRun run("terrain", {"--time", "0.5", "--set", "/output/every=0.02", "--set", kNoDale});
  EXPECT_GT(run.number("intersections_max"), 10);
  EXPECT_FALSE(in_the_dale(run));
}

// soak: long, and a jittered run of what another test runs
TEST(Terrain, JitteredRuns_DoNotCross) { test::expect_jittered("terrain", 1, 10, kShort, 12, in_the_dale); }

TEST(Basin, BodiesDropped_LieInTheVoxels) {
  const test::SceneRun run("basin", {"--time", "3", "--set", "/output/every=0.02"});
  run.expect_valid(12, "basin");
  EXPECT_TRUE(in_the_basin(run));
}

TEST(Basin, ThatLetsThrough_HoldsNothing) {
  const test::SceneRun run("basin", {"--time", "0.5", "--set", "/output/every=0.02", "--set", kNoBasin});
  EXPECT_GT(run.number("intersections_max"), 10) << "voxels are counted, too";
  EXPECT_FALSE(in_the_basin(run));
}

// The same surface as triangles: a body lies where it lies on the voxels, but for what the cells round off.
// Drag stops the ball within the two seconds; without it it still rolls to and fro by 50 mm, and what is
// compared is when it turned.
TEST(Basin, AsTriangles_HoldsTheBallInTheSamePlace) {
  const std::string alone =
      R"(/contact/filter=[{"between": ["ball", "bar"]}, {"between": ["ball", "block"]}])";
  const std::string triangles =
      R"(/obstacles/0={"name": "basin", "shape": "mesh", "mesh": "../data/basin.obj"})";
  const std::string drag = "/materials/jelly/damping/mass=6";
  const test::SceneRun voxels("basin", {"--time", "2", "--set", alone, "--set", drag});
  const test::SceneRun mesh("basin", {"--time", "2", "--set", alone, "--set", drag, "--set", triangles});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(voxels.last("ball").com[k], mesh.last("ball").com[k], 0.005);
  const test::SceneRun together("basin",
                                {"--time", "1.2", "--set", "/output/every=0.01", "--set", triangles});
  together.expect_valid(10, "basin of triangles");
  EXPECT_TRUE(in_the_basin(together));
}

// soak: long, and a jittered run of what another test runs
TEST(Basin, JitteredRuns_StayInside) { test::expect_jittered("basin", 1, 10, kShort, 8, in_the_basin); }
