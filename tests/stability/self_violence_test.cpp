// Bodies that are struck so hard that their surface would pass through itself: above the speed of waves in
// them, which is 32 m/s here.
#include "cells.h"
#include "shot.h"

namespace {

using test::Shot;

// A body of 10 cm thrown at a plane.
void throw_at_plane(Shot &s, const char *kind, std::array<double, 3> size, uint32_t cells, double speed) {
  test::add_plane(s.world, "wall");
  const double turn = s.jitter(0.02);
  s.add(kind, size, cells, {0, 0, 0.053}, {0, 0, -speed}, {turn, 0, 0, std::sqrt(1 - turn * turn)});
}
void ball(Shot &s, double speed) { throw_at_plane(s, "ball", {0.05, 0, 0}, 300, speed); }
void cube(Shot &s, double speed) { throw_at_plane(s, "beam", {0.1, 0.1, 0.1}, 300, speed); }

// crossings with itself, summed over the steps; J, most kinetic energy against the first
struct Struck {
  size_t crossed = 0;
  double energy = 0, lost = 0;
};
Struck strike(const std::function<void(Shot &, double)> &setup, double speed, uint32_t self, unsigned seed,
              bool guarded = true) {
  Shot s(guarded, seed, 1, self);
  setup(s, speed);
  const double first = test::measure(s.bodies[0]).kinetic;
  Struck out;
  for (int i = 0; i < 10; ++i) {
    uint32_t trouble = 0;
    EXPECT_EQ(dfm_world_step(s.world, 1e-3, &trouble), DFM_OK) << dfm_last_error();
    const crossing::Found found = s.count();
    EXPECT_EQ(found.between, 0u);
    out.crossed += found.within;
    out.energy = std::max(out.energy, test::measure(s.bodies[0]).kinetic / first);
  }
  const dfm_world_stats now = test::stats(s.world);
  out.lost = now.guard_lost;
  std::printf("%g m/s, self %u, seed %u: %zu crossings, %g sub-steps, %g solves, %g cuts, %g s lost\n", speed,
              self, seed, out.crossed, double(now.substeps), double(now.guard_solves), double(now.guard_cuts),
              now.guard_lost);
  return out;
}

void stays_whole(const std::function<void(Shot &, double)> &setup, double speed, double lost) {
  size_t without = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Struck on = strike(setup, speed, 1, seed);
    EXPECT_EQ(on.crossed, 0u) << "seed " << seed;
    EXPECT_LE(on.energy, 1 + 1e-12) << "seed " << seed
                                    << ": contact of a body with itself gives it no energy";
    EXPECT_LE(on.lost, lost) << "seed " << seed;
    without += strike(setup, speed, 0, seed).crossed;
  }
  EXPECT_GT(without, 0u) << "the scene does not need self contact";
}

}  // namespace

TEST(SelfViolence, BallAt50MetersPerSecond_NeverCrossesItself) { stays_whole(ball, 50, 5e-4); }
TEST(SelfViolence, CubeAt50MetersPerSecond_NeverCrossesItself) { stays_whole(cube, 50, 5e-4); }
TEST(SelfViolence, BallAt80MetersPerSecond_NeverCrossesItself) { stays_whole(ball, 80, 2e-3); }
