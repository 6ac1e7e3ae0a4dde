// Tools that rub on each other: the friction of the pair's law, grips that hold, triangles, and energy.
#include <random>

#include "tool.h"

namespace {

using namespace test::tools;
using test::Vec;

dfm_tool_def driven(const char *name, uint32_t shape, dfm_pose at, Vec half) {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = name;
  d.shape = shape;
  d.pose = at;
  for (size_t k = 0; k < 3; ++k) d.half_size[k] = half[k];
  d.radius = shape == DFM_TOOL_GRASPER ? 0 : half[0];
  d.half_length = half[2];
  return d;
}
dfm_tool_def coupled(const char *name, uint32_t shape, dfm_pose at, Vec half, double share = 1) {
  dfm_tool_def d = driven(name, shape, at, half);
  d.stiffness = 500;
  d.turn_stiffness = 1;
  d.damping = share * 2 * std::sqrt(d.stiffness * d.mass);
  d.turn_damping = share * 2 * std::sqrt(d.turn_stiffness * d.inertia);
  return d;
}

void move(dfm_tool t, dfm_pose to) { test::ok(dfm_tool_set_pose(t, &to, nullptr)); }
void step(dfm_world w, double dt = 1e-3) { test::ok(dfm_world_step(w, dt, nullptr)); }

}  // namespace

// A box is pressed on a slab and drawn along it, as a box and as triangles, both ways round: it slides under
// mu N and stays where it is below it.
TEST(ToolRub, ABoxOnASlab_SlidesUnderMuN) {
  const Vec half = {0.01, 0.01, 0.01}, slab = {0.06, 0.06, 0.01};
  const BoxMesh small(half), large(slab);
  for (const int triangles : {0, 1, 2, 3}) {
    SCOPED_TRACE(triangles);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    test::set_friction(w, 0.3);
    dfm_tool_def below = driven("slab", DFM_TOOL_BOX, pose({0, 0, -0.01}), slab);
    dfm_tool_def above = coupled("box", DFM_TOOL_BOX, pose({-0.02, 0, 0.0105}), half);
    if (triangles & 1) small.put(above);
    if (triangles & 2) large.put(below);
    const dfm_tool a = make(w, above), b = make(w, below);
    for (int i = 1; i <= 200; ++i) {
      move(a, pose({-0.02, 0, 0.0105 - 0.004 * i / 200}));
      step(w);
    }
    const double still = state(a).pose.position[0];
    for (int i = 1; i <= 500; ++i) {  // up to 0.4 N, of the 0.5 N that about 1.8 N bear
      move(a, pose({-0.02 + 0.0008 * std::min(i / 200.0, 1.0), 0, 0.0065}));
      step(w);
    }
    EXPECT_NEAR(state(a).pose.position[0], still, 1e-12) << "it holds, without creep";
    EXPECT_NEAR(force_on(a)[0], -500 * 0.0008, 1e-6);
    for (int i = 1; i <= 1000; ++i) {
      move(a, pose({-0.0192 + 2e-5 * i, 0, 0.0065}));
      step(w);
    }
    const Vec on_a = force_on(a), on_b = force_on(b);
    EXPECT_GT(on_a[2], 1.5);
    EXPECT_NEAR(on_a[0], -0.3 * on_a[2], 1e-9);
    EXPECT_NEAR(state(a).velocity[0], 0.02, 1e-6);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(on_a[k], -on_b[k], 1e-12);
    EXPECT_GT(state(a).pose.position[2], 0.01);
  }
}

// Laws other than Coulomb's give their limit, rules count by name, and "none" rubs nowhere.
TEST(ToolRub, TheRuleOfThePair_Counts) {
  const auto dragged = [](const char *law) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    test::set_friction(w, 0.3, law);
    const dfm_tool a = make(w, coupled("box", DFM_TOOL_BOX, pose({0, 0, 0.0105}), {0.01, 0.01, 0.01}));
    make(w, driven("slab", DFM_TOOL_BOX, pose({0, 0, -0.01}), {0.06, 0.06, 0.01}));
    for (int i = 1; i <= 800; ++i) {
      move(a, pose({2e-5 * i, 0, 0.0105 - 0.004 * std::min(i / 200.0, 1.0)}));
      step(w);
    }
    const Vec f = force_on(a);
    return -f[0] / f[2];
  };
  EXPECT_NEAR(dragged("coulomb"), 0.3, 1e-9);
  EXPECT_NEAR(dragged("lugre"), 0.3, 1e-6);
  EXPECT_NEAR(dragged("none"), 0, 1e-12);
}

// A grasper closes on a needle that another hand leads, and pulls at with less than the grip bears. It
// carries the needle along, and nothing but friction does it.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolRub, AGrasper_HoldsAnotherTool) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::set_friction(w, 0.5);
  dfm_tool_def d = driven("grasper", DFM_TOOL_GRASPER, pose({0, 0, 0.04}), {0.003, 0.006, 0.02});
  d.opening = 0.2;
  const dfm_tool grasper = make(w, d),
                 needle =
                     make(w, coupled("needle", DFM_TOOL_BOX, pose({0, 0, 0.007}), {0.0015, 0.03, 0.003}));
  for (int i = 1; i <= 100; ++i) {
    test::ok(dfm_tool_set_opening(grasper, 0.2 - 0.15 * i / 100));
    step(w);
  }
  const double before = state(needle).pose.position[1], high = state(needle).pose.position[2];
  for (int i = 1; i <= 500; ++i) {  // up to 1 N
    move(needle, pose({0, 0.002 * std::min(i / 200.0, 1.0), 0.007}));
    step(w);
  }
  EXPECT_NEAR(state(needle).pose.position[1], before, 1e-9);
  EXPECT_NEAR(state(needle).pose.position[2], high, 1e-6) << "it does not creep out of the jaws";
  EXPECT_NEAR(force_on(needle)[1], -1, 1e-5);
  EXPECT_NEAR(force_on(grasper)[1], 1, 1e-5);
  for (int i = 1; i <= 500; ++i) {
    move(grasper, pose({0, -0.001 * std::min(i / 400.0, 1.0), 0.04}));
    step(w);
  }
  EXPECT_NEAR(state(needle).pose.position[1], before - 0.001, 1e-8) << "carried";
  EXPECT_NEAR(force_on(needle)[1], -1.5, 1e-4);
  test::ok(dfm_tool_set_opening(grasper, 0.2));
  for (int i = 0; i < 300; ++i) step(w);
  EXPECT_NEAR(state(needle).pose.position[1], 0.002, 1e-4) << "let go, it follows its hand";
}

// Tools of every shape run at each other at 1 m/s, in steps of 1 ms and 1/60 s: none comes through.
TEST(ToolRub, AtOneMeterPerSecond_NoneComesThrough) {
  const Vec half = {0.006, 0.012, 0.012};
  const BoxMesh box(half);
  for (const uint32_t first :
       {DFM_TOOL_SPHERE, DFM_TOOL_CAPSULE, DFM_TOOL_BOX, DFM_TOOL_MESH, DFM_TOOL_ELLIPSOID})
    for (const uint32_t second : {DFM_TOOL_CAPSULE, DFM_TOOL_BOX, DFM_TOOL_MESH, DFM_TOOL_ELLIPSOID})
      for (const double dt : {1e-3, 1.0 / 60}) {
        SCOPED_TRACE(std::to_string(first) + " on " + std::to_string(second) + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0});
        dfm_tool_def da = coupled("a", first, pose({-0.04, 0.001, 0.0005}, {1, 2, 0}, 0.4), half),
                     db = driven("b", second, pose({0.04, 0, 0}, {0, 1, 1}, 0.3), half);
        if (first == DFM_TOOL_MESH) box.put(da);
        if (second == DFM_TOOL_MESH) box.put(db);
        const dfm_tool a = make(w, da), b = make(w, db);
        double met = 0;
        for (int i = 1; i <= int(0.1 / dt); ++i) {
          move(b, pose({0.04 - dt * i, 0, 0}, {0, 1, 1}, 0.3));
          step(w, dt);
          met = std::max(met, test::norm(force_on(a)));
          ASSERT_LT(state(a).pose.position[0], state(b).pose.position[0] - 0.005) << i;
        }
        EXPECT_GT(met, 0.1);
      }
}

// A hand shakes one of two tools of triangles at random, with friction: what they have never exceeds what the
// hand has put in, to rounding and what turning adds.
TEST(ToolRub, ShakenAtRandom_TheyMakeNoEnergy) {
  const Vec half = {0.006, 0.012, 0.012};
  const BoxMesh box(half);
  for (const uint32_t shape : {DFM_TOOL_BOX, DFM_TOOL_MESH, DFM_TOOL_CAPSULE}) {
    SCOPED_TRACE(shape);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    test::set_friction(w, 0.5);
    dfm_tool_def da = coupled("a", shape, pose({-0.02, 0, 0}, {1, 2, 0}, 0.4), half, 0),
                 db = coupled("b", DFM_TOOL_MESH, pose({0.02, 0, 0}, {0, 1, 1}, 0.3), half, 0);
    if (shape == DFM_TOOL_MESH) box.put(da);
    box.put(db);
    const dfm_tool a = make(w, da), b = make(w, db);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1, 1);
    double largest = 0, met = 0;
    for (int i = 1; i <= 2000; ++i) {
      const Vec axis = {any(random), any(random), 1};
      move(a, pose({-0.02 + 0.025 * std::min(i / 300.0, 1.0) + 5e-4 * any(random), 5e-4 * any(random),
                    5e-4 * any(random)},
                   axis, 0.05 * any(random)));
      step(w);
      const double has = tool_energy(a) + tool_energy(b), given = state(a).work + state(b).work;
      largest = std::max(largest, has);
      ASSERT_LT(has, given + 1e-9 * (1 + largest)) << i;
      met = std::max(met, test::norm(force_on(b)));
    }
    EXPECT_GT(met, 0.5);
  }
}
