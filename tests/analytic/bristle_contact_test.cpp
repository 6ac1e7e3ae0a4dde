// State of a law in contact: carried with the surface point over the edges of the other mesh, turned with the
// surfaces, never counted twice. Closed form: a block whose bristles do not slide is a mass on a spring, x =
// m g sin(theta) / (sigma0 A), whatever lies below.
#include "obstacle.h"
#include "rigid.h"
#include "two_pads.h"

namespace {

using namespace test;

constexpr double kWide = 0.04, kTall = 0.02;

enum class Below { plane, mesh, soft, rigid };

// A block on something flat at z = 0, with a plain coefficient of friction of 10 under a soft plate.
struct Rig {
  Context context;
  dfm_world world;
  dfm_body block;
  dfm_obstacle table = 0;
  double ground = 0;  // height of `table`, which is what lies undermost
  Rig(Below below, double sigma0, double drag, std::array<double, 3> gravity, double mu = 10,
      bool centered = false) {
    world = make_world(context, gravity);
    if (below == Below::plane) table = add_plane(world, "floor");
    if (below == Below::mesh)
      add_mesh(world, "floor", height_field(0.1, 23, [](double, double) { return 0.0; }));
    if (below == Below::rigid) {
      dfm_rigid_def floor = box("floor", {0.1, 0.1, 0.02}, 1000, {0, 0, -0.02});
      create(world, {floor}, {joint(DFM_JOINT_FIXED, 0, UINT32_MAX, {0, 0, -0.02})});
    }
    BodyOptions o;
    if (below == Below::soft) {
      set_friction(world, 10);
      ground = -0.03 - 2e-5;
      table = add_plane(world, "ground", {0, 0, ground});
      o.name = "plate";
      o.young = 5e5;
      o.damping_stiffness = 1e-3;
      o.damping_mass = drag;
      const std::array<double, 3> size =
          centered ? std::array<double, 3>{0.08, 0.08, 0.03} : std::array<double, 3>{0.14, 0.1, 0.03};
      o.position = {-0.5 * size[0], -0.5 * size[1], -0.03};
      make_body(context, world, "beam", size, centered ? 60 : 200, o);
    }
    o.name = "block";
    o.young = 5e5;
    o.damping_stiffness = 1e-3;
    o.position = {-0.5 * kWide, -0.5 * kWide, 2e-5};
    o.damping_mass = drag;
    block = make_body(context, world, "beam", {kWide, kWide, kTall}, 80, o);
    set_bristles(context, world, sigma0, mu);
  }
};

// Components of a contact's bristle in the world.
Vec bristle(const dfm_contact &c) {
  const Vec n = vec(c.normal);
  const Vec t = vec(c.tangent);
  const Vec s{n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
  return {c.bristle[0] * t[0] + c.bristle[1] * s[0], c.bristle[0] * t[1] + c.bristle[1] * s[1],
          c.bristle[0] * t[2] + c.bristle[1] * s[2]};
}

}  // namespace

// Pulled 20 mm over triangles of 9 mm, every point of the block has a deflection of 20 mm: what was dropped
// or started anew on an edge would show less, what two triangles both owned would pull twice. The energy in
// the bristles is that of one spring.
TEST(BristleContact, PulledOverEdgesOfTheOtherMesh_KeepsOneDeflectionPerPoint) {
  for (const Below below : {Below::plane, Below::mesh, Below::rigid}) {
    const double area = kWide * kWide, sigma0 = 3000, g[2] = {3, 9.81};
    Rig r(below, sigma0, 24, {g[0], 0, -g[1]});
    const double mass = measure(r.block).mass, stiff = sigma0 * area, x0 = measure(r.block).com[0];
    double worst = 0;
    for (int k = 0; k < 60; ++k) {
      run(r.world, 0.02, 1e-3);
      const double x = measure(r.block).com[0] - x0;
      double stored = 0, carried = 0, sum = 0;
      for (const dfm_contact &c : contacts(r.world)) {
        const Vec z = bristle(c);
        stored += 0.5 * sigma0 * c.area * dot(z, z);
        carried += sigma0 * c.area * z[0];
        sum += c.area;
        if (k > 5) worst = std::max(worst, std::fabs(z[0] - x));
      }
      if (k < 6) continue;
      EXPECT_NEAR(sum, area, 0.02 * area);
      EXPECT_NEAR(carried, stiff * x, 0.03 * stiff * x);
      EXPECT_NEAR(stored, 0.5 * stiff * x * x, 0.05 * 0.5 * stiff * x * x);
    }
    const double expected = mass * g[0] / stiff;
    EXPECT_GT(expected, 0.019);
    EXPECT_NEAR(measure(r.block).com[0] - x0, expected, 0.01 * expected) << int(below);
    EXPECT_LT(worst, 0.02 * expected) << int(below);
  }
}

// On a soft plate points of both sides come and go. A point of the block has one contact each, with no more
// deflection than its way; what is carried is what the contacts' areas and deflections say, and no area is
// owned twice: the sum stays that of the block's face. In longer sub-steps a point that slides over an edge
// of the soft plate may be free for one, which drops its bristle (doc/decisions/friction_memory.md).
TEST(BristleContact, PulledOverASoftMesh_NoAreaIsOwnedTwice) {
  Rig r(Below::soft, 3000, 24, {3, 0, -9.81});
  const double x0 = measure(r.block).com[0], area = kWide * kWide;
  std::vector<int> seen;
  for (int k = 0; k < 10; ++k) {
    run(r.world, 0.05, 5e-5);
    const double x = measure(r.block).com[0] - x0;
    double sum = 0;
    seen.assign(500, 0);
    for (const dfm_contact &c : contacts(r.world)) {
      if (c.body_b == 0 || !(c.fn > 0)) continue;
      sum += c.area;
      EXPECT_LT(std::fabs(bristle(c)[0]), 1.05 * x + 1e-5);
      if (c.kind == DFM_CONTACT_VERTEX_FACE && c.body_a == r.block) {
        EXPECT_EQ(seen[c.feature_a]++, 0);
      }
    }
    if (k > 2) {
      EXPECT_LT(sum, 1.15 * area);
      EXPECT_GT(sum, 0.8 * area);
    }
  }
  EXPECT_GT(measure(r.block).com[0] - x0, 0.015);
  // without bristles it would be away by 1.5 m/s^2 (0.5 s)^2
  EXPECT_LT(measure(r.block).com[0] - x0, 0.024);
}

// A turntable turns once, and gravity with it: seen from the table nothing changes. Bristles that kept their
// direction in the world would pull the block about by six times its deflection and more.
TEST(BristleContact, TurnedWithItsTable_KeepsItsDeflectionInTheTablesFrame) {
  constexpr double kTwoPi = 6.283185307179586, kPull = 3, kStart = 0.6, kTurn = 1.4;
  for (const Below below : {Below::plane, Below::soft}) {
    const double sigma0 = 3e5;
    Rig r(below, sigma0, 20, {kPull, 0, -9.81}, 10, true);
    const double way = measure(r.block).mass * kPull / (sigma0 * kWide * kWide);
    std::vector<dfm_vector_key> keys;
    for (int i = 0; i <= 400; ++i) {
      const double s = i / 400.0, a = kTwoPi * s;
      keys.push_back({kStart + kTurn * s, {kPull * std::cos(a), kPull * std::sin(a), -9.81}});
    }
    ok(dfm_world_set_gravity_keys(r.world, uint32_t(keys.size()), keys.data()));
    const auto turn_to = [&](double t) {
      const double a = kTwoPi * std::min(1.0, std::max(0.0, (t - kStart) / kTurn));
      dfm_pose pose{};
      pose.position[2] = r.ground;
      pose.rotation[2] = std::sin(0.5 * a);
      pose.rotation[3] = std::cos(0.5 * a);
      ok(dfm_obstacle_move_to(r.table, &pose));
      return a;
    };
    double worst = 0, start[2] = {};
    for (int k = 0; k < 2000; ++k) {
      const double a = turn_to(1e-3 * (k + 1));
      run(r.world, 1e-3, 1e-3);
      const dfm_body_measure m = measure(r.block);
      const double x = m.com[0] * std::cos(a) + m.com[1] * std::sin(a);
      const double y = m.com[1] * std::cos(a) - m.com[0] * std::sin(a);
      if (k == 599) {
        start[0] = x;
        start[1] = y;
      }
      if (k > 599) worst = std::max(worst, std::hypot(x - start[0], y - start[1]));
    }
    EXPECT_LT(worst, (below == Below::plane ? 0.1 : 0.5) * way) << int(below);  // the plate bends too
  }
}

// Two pads on each other, pulled by a tenth of what they hold: what carries load has the area of the patch
// together, whatever the meshes and whichever of their points and crossings that is, and its bristles carry
// the pull. So sigma0 times that area is what resists.
// How much of the load a coarse mesh gives to which point depends on where the pads meet: the area is within
// the range of tests/bench/area_study.cpp.
TEST(BristleContact, TwoPadsOfTwoRefinements_RestOnTheSameArea) {
  for (int k = 0; k < 2; ++k) {
    TwoPads pads(k, 0, 0);
    run(pads.world, 0.6, 1e-3);
    pads.pull(0.1, 1);
    run(pads.world, 0.9, 1e-3);
    double force = 0, area = 0;
    pads.each_loaded([&](const dfm_contact &c) {
      const double side = c.body_a == pads.block ? 1 : -1;
      force += TwoPads::kSigma0 * c.area * side * bristle(c)[0];
      area += c.area;
    });
    const double weight = 0.1 * TwoPads::kGravity * measure(pads.block).mass;
    EXPECT_NEAR(force, weight, 0.02 * weight) << k;
    EXPECT_GT(area, 0.94 * TwoPads::kPatch) << k;
    EXPECT_LT(area, 1.22 * TwoPads::kPatch) << k;
  }
}

// A block slides, stops and sleeps; the shares of its patch that sliding has made are there when it wakes,
// also where all that was awake meanwhile was in the air, with no contact at all.
TEST(BristleContact, SharesOfASleeper_AreKeptWhileAnotherBodyFalls) {
  Context context;
  const dfm_world world = make_world(context, {0, 0, -9.81});
  add_plane(world, "floor");
  BodyOptions o;
  o.name = "block";
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.damping_mass = 24;
  o.position = {-0.02, -0.02, 2e-5};
  o.velocity = {0.4, 0, 0};
  const dfm_body block = make_body(context, world, "beam", {0.04, 0.04, 0.02}, 300, o);
  o.name = "other";
  o.damping_mass = 0;
  o.position = {1, 1, 100};
  o.velocity = {};
  make_body(context, world, "beam", {0.04, 0.04, 0.02}, 20, o);
  set_bristles(context, world, 3e5, 0.3);
  ok(dfm_world_set_sleep(world, true));
  const auto areas = [&] {
    std::vector<double> a;
    for (const dfm_contact &c : contacts(world)) a.push_back(c.area);
    return a;
  };
  bool asleep = false;
  std::vector<double> before;
  for (int k = 0; k < 2000 && !asleep; ++k) {
    before = areas();
    run(world, 1e-3, 1e-3);
    ok(dfm_body_is_asleep(block, &asleep));
  }
  ASSERT_TRUE(asleep);
  run(world, 5e-3, 1e-3);
  ok(dfm_body_wake(block));
  run(world, 1e-3, 1e-3);
  const std::vector<double> after = areas();
  ASSERT_EQ(after.size(), before.size());
  for (size_t i = 0; i < after.size(); ++i) EXPECT_NEAR(after[i], before[i], 0.01 * before[i]);
}
