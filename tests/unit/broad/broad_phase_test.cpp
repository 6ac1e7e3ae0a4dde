#include <gtest/gtest.h>

#include <atomic>

#include "../narrow/detect_scene.h"
#include "body/obstacle_mesh.h"
#include "geometry/bulge.h"
#include "geometry/closest.h"

namespace {

using namespace dfm;
using namespace test;

void deform_at_random(Surface &s, std::mt19937 &random, double by, double speed) {
  std::normal_distribution<double> normal;
  for (uint32_t i = 0; i < s.nsurfel; ++i)
    for (int k = 0; k < 3; ++k) {
      s.x[4 * i + k] += by * normal(random);
      s.v[4 * i + k] = speed * normal(random);
    }
}

Quat random_turn(std::mt19937 &random) {
  std::normal_distribution<double> normal;
  const Vec3 axis{normal(random), normal(random), normal(random)};  // in this order with every compiler
  return turn(axis, 3 * normal(random));
}

// Spheres, boxes and needles, thrown together, deformed and moving, among all kinds of obstacles.
Scene random_scene(unsigned seed, double speed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Scene scene;
  scene.offset = 1e-4;
  const Mesh meshes[4] = {sphere_mesh(0.3, 2), box_mesh({0.5, 0.4, 0.3}, 4, 3, 2),
                          box_mesh({1, 0.01, 0.02}, 12, 1, 1), sphere_mesh(0.2, 1)};
  for (const Mesh &m : meshes) {
    const Quat q = random_turn(random);
    Surface &s = scene.add(moved(m, q, 0.4 * Vec3{unit(random), unit(random), unit(random)}));
    if (seed % 4 < 2) make_bulges(s, 60);
    deform_at_random(s, random, 0.004, speed);
  }
  scene.add(Shape::plane, {0, 0, -0.4}, turn({1, 0, 0}, 0.2));
  ObstacleView &ball = scene.add(Shape::sphere, {0.4, 0.1, 0.2});
  ball.radius = 0.15;
  ball.velocity = speed * Vec3{1, 0, 0};
  ObstacleView &box = scene.add(Shape::box, {-0.3, 0.2, 0.1}, random_turn(random));
  box.half_size = {0.2, 0.05, 0.1};
  box.spin = speed * Vec3{0, 1, 2};
  ObstacleView &capsule = scene.add(Shape::capsule, {0, -0.3, 0}, random_turn(random));
  capsule.radius = 0.05;
  capsule.half_length = 0.3;
  capsule.spin = speed * Vec3{1, 1, 0};
  return scene;
}

void advance(Scene &scene, std::mt19937 &random, double shake) {
  std::normal_distribution<double> normal;
  for (auto &s : scene.surfaces)
    for (uint32_t i = 0; i < s->nsurfel; ++i)
      for (int k = 0; k < 3; ++k) {
        s->x[4 * i + k] += scene.h * s->v[4 * i + k];
        s->v[4 * i + k] += shake * normal(random);
      }
  for (ObstacleView &o : scene.obstacles) {
    o.position += scene.h * o.velocity;
    const double w = norm(o.spin);
    if (w > 0) o.rotation = turn(o.spin, scene.h * w) * o.rotation;
  }
}

TEST(BroadPhase, RandomScenes_ListEveryPairInReach) {
  size_t found = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    Scene scene = random_scene(seed, seed % 2 ? 0.2 : 4);
    BroadPhase broad(Memory::standard());
    EXPECT_TRUE(broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset));
    const auto brute = scene.contacts(), listed = scene.contacts(broad.candidates());
    EXPECT_EQ(flaw(scene, brute), "");
    EXPECT_TRUE(same_bits(brute, listed))
        << "seed " << seed << ": " << brute.size() << " and " << listed.size();
    found += brute.size();
    EXPECT_LT(broad.candidates().size(), scene.all().size() / (seed % 2 ? 10 : 2))
        << "slow scenes have short lists";
  }
  EXPECT_GT(found, 300u);
}

// Candidates as sets: whatever is nearer than the guaranteed range is listed, whether it becomes a
// contact or not.
TEST(BroadPhase, PairsNearerThanReach_AreCandidates) {
  Scene scene = random_scene(11, 2);
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  const auto before = [](const Candidate &l, const Candidate &r) {
    return std::tie(l.obstacle, l.slot_a, l.slot_b, l.kind, l.feature_a, l.feature_b) <
           std::tie(r.obstacle, r.slot_a, r.slot_b, r.kind, r.feature_a, r.feature_b);
  };
  std::vector<Candidate> listed(broad.candidates().begin(), broad.candidates().end());
  std::sort(listed.begin(), listed.end(), before);
  const auto twice = [&](const Candidate &l, const Candidate &r) { return !before(l, r); };
  EXPECT_EQ(std::adjacent_find(listed.begin(), listed.end(), twice), listed.end())
      << "a pair is listed twice";
  size_t near = 0;
  for (const Candidate &c : scene.all()) {
    if (c.obstacle) continue;
    const Surface &a = *scene.bodies[c.slot_a].surface, &b = *scene.bodies[c.slot_b].surface;
    const auto xa = [&](uint32_t s) { return load3(&a.x[4 * s]); };
    const auto xb = [&](uint32_t s) { return load3(&b.x[4 * s]); };
    double d2;
    if (c.kind == 0) {
      const uint32_t *t = &b.tri[3 * c.feature_b];
      d2 = closest_on_triangle(xa(c.feature_a), xb(t[0]), xb(t[1]), xb(t[2])).distance2;
    } else {
      const uint32_t *e = &a.edge[2 * c.feature_a], *f = &b.edge[2 * c.feature_b];
      d2 = closest_segments(xa(e[0]), xa(e[1]), xb(f[0]), xb(f[1])).distance2;
    }
    double va = 0, vb = 0;
    for (uint32_t s = 0; s < a.nsurfel; ++s) va = std::max(va, norm(load3(&a.v[4 * s])));
    for (uint32_t s = 0; s < b.nsurfel; ++s) vb = std::max(vb, norm(load3(&b.v[4 * s])));
    const double reach = contact_reach(scene.h, scene.offset, va + vb);
    if (std::sqrt(d2) >= (c.kind == 0 ? std::max(reach, recovery_depth(b)) : reach)) continue;
    ++near;
    EXPECT_TRUE(std::binary_search(listed.begin(), listed.end(), c, before));
  }
  EXPECT_GT(near, 100u);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(BroadPhase, MovingScene_ReusedListsMissNothing) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Scene scene = random_scene(seed, 0);
    scene.h = 1e-3;
    std::mt19937 random(seed);
    for (size_t b = 0; b < scene.bodies.size(); ++b) {  // each flies and spins as a whole
      const Vec3 fly = 0.3 * Vec3{double(b % 2), double(b / 2), 1.0 - double(b)};
      const Vec3 spin{1, double(b) - 1.5, 0.5};
      Surface &s = *scene.surfaces[b];
      for (uint32_t i = 0; i < s.nsurfel; ++i) store3(&s.v[4 * i], fly + cross(spin, load3(&s.x[4 * i])));
    }
    scene.obstacles[2].spin = {0, 1, 2};
    scene.obstacles[3].velocity = {0.2, 0.3, 0.1};
    BroadPhase broad(Memory::standard());
    size_t found = 0;
    for (int step = 0; step < 200; ++step) {
      broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
      if (step % 5) {
        advance(scene, random, 0);
        continue;
      }
      const auto brute = scene.contacts();
      ASSERT_TRUE(same_bits(brute, scene.contacts(broad.candidates())))
          << "seed " << seed << " step " << step;
      found += brute.size();
      advance(scene, random, 0);
    }
    EXPECT_GT(found, 500u);
    EXPECT_LT(broad.stats().renewals, 150u);
  }
}

TEST(BroadPhase, TwoSkinHistories_GiveTheSameBits) {
  Scene scene = random_scene(5, 1);
  scene.h = 2e-4;
  std::mt19937 random(5), whim(6);
  BroadPhase one(Memory::standard()), two(Memory::standard());
  two.set_skin_steps(3);
  for (int step = 0; step < 60; ++step) {
    if (whim() % 5 == 0) two.clear();
    two.set_skin_steps(double(1 + whim() % 40));
    one.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    two.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    ASSERT_TRUE(same_bits(scene.contacts(one.candidates()), scene.contacts(two.candidates())))
        << "step " << step;
    advance(scene, random, 0.02);
  }
  EXPECT_NE(one.stats().renewals, two.stats().renewals);
}

TEST(BroadPhase, PairsOnSeveralThreads_AreThoseOfOne) {
  for (const uint32_t threads : {2u, 3u, 8u}) {
    Tasks tasks(threads, nullptr, nullptr);
    Scene scene = random_scene(11, 1);
    scene.h = 2e-4;
    std::mt19937 random(11);
    BroadPhase one(Memory::standard()), many(Memory::standard());
    size_t found = 0;
    for (int step = 0; step < 60; ++step) {
      EXPECT_EQ(one.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset),
                many.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset, &tasks));
      const auto &a = one.candidates(), &b = many.candidates();
      ASSERT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end(),
                             [](const Candidate &l, const Candidate &r) {
                               return l.slot_a == r.slot_a && l.slot_b == r.slot_b &&
                                      l.feature_a == r.feature_a && l.feature_b == r.feature_b &&
                                      l.kind == r.kind && l.obstacle == r.obstacle;
                             }))
          << threads << " threads, step " << step;
      found += a.size();
      advance(scene, random, 0.02);
    }
    EXPECT_GT(found, 1000u);
    EXPECT_EQ(one.stats().renewals, many.stats().renewals);
    EXPECT_EQ(one.stats().refits, many.stats().refits);
    EXPECT_EQ(one.stats().rebuilds, many.stats().rebuilds);
  }
}

// A host's loop that runs blocks from the last to the first, and how many of them the largest job had.
void backwards(void *user, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t), void *task) {
  const uint32_t blocks = (n + grain - 1) / grain;
  uint32_t &most = *static_cast<uint32_t *>(user);
  most = std::max(most, blocks);
  for (uint32_t k = blocks; k-- > 0;) fn(task, k * grain, std::min(n, (k + 1) * grain));
}

TEST(BroadPhase, OnePairOfSurfaces_IsListedInParts) {
  Scene scene;
  scene.offset = 1e-4;
  std::mt19937 random(1);
  for (const double x : {0.0, 0.598})
    deform_at_random(scene.add(moved(sphere_mesh(0.3, 3), random_turn(random), Vec3{x, 0, 0})), random, 0.001,
                     1);
  uint32_t most = 0;
  Tasks tasks(1, backwards, &most);
  BroadPhase one(Memory::standard()), many(Memory::standard());
  one.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  many.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset, &tasks);
  EXPECT_GT(one.candidates().size(), 20u);
  EXPECT_GT(most, 2u) << "the bodies alone are two blocks";
  EXPECT_TRUE(same_bits(scene.contacts(one.candidates()), scene.contacts(many.candidates())));
  ASSERT_EQ(one.candidates().size(), many.candidates().size());
  for (size_t i = 0; i < one.candidates().size(); ++i) {
    const Candidate &l = one.candidates()[i], &r = many.candidates()[i];
    EXPECT_TRUE(l.feature_a == r.feature_a && l.feature_b == r.feature_b && l.kind == r.kind) << i;
  }
}

// A small surface on a large one: most of the large one is far away, and the small one is a few leaves.
TEST(BoxTree, NodesThatAreNear_HoldEachNearPairOnce) {
  Scene scene;
  scene.add(moved(sphere_mesh(0.05, 1), Quat{}, Vec3{0.35, 0, 0}));
  scene.add(moved(sphere_mesh(0.3, 3), Quat{}, Vec3{}));
  BoxTree small(Memory::standard()), large(Memory::standard());
  small.build(scene.bodies[0].surface->tri, scene.bodies[0].surface->x.data());
  large.build(scene.bodies[1].surface->tri, scene.bodies[1].surface->x.data());
  Array<PairOfTriangles> stack{HookAllocator<PairOfTriangles>(Memory::standard())}, nodes = stack;
  for (const double margin : {0.001, 0.05, 10.0}) {
    std::vector<std::pair<uint32_t, uint32_t>> whole, parts;
    near_pairs(small, large, margin, stack, [&](uint32_t p, uint32_t q, double) { whole.push_back({p, q}); });
    near_nodes(small, large, margin, 16, nodes);
    EXPECT_GE(nodes.size(), 16u) << margin;
    for (const PairOfTriangles from : nodes) {
      const size_t before = parts.size();
      near_pairs(
          small, large, margin, stack, [&](uint32_t p, uint32_t q, double) { parts.push_back({p, q}); },
          from);
      EXPECT_LT(2 * (parts.size() - before), whole.size() + 2) << "one part has most of the pairs";
    }
    std::sort(whole.begin(), whole.end());
    std::sort(parts.begin(), parts.end());
    EXPECT_FALSE(whole.empty());
    EXPECT_EQ(parts, whole) << margin;
  }
}

TEST(BroadPhase, PairWithoutMemoryOnTwoThreads_ThrowsInTheCaller) {
  Scene scene = random_scene(12, 1);
  static std::atomic<bool> refuses;
  refuses = false;
  Memory memory = Memory::standard();
  memory.alloc = [](void *user, size_t bytes, size_t align) -> void * {
    return refuses ? nullptr : Memory::standard().alloc(user, bytes, align);
  };
  BroadPhase broad(memory);
  Tasks tasks(2, nullptr, nullptr);
  broad.update({}, {}, scene.filter, scene.h, scene.offset, &tasks);
  refuses = true;
  EXPECT_THROW(broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset, &tasks),
               std::bad_alloc);
  refuses = false;
  broad.clear();
  EXPECT_TRUE(broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset, &tasks));
}

// Pairs come in the order of ids at every step, whether a list is kept or made anew, and whatever order the
// bodies are handed over in: the order of contacts, of the solve and of the report rests on it.
TEST(BroadPhase, Pairs_KeepTheOrderOfIds) {
  Scene scene = random_scene(9, 1);
  scene.h = 2e-4;
  std::mt19937 random(9);
  BroadPhase forward(Memory::standard()), backward(Memory::standard());
  uint64_t kept = 0, pairs = 0;
  for (int step = 0; step < 80; ++step) {
    const uint64_t before = forward.stats().renewals;
    forward.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    kept += forward.stats().renewals == before;
    const Array<Candidate> &list = forward.candidates();
    const auto key = [&](const Candidate &c) {
      const uint64_t id_b = c.obstacle ? scene.obstacles[c.slot_b].id : scene.bodies[c.slot_b].id;
      return std::array<uint64_t, 6>{
          scene.bodies[c.slot_a].id, c.obstacle, id_b, c.kind, c.feature_a, c.feature_b};
    };
    for (size_t i = 1; i < list.size(); ++i)
      ASSERT_LT(key(list[i - 1]), key(list[i])) << "step " << step << ", place " << i;
    std::vector<BodyView> bodies(scene.bodies.rbegin(), scene.bodies.rend());
    std::vector<ObstacleView> obstacles(scene.obstacles.rbegin(), scene.obstacles.rend());
    backward.update(bodies, obstacles, scene.filter, scene.h, scene.offset);
    const Array<Candidate> &other = backward.candidates();
    ASSERT_EQ(list.size(), other.size());
    for (size_t i = 0; i < list.size(); ++i)
      ASSERT_EQ(key(list[i]), key(other[i])) << "step " << step << ", place " << i;
    pairs += list.size();
    advance(scene, random, 0.02);
  }
  EXPECT_GT(kept, 10u);
  EXPECT_LT(kept, 70u);
  EXPECT_GT(pairs, 10000u);
}

TEST(BroadPhase, TurningPlane_IsFollowed) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 3, 3, 3));
  scene.add(Shape::plane, {5, 0, -0.9});
  scene.obstacles[0].spin = {0, 0.5, 0};
  BroadPhase broad(Memory::standard());
  size_t found = 0;
  for (int step = 0; step < 400; ++step) {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    const auto brute = scene.contacts();
    ASSERT_TRUE(same_bits(brute, scene.contacts(broad.candidates()))) << "step " << step;
    found += brute.size();
    scene.obstacles[0].rotation = turn({0, 1, 0}, 0.5 * scene.h * (step + 1));
  }
  EXPECT_GT(found, 100u);
  EXPECT_LT(broad.stats().renewals, 100u);
}

TEST(BroadPhase, CoincidentBodies_ListAllOverlaps) {
  Scene scene;
  const Mesh m = sphere_mesh(0.3, 1);
  scene.add(m);
  scene.add(m);
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  const auto brute = scene.contacts();
  EXPECT_EQ(flaw(scene, brute), "");
  EXPECT_TRUE(same_bits(brute, scene.contacts(broad.candidates())));
  EXPECT_GE(brute.size(), 2 * size_t{scene.bodies[0].surface->nsurfel});
}

TEST(BroadPhase, RestingScene_KeepsItsLists) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 4, 4, 4));
  scene.add(moved(box_mesh({1, 1, 1}, 4, 4, 4), {}, {0, 0, 1.001}));
  BroadPhase broad(Memory::standard());
  std::mt19937 random(1);
  for (int step = 0; step < 1000; ++step) {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    advance(scene, random, 1e-6);
  }
  EXPECT_EQ(broad.stats().renewals, 1u);
  EXPECT_EQ(broad.stats().rebuilds, 2u);
}

// Lists for a fast motion hold all triangles of both, which is too much for things at rest.
TEST(BroadPhase, ThingsThatComeToRest_AreListedAgainOnce) {
  Scene scene;
  scene.add(box_mesh({1, 1, 1}, 4, 4, 4), {200, 0, 0});
  scene.add(moved(box_mesh({1, 1, 1}, 4, 4, 4), {}, {0, 0, 1.001}), {200, 0, 0});
  ObstacleView &ball = scene.add(Shape::sphere, {0, 0, -1.101});
  ball.radius = 0.6;
  ball.velocity = {200, 0, 0};
  BroadPhase broad(Memory::standard()), fresh(Memory::standard());
  const auto update = [&](BroadPhase &lists) {
    lists.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  };
  update(broad);
  const size_t before = broad.candidates().size();
  for (auto &s : scene.surfaces) std::fill(s->v.begin(), s->v.end(), 0.0);
  ball.velocity = {};
  for (int step = 0; step < 1000; ++step) update(broad);
  update(fresh);
  EXPECT_EQ(broad.candidates().size(), fresh.candidates().size());
  EXPECT_GT(before, 4 * broad.candidates().size());
  EXPECT_EQ(broad.stats().renewals, 2u);
}

// A slender bar turns on a slab and bends as it goes: boxes that fitted it along an axis grow until the tree
// is made anew. Contacts are those of lists made from nothing all the way.
TEST(BroadPhase, TurningBar_GetsNewTreesAndTheSameContacts) {
  Scene scene;
  const Mesh bar = box_mesh({6, 0.25, 0.25}, 48, 2, 2);
  Surface &s = scene.add(bar);
  scene.add(moved(box_mesh({4, 4, 0.5}, 6, 6, 1), {}, {0, 0, -0.25}));
  BroadPhase broad(Memory::standard());
  size_t found = 0;
  for (int step = 0; step <= 180; ++step) {
    const Quat q = turn({0, 0, 1}, M_PI * step / 180);
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      const Vec3 r = bar.at(s.point[i]), bent{r.x, r.y + 0.002 * step * std::sin(r.x), r.z};
      store3(&s.x[4 * i], rotate(q, bent) + Vec3{0, 0, 0.1255});
    }
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    const Array<ContactPoint> kept = scene.contacts(broad.candidates()), fresh = scene.listed();
    ASSERT_TRUE(same_bits(kept, fresh)) << step;
    found += kept.size();
  }
  EXPECT_GE(broad.stats().rebuilds, 3u) << "beside the first of each body";
  EXPECT_LE(broad.stats().rebuilds, 12u) << "most updates only renew boxes";
  EXPECT_GE(broad.stats().refits, 150u);
  EXPECT_GT(found, 5000u);
}

TEST(BroadPhase, OnlyTheMovingBody_IsListedAgain) {
  Scene scene;
  for (int i = 0; i < 4; ++i) scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {0, 0, 1.001 * i}));
  Surface &fast = scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {1.01, 0, 0}), {0, 0, 2});
  BroadPhase broad(Memory::standard());
  for (int step = 0; step < 600; ++step) {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    ASSERT_TRUE(same_bits(scene.contacts(), scene.contacts(broad.candidates()))) << "step " << step;
    for (uint32_t i = 0; i < fast.nsurfel; ++i) fast.x[4 * i + 2] += scene.h * 2;
    step += 19;
  }
  EXPECT_GT(broad.stats().renewals, 1u);
  EXPECT_EQ(broad.stats().refits, broad.stats().renewals - 1) << "only the fast body's tree is renewed";
}

// A fine ball and a box of twelve large triangles fly at each other. The skin of the box by itself would be a
// tenth of its edges, beside which lie most edges of the ball.
void fly_at_each_other(Scene &scene, ObstacleMesh *box, size_t most) {
  BroadPhase broad(Memory::standard()), from_nothing(Memory::standard());
  std::mt19937 random(1);
  size_t pairs = 0, contacts = 0;
  for (int step = 0; step < 30; ++step) {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    from_nothing.clear();
    from_nothing.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    const auto found = scene.contacts(broad.candidates());
    ASSERT_TRUE(same_bits(found, scene.contacts(from_nothing.candidates()))) << "step " << step;
    pairs = std::max(pairs, broad.candidates().size());
    contacts += found.size();
    advance(scene, random, 0);
    if (!box) continue;
    const ObstacleView &o = scene.obstacles[0];
    box->place(o.position, o.rotation, o.velocity, o.spin);
  }
  EXPECT_GT(contacts, 1000u);
  EXPECT_LT(pairs, most);
}

TEST(BroadPhase, LargeTrianglesBesideFineOnes_HaveThinSkins) {
  const Mesh ball = moved(sphere_mesh(0.15, 4), {}, {0.1, 0.1, 0.31}),
             box = box_mesh({0.3, 0.3, 0.3}, 1, 1, 1);
  const Quat q = turn({1, 2, 0}, 0.3);
  const Vec3 v{1, 0, 4};
  Scene scene;
  scene.h = 6e-4;
  scene.offset = 1e-4;
  scene.add(ball, {0, 0, -6});
  Scene rigid;
  rigid.h = scene.h;
  rigid.offset = scene.offset;
  rigid.add(ball, {0, 0, -6});
  scene.add(moved(box, q, {}), v);
  fly_at_each_other(scene, nullptr, 5000);  // 10,013 with the skin that the box has alone

  ObstacleMesh mesh(Memory::standard(), box.npoint(), box.x.data(), box.ntri(), box.tri.data());
  ObstacleView &o = rigid.add(Shape::mesh, {}, q);
  o.velocity = v;
  o.surface = &mesh.surface;
  o.extent = mesh.extent;
  mesh.place({}, q, v, {});
  fly_at_each_other(rigid, &mesh, 4500);  // 7,753
}

TEST(BroadPhase, Filter_DecidesByMasksAndNamedPairs) {
  Scene scene;
  for (int i = 0; i < 3; ++i) scene.add(moved(box_mesh({1, 1, 1}, 1, 1, 1), {}, {0, 0, 1.001 * i}));
  scene.add(Shape::plane, {0, 0, -0.501});
  BroadPhase broad(Memory::standard());
  const auto touching = [&] {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    std::string pairs;
    for (const ContactPoint &c : scene.contacts(broad.candidates())) {
      const std::string lower = std::to_string(std::min(c.slot_a, c.obstacle ? 9 : c.slot_b));
      const std::string p = lower + (c.obstacle ? "p" : std::to_string(std::max(c.slot_a, c.slot_b)));
      if (pairs.find(p) == std::string::npos) pairs += p + " ";
    }
    return pairs;
  };
  EXPECT_EQ(touching(), "01 0p 12 ");
  scene.filter.set(101, 100, false, false);
  EXPECT_EQ(touching(), "0p 12 ");
  scene.bodies[0].collides_with = 2;
  EXPECT_EQ(touching(), "12 ");
  scene.filter.set(100, 100, true, true);
  EXPECT_EQ(touching(), "0p 12 ") << "a named pair outranks the masks";
  scene.filter.set(100, 101, false, true);
  EXPECT_EQ(touching(), "01 0p 12 ");
}

TEST(BroadPhase, RemovedBodies_AreForgotten) {
  Scene scene;
  for (int i = 0; i < 3; ++i) scene.add(moved(box_mesh({1, 1, 1}, 1, 1, 1), {}, {0, 0, 1.001 * i}));
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  scene.bodies.erase(scene.bodies.begin() + 1);  // slots 0 and 2 stay
  EXPECT_TRUE(broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset));
  EXPECT_TRUE(broad.candidates().empty());
  scene.bodies.clear();
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  EXPECT_TRUE(broad.candidates().empty());
}

TEST(BroadPhase, BodyWithNaN_LeavesTheOthersAlone) {
  Scene scene;
  for (int i = 0; i < 3; ++i) scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {}, {0, 0, 1.001 * i}));
  BroadPhase broad(Memory::standard());
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  for (double &x : scene.surfaces[0]->x) x = NAN;
  broad.clear();
  broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
  size_t others = 0;
  for (const ContactPoint &c : scene.contacts(broad.candidates())) {
    EXPECT_NE(c.slot_a, 0u);
    EXPECT_NE(c.slot_b, 0u);
    ++others;
  }
  EXPECT_GT(others, 8u);
}

// The same number of allocations in step 2 and step 200: none.
TEST(BroadPhase, SettledUpdates_DoNotAllocate) {
  static size_t allocations;
  Memory counting = Memory::standard();
  counting.alloc = [](void *, size_t bytes, size_t align) {
    ++allocations;
    return Memory::standard().alloc(Memory::standard().user, bytes, align);
  };
  Scene scene = random_scene(3, 0.5);
  scene.h = 1e-5;
  std::mt19937 random(3);
  BroadPhase broad(counting);
  Array<ContactPoint> out{HookAllocator<ContactPoint>(counting)};
  Array<uint8_t> lent{HookAllocator<uint8_t>(counting)};
  size_t settled = 0;
  for (int step = 0; step < 200; ++step) {
    if (step == 100) settled = allocations;
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    find_contacts(scene.bodies, scene.obstacles, broad.candidates(), scene.h, scene.offset, {}, lent, out);
    for (auto &s : scene.surfaces)  // to and fro, so that lists are renewed but do not grow
      for (uint32_t i = 0; i < s->nsurfel; ++i) s->x[4 * i] += step % 2 ? 0.03 : -0.03;
  }
  EXPECT_GT(broad.stats().renewals, 100u);
  EXPECT_EQ(allocations, settled);
}

TEST(BoxTree, Refit_BoundsDeformedTriangles) {
  Scene scene;
  Surface &s = scene.add(sphere_mesh(1, 3));
  BoxTree tree(Memory::standard());
  tree.build(s.tri, s.x.data());
  EXPECT_DOUBLE_EQ(tree.quality(), 1);
  std::mt19937 random(2);
  deform_at_random(s, random, 0.2, 0);
  tree.refit(s.tri, s.x.data());
  EXPECT_GT(tree.quality(), 1.2);
  std::vector<int> seen(s.ntri, 0);
  for (uint32_t i = 0; i < s.ntri; ++i) ++seen[tree.triangles()[i]];
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), long(s.ntri));
  for (uint32_t i = 0; i < s.ntri; ++i)
    for (int k = 0; k < 3; ++k)
      for (int d = 0; d < 3; ++d) {
        const double x = s.x[4 * s.tri[3 * tree.triangles()[i] + k] + d];
        EXPECT_LE(tree.triangle_boxes()[i].lo[d], x);
        EXPECT_GE(tree.triangle_boxes()[i].hi[d], x);
        EXPECT_LE(tree.root().lo[d], x);
        EXPECT_GE(tree.root().hi[d], x);
      }
}

}  // namespace
