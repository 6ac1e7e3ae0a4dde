// What changes while a world runs, and what prepare() makes anew for it: values need neither tables nor, as
// long as the same stages are called for, a plan.
#include <functional>

#include "inside.h"
#include "obstacle.h"
#include "rigid.h"
#include "stack.h"
#include "step/context.h"
#include "step/pair_table.h"

namespace {

using test::inside;

struct Made {
  uint64_t tables, plans;
  bool operator==(const Made &) const = default;
};
std::ostream &operator<<(std::ostream &out, const Made &m) {
  return out << m.tables << " tables, " << m.plans << " plans";
}

struct Running {
  test::Context c;
  test::Stack stack = test::make_stack(c);
  Running() { step(); }
  void step() { test::ok(dfm_world_step(stack.world, 1e-4, nullptr)); }
  Made made() const {
    const dfm::StepContext &s = *inside(stack.world).steps;
    return {s.made.tables, s.made.plans};
  }
  // What one more step makes after a change.
  Made after(const std::function<void()> &change) {
    const Made before = made();
    change();
    step();
    const Made now = made();
    return {now.tables - before.tables, now.plans - before.plans};
  }
  void friction(double mu, const char *a = "*", const char *b = "*") const {
    const dfm_param_value v{"mu", &mu, 1};
    const dfm_params params{sizeof params, 1, &v};
    test::ok(dfm_world_set_friction(stack.world, a, b, &params));
  }
  void add_friction(double mu, const char *a, const char *b, const char *law = "coulomb") const {
    test::ok(test::add_friction(stack.world, law, {{"mu", mu}}, a, b));
  }
  uint32_t push(double force, uint32_t nkey = 0, const dfm_scale_key *keys = nullptr) const {
    const uint32_t point = 1;
    const double f[3] = {force, 0, 0};
    uint32_t load = 0;
    test::ok(dfm_body_add_load(stack.upper, 1, &point, f, nkey, keys, nullptr, &load));
    return load;
  }
};

const Made kNothing{0, 0}, kPlan{0, 1}, kAll{1, 1}, kTables{1, 0};

}  // namespace

TEST(Changes, OfALoad_MakeNoTableAndNoPlan) {
  Running r;
  uint32_t load = 0;
  EXPECT_EQ(r.after([&] { load = r.push(0.1); }), kNothing);
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_remove_load(r.stack.upper, load)); }), kNothing);
}

TEST(Changes, OfALoadThatVaries_RebuildThePlanOnceWhereTheMotionStageComesOrGoes) {
  Running r;
  const dfm_scale_key keys[] = {{0, 0}, {1, 1}};
  uint32_t load = 0;
  EXPECT_EQ(r.after([&] { load = r.push(0.1, 2, keys); }), kPlan);
  EXPECT_EQ(r.after([&] {
    test::ok(dfm_body_remove_load(r.stack.upper, load));
    load = r.push(0.2, 2, keys);
  }),
            kNothing)
      << "replaced within a frame: loads vary as before";
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_remove_load(r.stack.upper, load)); }), kPlan);
}

TEST(Changes, OfSpringsAndHeldPoints_MakeThePlanForTheFirstOnly) {
  Running r;
  const uint32_t points[] = {0, 1}, first = 0;
  const dfm_spring_def def{sizeof def, 2, points, nullptr, {0, 0, 0.3}, nullptr, 0, 0, 3, 0.1};
  const double to[3] = {0.1, 0, 0.3};
  uint32_t spring = 0;
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_add_spring(r.stack.upper, &def, &spring)); }), kPlan);
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_set_spring_target(r.stack.upper, spring, to)); }), kNothing);
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_add_spring(r.stack.upper, &def, nullptr)); }), kNothing);

  const dfm_sine sway{{1e-4, 0, 0}, 20, 0};
  test::ok(dfm_body_hold(r.stack.lower, 1, &first, 7));
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_move_held(r.stack.lower, 1, &first, 0, nullptr, &sway)); }),
            kPlan);
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_move_held(r.stack.lower, 1, &first, 0, nullptr, &sway)); }),
            kNothing);
}

TEST(Changes, OfGravityPosesAndParameters_MakeNoTableAndNoPlan) {
  Running r;
  const double down[3] = {0, 0, -5};
  EXPECT_EQ(r.after([&] { test::ok(dfm_world_set_gravity(r.stack.world, down)); }), kNothing);
  EXPECT_EQ(inside(r.stack.world).gravity.now.z, -5);

  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "jaw";
  d.shape = DFM_SHAPE_BOX;
  d.pose.position[0] = 3;
  dfm_obstacle jaw = 0;
  EXPECT_EQ(r.after([&] { test::ok(dfm_obstacle_create(r.stack.world, &d, &jaw)); }), kAll)
      << "somebody new is no value";
  d.pose.position[0] = 3.00001;
  EXPECT_EQ(r.after([&] { test::ok(dfm_obstacle_move_to(jaw, &d.pose)); }), kNothing);

  const double young = 3e5;
  const dfm_param_value value{"young", &young, 1};
  const dfm_params params{sizeof params, 1, &value};
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_set_params(r.stack.upper, &params)); }), kNothing);
}

TEST(Changes, OfTheStateOfARigidBody_MakeNoTableAndNoPlan) {
  Running r;
  const dfm_rigid arm = test::create(r.stack.world, {test::box("arm", {0.2, 0.02, 0.02}, 0.5, {3, 0, 1})})[0];
  r.step();
  dfm_rigid_state state{};
  test::ok(dfm_rigid_get_state(arm, &state));
  state.position[0] = 0.05;
  state.position[2] = 0.4;
  EXPECT_EQ(r.after([&] { test::ok(dfm_rigid_set_state(arm, &state)); }), kNothing);
}

TEST(Changes, OfGravityKeys_MakeThePlanWhereTheyComeOrGo) {
  Running r;
  const dfm_vector_key keys[] = {{0, {0, 0, -9}}, {1, {0, 0, -10}}};
  const double down[3] = {0, 0, -5};
  EXPECT_EQ(r.after([&] { test::ok(dfm_world_set_gravity_keys(r.stack.world, 2, keys)); }), kPlan);
  EXPECT_EQ(r.after([&] { test::ok(dfm_world_set_gravity_keys(r.stack.world, 2, keys)); }), kNothing);
  EXPECT_EQ(r.after([&] { test::ok(dfm_world_set_gravity(r.stack.world, down)); }), kPlan);
}

// A parameter that switches an effect on or off changes what the plan has to tell.
TEST(Changes, OfAParameterThatCallsForAnotherEffect_MakeAll) {
  Running r;
  const double none = 0;
  const dfm_param_value value{"damping_stiffness", &none, 1};
  const dfm_params params{sizeof params, 1, &value};
  EXPECT_EQ(r.after([&] { test::ok(dfm_body_set_params(r.stack.upper, &params)); }), kAll);
}

// The same bits as a world that makes all of it anew after each change.
TEST(Changes, OfValues_LeadToTheSameStateAsRebuildingAll) {
  Running a, b;
  uint32_t load_a = a.push(0), load_b = b.push(0);
  for (int i = 0; i < 200; ++i) {
    const auto change = [i](const Running &r, uint32_t &load) {
      const double down[3] = {0.01 * i, 0, -9.81}, young = 2e5 + 100 * i;
      const dfm_param_value value{"young", &young, 1};
      const dfm_params params{sizeof params, 1, &value};
      if (i % 3 == 0) test::ok(dfm_world_set_gravity(r.stack.world, down));
      if (i % 5 == 0) test::ok(dfm_body_set_params(r.stack.lower, &params));
      test::ok(dfm_body_remove_load(r.stack.upper, load));
      load = r.push(1e-3 * i);
    };
    change(a, load_a);
    change(b, load_b);
    inside(b.stack.world).changed = true;
    a.step();
    b.step();
    ASSERT_EQ(dfm_world_hash(a.stack.world), dfm_world_hash(b.stack.world)) << i;
  }
  EXPECT_LT(a.made().tables, 3u);
  EXPECT_GT(b.made().tables, 199u);
}

TEST(Changes, OfACoefficient_MakeNothingAndKeepTheLaw) {
  Running r;
  const size_t laws = inside(r.stack.world).laws.size();
  EXPECT_EQ(r.after([&] { r.friction(0.3); }), kNothing);
  EXPECT_EQ(r.after([&] { r.add_friction(0.4, "*", "*"); }), kNothing) << "given again with another value";
  EXPECT_EQ(r.after([&] { test::ok(dfm_world_remove_friction(r.stack.world, "*", "*")); }), kTables);
  EXPECT_LE(inside(r.stack.world).laws.size(), laws + 1) << "the law of pairs without a rule";
}

TEST(Changes, OfARuleThatSharesItsLaw_MakeTheTablesOnce) {
  Running r;
  EXPECT_EQ(r.after([&] { r.add_friction(0.5, "lower", "floor"); }), kTables);
  EXPECT_EQ(r.after([&] { r.friction(0.6, "floor", "lower"); }), kAll)
      << "shared with the rule for all: a law of its own, once";
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(r.after([&] { r.friction(0.6 + 0.01 * i, "lower", "floor"); }), kNothing);
    EXPECT_EQ(r.after([&] { r.friction(0.5 + 0.01 * i); }), kNothing);
  }
  EXPECT_EQ(r.after([&] { r.add_friction(0.7, "lower", "floor"); }), kNothing)
      << "moved behind the others, which weigh less";
}

// Of rules that weigh the same the last given wins: given again, the first one may hold elsewhere.
TEST(Changes, OfARuleThatMovesBehindItsEquals_MakeTheTables) {
  Running r;
  r.add_friction(0.1, "lower", "*");
  r.add_friction(0.9, "upper", "*");
  r.step();
  dfm::World &w = inside(r.stack.world);
  const auto between_cubes = [&] { return w.laws[pair_law(w, 0, false, 1)]->params[0]; };
  EXPECT_EQ(between_cubes(), 0.9);
  EXPECT_EQ(r.after([&] { r.add_friction(0.2, "*", "lower"); }), kTables);
  EXPECT_EQ(between_cubes(), 0.2);
}

// An hour of a slider that is read 55 times a second.
// unsanitized: so many calls take minutes there
TEST(Changes, OfACoefficientForAnHour_MakeNothing) {
  Running r;
  r.step();
  const Made before = r.made();
  const size_t laws = inside(r.stack.world).laws.size();
  for (int i = 0; i < 200000; ++i) {
    r.friction(0.1 + 1e-6 * i);
    if (i % 1000 == 0) r.step();
  }
  EXPECT_EQ(r.made(), before);
  EXPECT_EQ(inside(r.stack.world).laws.size(), laws);
  EXPECT_EQ(inside(r.stack.world).friction.size(), 1u);
}
