// The guard's question to detection: how far may a sub-step go. Bodies are boxes and spheres; ends are free
// motion, as if no contact held.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "../narrow/detect_scene.h"
#include "guard_scene.h"
#include "toi_support.h"

namespace {

using test::Scene;

// d_c, d_g and 0.1 (d_c - d_g) of surfaces with edges of 1 m
constexpr double kOffset = 1e-3, kFloor = 0.5e-3, kMargin = 0.05e-3;

struct Guard {
  Scene scene;
  std::vector<std::vector<double>> end;
  dfm::Array<dfm::GuardHit> hits;

  dfm::Surface &add(const test::Mesh &mesh) { return scene.add(mesh); }
  // Ends of body b: from x to f(x).
  template <class F>
  void move(size_t b, const F &f) {
    end.resize(std::max(end.size(), b + 1));
    const dfm::Surface &s = *scene.surfaces[b];
    end[b].assign(s.x.begin(), s.x.end());
    for (uint32_t i = 0; i < s.nsurfel; ++i) dfm::store3(&end[b][4 * i], f(dfm::load3(&s.x[4 * i])));
  }
  double safe() {
    const dfm::Array<dfm::Candidate> &all = scene.all();
    dfm::GuardScene requested = test::guard_scene(scene.bodies, end, kFloor, kMargin);
    std::vector<uint32_t> which(all.size());
    std::iota(which.begin(), which.end(), 0u);
    dfm::guard_pairs(requested, all, which, hits);
    double least = 1;
    for (const dfm::GuardHit &hit : hits) least = std::min(least, hit.safe);
    return least;
  }
  // Least distance of all pairs at t, by the tests' own arithmetic.
  double least(double t) const {
    test::Real best = HUGE_VALL;
    for (const dfm::Candidate &c : scene.all()) {
      const dfm::Surface &a = *scene.surfaces[c.slot_a], &b = *scene.surfaces[c.slot_b];
      test::ToiQuery q;
      q.edges = c.kind == dfm::kEdgeEdge;
      const auto vertex = [&](int k, uint32_t slot, uint32_t surfel) {
        for (int i = 0; i < 3; ++i) {
          q.m[k].p0[i] = scene.surfaces[slot]->x[4 * size_t{surfel} + size_t(i)];
          q.m[k].p1[i] = end[slot][4 * size_t{surfel} + size_t(i)];
        }
      };
      if (q.edges) {
        for (int k = 0; k < 2; ++k) {
          vertex(k, c.slot_a, a.edge[2 * size_t{c.feature_a} + size_t(k)]);
          vertex(2 + k, c.slot_b, b.edge[2 * size_t{c.feature_b} + size_t(k)]);
        }
      } else {
        vertex(0, c.slot_a, c.feature_a);
        for (int k = 0; k < 3; ++k) vertex(1 + k, c.slot_b, b.tri[3 * size_t{c.feature_b} + size_t(k)]);
      }
      best = std::min(best, test::distance_at(q, test::Real(t)));
    }
    return double(best);
  }
};

// A box of 1 m over another one, `gap` between them, which moves by `shift`.
Guard boxes(double gap, dfm::Vec3 shift, dfm::Vec3 at = {0.3, 0.2, 0}) {
  Guard g;
  g.add(test::box_mesh({1, 1, 1}, 2, 2, 2));
  g.add(test::moved(test::box_mesh({1, 1, 1}, 2, 2, 2), {}, dfm::Vec3{at.x, at.y, 1 + gap}));
  g.move(0, [](dfm::Vec3 x) { return x; });
  g.move(1, [&](dfm::Vec3 x) { return x + shift; });
  return g;
}

}  // namespace

TEST(ToiGuard, FallingBox_StopsAMarginAboveTheFloor) {
  Guard g = boxes(0.01, {0, 0, -0.02});
  const double safe = g.safe();
  ASSERT_FALSE(g.hits.empty());
  EXPECT_NEAR(safe, (0.01 - kFloor - kMargin) / 0.02, 1e-5);
  EXPECT_GE(g.least(safe), kFloor + kMargin);
  for (const dfm::GuardHit &hit : g.hits) {
    EXPECT_LE(hit.safe, hit.t);
    EXPECT_GE(hit.start, 0.01 - 1e-12);
  }
  EXPECT_NEAR(g.hits[0].t, (0.01 - kFloor) / 0.02, 1e-5);
}

TEST(ToiGuard, NothingComesNear_WholeStepIsSafe) {
  EXPECT_EQ(boxes(0.01, {0, 0, -0.009}).safe(), 1);
  EXPECT_EQ(boxes(0.01, {0, 0, 5}).safe(), 1);
  EXPECT_EQ(boxes(0.01, {50, 0, 0}).safe(), 1);
}

// Contacts at rest sit at d_c and may slide as far as they like; a first touch that the solve lets come to
// d_c does not trip either.
TEST(ToiGuard, RestAndSliding_DoNotTrip) {
  EXPECT_EQ(boxes(kOffset, {0, 0, 0}).safe(), 1);
  EXPECT_EQ(boxes(kOffset, {0.3, -0.2, 0}).safe(), 1);
  EXPECT_EQ(boxes(0.02, {0.1, 0, kOffset - 0.02}).safe(), 1);
  EXPECT_EQ(boxes(kFloor * 1.01, {0.3, -0.2, 0}).safe(), 1);
}

TEST(ToiGuard, InsideTheMargin_MovesOnInEitherDirection) {
  const double near = kFloor + 0.2 * kMargin;
  EXPECT_EQ(boxes(near, {0.1, 0, 0.01}).safe(), 1);
  Guard falling = boxes(near, {0, 0, -0.01});
  const double safe = falling.safe();
  EXPECT_GT(safe, 0);
  EXPECT_GE(falling.least(safe), kFloor);
}

TEST(ToiGuard, BelowTheFloor_MayRiseButNotPass) {
  EXPECT_EQ(boxes(0.2 * kFloor, {0, 0, 0.01}).safe(), 1);
  EXPECT_EQ(boxes(kFloor, {0, 0, 0.01}).safe(), 1);
  for (const double gap : {0.2 * kFloor, kFloor}) {
    Guard through = boxes(gap, {0, 0, -5});  // out on the other side, further away than before
    const double safe = through.safe();
    EXPECT_GT(safe, 0);
    EXPECT_LT(safe, 1e-3);
    EXPECT_GT(through.least(safe), 0.4 * gap);
  }
}

TEST(ToiGuard, ThinSheetAtAnySpeed_IsNotPassed) {
  for (const double speed : {1.0, 100.0, 1e4}) {
    Guard g;
    g.add(test::box_mesh({1, 1, 0.002}, 4, 4, 1));
    g.add(test::moved(test::sphere_mesh(0.02, 1), {}, dfm::Vec3{0.013, -0.021, 0.3}));
    g.move(0, [](dfm::Vec3 x) { return x; });
    g.move(1, [&](dfm::Vec3 x) { return x + dfm::Vec3{0, 0, -speed}; });
    const double safe = g.safe();
    EXPECT_NEAR(safe * speed, 0.3 - 0.02 - 0.001 - kFloor - kMargin, 1e-5);
    EXPECT_GE(g.least(safe), kFloor);
  }
}

// Tumbling and squeezed bodies: up to the safe time all distances keep the floor, and the answer does not
// waste the way there.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToiGuard, TumblingBodies_KeepTheFloorOnTheWholeWay) {
  test::Random random(5);
  int stopped = 0;
  for (int n = 0; n < 60; ++n) {
    Guard g;
    g.add(test::box_mesh({1, 0.6, 0.4}, 1, 1, 1));
    g.add(test::moved(test::sphere_mesh(0.4, 0),
                      test::turn({random.real(-1, 1), random.real(-1, 1), 1}, random.real(0, 6)),
                      dfm::Vec3{random.real(-1, 1), random.real(-1, 1), 0.9}));
    const dfm::Quat q = test::turn({random.real(-1, 1), 1, random.real(-1, 1)}, random.real(-1, 1));
    g.move(0, [&](dfm::Vec3 x) { return dfm::rotate(q, dfm::Vec3{1.2 * x.x, 0.8 * x.y, x.z}); });
    g.move(1, [&](dfm::Vec3 x) { return x + dfm::Vec3{0, 0, -1.5}; });
    const double safe = g.safe();
    for (int k = 0; k <= 16; ++k) ASSERT_GE(g.least(safe * k / 16), kFloor) << n;
    if (safe == 1) continue;
    ++stopped;
    EXPECT_NEAR(g.least(safe), kFloor + kMargin, 0.01 * kMargin) << n;
  }
  EXPECT_GT(stopped, 20);
}

// What may come to the floor, and what is remembered of the rest, while surfaces roll over each other and a
// plane, their lists are renewed, and a body turns its ends.
TEST(ToiGuard, NearPairsOnSeveralThreads_AreThoseOfOne) {
  for (const uint32_t threads : {2u, 3u, 8u}) {
    dfm::Tasks tasks(threads, nullptr, nullptr);
    Scene scene;
    scene.offset = 1e-3;
    const test::Mesh cylinder = test::cylinder_mesh(0.2, 1, 48, 40);
    scene.add(cylinder);
    scene.add(test::moved(cylinder, test::turn({0, 0, 1}, 0.02), {0.4012, 0.01, 0.003}));
    scene.add(dfm::Shape::plane, {0, 0, -0.0005});
    dfm::ListMemory memory[2];
    dfm::GuardBlocks blocks;
    dfm::Array<uint32_t> near[2];
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<std::vector<double>> mean;
    for (const auto &s : scene.surfaces) mean.push_back(std::vector<double>(s->x.size()));
    size_t found = 0;
    for (int step = 0; step < 25; ++step) {
      dfm::BroadPhase broad(dfm::Memory::standard());
      broad.set_skin_steps(double(1 + step % 7));
      broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
      const dfm::Array<dfm::Candidate> &list = broad.candidates();
      ASSERT_GT(list.size(), 2000u) << "too few for blocks";
      for (size_t b = 0; b < mean.size(); ++b)
        for (double &v : mean[b]) v = (step % 3) * 0.4 * normal(random);
      for (int k = 0; k < 2; ++k) {
        dfm::GuardScene requested;
        requested.bodies = scene.bodies;
        requested.obstacles = scene.obstacles;
        requested.poses = {{scene.obstacles[0].position, scene.obstacles[0].rotation}};
        requested.h = scene.h;
        requested.floor = kFloor;
        requested.margin = kMargin;
        requested.round = 1;
        for (size_t b = 0; b < mean.size(); ++b) {
          dfm::GuardSide side;
          side.surface = scene.bodies[b].surface;
          side.mean = mean[b].data();
          side.travel = side.spread = 3 * scene.h;
          side.stamp.assign(side.surface->nsurfel, 0);
          side.end.assign(size_t{4} * side.surface->nsurfel, 0.0);
          requested.sides.push_back(side);
        }
        requested.sides.emplace_back().still = true;
        memory[k].follow(list, k ? &tasks : nullptr);
        if (k) dfm::guard_near(requested, list, memory[k], near[k], &blocks, &tasks);
        else dfm::guard_near(requested, list, memory[k], near[k]);
        memory[k].keep();
      }
      ASSERT_EQ(near[0], near[1]) << threads << " threads, step " << step;
      ASSERT_EQ(memory[0].apart, memory[1].apart) << threads << " threads, step " << step;
      ASSERT_EQ(memory[0].normal, memory[1].normal) << threads << " threads, step " << step;
      found += near[0].size();
    }
    EXPECT_GT(found, 100u);
  }
}
