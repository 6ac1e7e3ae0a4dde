// Scenes in which tools cut, and one that tears.
#include "scenes.h"

namespace {

// m, from the first to the last record.
double way(const test::SceneRun &run, const char *body, size_t axis) {
  const std::vector<test::BodyRow> rows = run.rows(body);
  return rows.back().com[axis] - rows[0].com[axis];
}

// One slice stays, the others fall to its sides.
bool in_three(const test::SceneRun &run) {
  std::vector<double> x;
  for (const char *body : {"orange", "orange.1", "orange.2"}) x.push_back(run.last(body).com[0]);
  std::sort(x.begin(), x.end());
  return x[0] < -0.025 && std::abs(x[1]) < 0.01 && x[2] > 0.025;
}
// Down the board.
bool both_slide(const test::SceneRun &run) {
  return way(run, "cheese.1", 0) > 0.05 && way(run, "cheese.2", 0) > 0.02;
}
// With the hand.
bool carried(const test::SceneRun &run) { return way(run, "liver.1", 0) > 0.01; }

constexpr const char *kHalfWay = "/tools/1/motion/keyframes/2/position=[0.015, 0, 0.06]";

}  // namespace

// soak: long; python.cut_scenes cuts with jittered paths
TEST(CutScenes, OrangeJitteredRuns_FallIntoThreeSlices) {
  test::expect_jittered("orange", 1, 10, {"--time", "0.6"}, 20, in_three);
}
// soak: long; python.cut_scenes cuts with jittered paths
TEST(CutScenes, CheeseJitteredRuns_LoseTwoSlices) {
  test::expect_jittered("cheese", 1, 10, {}, 20, both_slide);
}
// Held by friction alone.
// soak: long; python.cut_scenes cuts with jittered paths
TEST(CutScenes, LiverJitteredRuns_LobeIsPulled) {
  test::expect_jittered("liver", 1, 10, {"--time", "0.9"}, 20, [](const test::SceneRun &run) {
    const std::vector<test::BodyRow> rows = run.rows("liver");
    const auto closed = std::find_if(rows.begin(), rows.end(), [](auto &r) { return r.t > 0.699; });
    return closed != rows.end() && rows.back().com[0] - closed->com[0] > 1e-4;
  });
}
// Just cut, the two faces lie on each other to micrometers, which the count of crossings sees.
// soak: long; python.cut_scenes cuts with jittered paths
TEST(CutScenes, LiverCutJitteredRuns_LobeIsCarriedAway) {
  for (int seed = 1; seed <= (test::soaks() ? 10 : 3); ++seed) {
    const test::SceneRun run("liver", {"--time", "1.4", "--jitter", std::to_string(seed)});
    EXPECT_TRUE(run.finite());
    EXPECT_LE(run.number("intersections_max"), 60) << "seed " << seed;
    EXPECT_TRUE(carried(run)) << "seed " << seed;
  }
}
// soak: long; python.cut_scenes cuts all the way
TEST(CutScenes, LiverCutHalfWay_KeepsItsLobe) {
  const test::SceneRun run("liver", {"--time", "1.1", "--set", kHalfWay});
  EXPECT_TRUE(run.finite());
  EXPECT_FALSE(run.has("liver.1"));
}
// Every step is checked: the lips of its slits cross by less than what counts (doc/decisions/cutting.md).
// soak: long; python.cut_scenes cuts with jittered paths
TEST(CutScenes, TornDoughJitteredRuns_FallOnTheTable) {
  for (int seed = 1; seed <= (test::soaks() ? 10 : 3); ++seed) {
    const test::SceneRun run("torn_dough", {"--check", "--jitter", std::to_string(seed)});
    EXPECT_TRUE(run.finite());
    EXPECT_EQ(run.number("intersections_max"), 0) << "seed " << seed;
    EXPECT_LT(way(run, "dough", 2), -0.08) << "seed " << seed;
  }
  const test::SceneRun whole("torn_dough", {"--time", "0.6", "--set", "/materials/dough/tear=10"});
  EXPECT_GT(way(whole, "dough", 2), -0.05);
}
