// Two filled rabbits on a slope of 12 degrees, the lower one thrown at 1 m/s from under the upper one, which
// comes down on its ears: surfaces with many surfels on few points, where thin parts meet.
#include "shot.h"

namespace {

struct Rabbits {
  test::Context context;
  dfm_scene scene = 0;
  dfm_world world = 0;
  dfm_body body[2] = {};
  std::vector<uint32_t> triangles[2];
  double step = 0;

  Rabbits(bool guarded, uint64_t seed) {
    const char *const set[] = {guarded ? "/contact/guard=true" : "/contact/guard=false"};
    const dfm_scene_options options = {sizeof options, 1, set, seed};
    test::ok(
        dfm_scene_open(context, DEFORM_SOURCE_DIR "/examples/scenes/rabbits_slope.json", &options, &scene));
    test::ok(dfm_scene_world(scene, &world));
    dfm_scene_settings settings{};
    settings.size = sizeof settings;
    test::ok(dfm_scene_get_settings(scene, &settings));
    step = settings.step;
    test::ok(dfm_world_find_body(world, "lower", &body[0]));
    test::ok(dfm_world_find_body(world, "upper", &body[1]));
    for (int k = 0; k < 2; ++k) triangles[k] = test::surface_triangles(body[k]);
  }
  ~Rabbits() { dfm_scene_close(scene); }

  size_t crossings() const {
    std::vector<double> x[2];
    std::vector<crossing::Surface> both;
    for (int k = 0; k < 2; ++k) {
      x[k] = test::surface_positions(body[k]);
      both.push_back(
          {x[k].data(), uint32_t(x[k].size() / 3), triangles[k].data(), uint32_t(triangles[k].size() / 3)});
    }
    return crossing::Counter().count(both, crossing::Touching::counts).between;
  }
  size_t run(double from, double to) {  // counted from `from` on; before it they fall
    size_t crossed = 0;
    for (long i = 1; double(i) * step <= to; ++i) {
      uint32_t trouble = 0;
      EXPECT_EQ(dfm_world_step(world, step, &trouble), DFM_OK) << dfm_last_error();
      if (double(i) * step >= from && i % 4 == 0) crossed += crossings();
    }
    return crossed;
  }
};

void run_seeds(uint64_t seed, uint64_t last) {
  size_t without = 0;
  uint64_t acted = 0;
  for (; seed <= last; ++seed) {
    Rabbits guarded(true, seed), bare(false, seed);
    ASSERT_EQ(guarded.crossings(), 0u);
    EXPECT_EQ(guarded.run(0.16, 0.205), 0u) << "seed " << seed;
    const dfm_world_stats stats = test::stats(guarded.world);
    EXPECT_EQ(stats.guard_lost, 0) << "seed " << seed;
    EXPECT_GT(stats.contacts_max, 3u);
    acted += stats.guard_steps;
    without += bare.run(0.16, 0.205);
  }
  EXPECT_GT(acted, 0u);
  EXPECT_GT(without, 0u) << "the scene does not need the guard";
}

}  // namespace

TEST(Guard, RabbitsJittered1To3_NeverCross) { run_seeds(1, 3); }
TEST(Guard, RabbitsJittered4To6_NeverCross) { run_seeds(4, 6); }
TEST(Guard, RabbitsJittered7To8_NeverCross) { run_seeds(7, 8); }
TEST(Guard, RabbitsJittered9To10_NeverCross) { run_seeds(9, 10); }
