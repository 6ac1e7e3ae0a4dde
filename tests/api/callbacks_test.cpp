// May two things touch, and what holds of a contact before it is solved: functions of the host.
#include <algorithm>
#include <thread>

#include "heap_calls.h"
#include "stack.h"

namespace {

struct Calls {
  std::vector<std::pair<uint64_t, uint64_t>> pairs;
  uint64_t not_with = 0;
  static bool may_touch(void *user, uint64_t a, uint64_t b) {
    Calls &calls = *static_cast<Calls *>(user);
    calls.pairs.emplace_back(a, b);
    return a != calls.not_with && b != calls.not_with;
  }
};
using Pairs = std::vector<std::pair<uint64_t, uint64_t>>;

// What a pre-solve function of these tests does to every contact that it is asked about.
struct Choice {
  uint32_t enabled = 1;
  double scale = 1;
  std::array<double, 3> belt{};
  uint32_t law = UINT32_MAX;
  uint64_t only_b = 0;
  std::vector<double> seen;
  std::vector<dfm_contact_choice> all;
  static void pre_solve(void *user, dfm_contact_choice *c) {
    Choice &to = *static_cast<Choice *>(user);
    to.all.push_back(*c);
    for (const double x : {c->point[0], c->point[2], c->normal[2], c->gap, c->velocity[2], double(c->key)})
      to.seen.push_back(x);
    if (to.only_b && c->b != to.only_b) return;
    c->enabled = to.enabled;
    c->friction_scale = to.scale;
    for (size_t k = 0; k < 3; ++k) c->surface_velocity[k] = to.belt[k];
    if (to.law != UINT32_MAX) c->law = to.law;
  }
};

double mean_velocity(dfm_body b, size_t axis) {
  dfm_body_measure m{};
  m.size = sizeof m;
  test::ok(dfm_body_get_measure(b, &m));
  return m.velocity[axis];
}
double height(dfm_body b) {
  dfm_body_measure m{};
  m.size = sizeof m;
  test::ok(dfm_body_get_measure(b, &m));
  return m.com[2];
}

// A cube on a plane that is at rest, with a law.
struct OnFloor {
  test::Context c;
  dfm_world w;
  dfm_obstacle floor;
  dfm_body body;
  explicit OnFloor(const char *law = "coulomb", double mu = 0.5, uint32_t threads = 1)
      : c(threads), w(test::make_world(c)), floor(test::add_plane(w, "floor")) {
    test::set_friction(w, mu, law);
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.name = "cube";
    o.position = {0, 0, 1e-4};
    body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::run(w, 0.05, 1e-3);
  }
};

}  // namespace

TEST(MayTouch, IsCalledOncePerPairAndItsResultKept) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  Calls calls;
  test::ok(dfm_world_set_may_touch(s.world, &Calls::may_touch, &calls));
  test::run(s.world, 5e-3, 1e-3);
  const Pairs all{{s.lower, s.upper}, {s.lower, s.floor}, {s.upper, s.floor}};
  EXPECT_EQ(calls.pairs, all);
  EXPECT_GT(test::pairs(s.world).size(), 0u);
  const dfm_obstacle wall =
      test::add_plane(s.world, "wall", {9, 0, 0}, {0, -std::sqrt(0.5), 0, std::sqrt(0.5)});
  test::run(s.world, 2e-3, 1e-3);
  EXPECT_EQ(calls.pairs.size(), 5u) << "the new pairs alone";
  EXPECT_EQ(calls.pairs[3], std::make_pair(s.lower, wall));
  calls.pairs.clear();
  test::ok(dfm_world_ask_again(s.world, s.upper, s.lower));
  test::run(s.world, 2e-3, 1e-3);
  EXPECT_EQ(calls.pairs, Pairs({{s.lower, s.upper}}));
  calls.pairs.clear();
  test::ok(dfm_world_ask_again(s.world, wall, 0));
  test::run(s.world, 1e-3, 1e-3);
  EXPECT_EQ(calls.pairs, Pairs({{s.lower, wall}, {s.upper, wall}}));
  calls.pairs.clear();
  test::ok(dfm_obstacle_destroy(wall));
  test::run(s.world, 1e-3, 1e-3);
  EXPECT_TRUE(calls.pairs.empty());
  test::ok(dfm_world_ask_again(s.world, 0, 0));
  test::run(s.world, 1e-3, 1e-3);
  EXPECT_EQ(calls.pairs, all);
}

TEST(MayTouch, ARefusal_LetsBodiesPassUntilTheNextCall) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  Calls calls;
  calls.not_with = s.lower;
  test::ok(dfm_world_set_may_touch(s.world, &Calls::may_touch, &calls));
  test::run(s.world, 0.03, 1e-3);
  EXPECT_LT(height(s.lower), 0.05 - 0.5 * 9.81 * 0.025 * 0.025) << "it falls through the floor";
  for (const dfm_contact &k : test::contacts(s.world)) EXPECT_NE(k.body_a, s.lower);
  test::ok(dfm_world_set_may_touch(s.world, nullptr, nullptr));
  test::run(s.world, 0.02, 1e-3);
  bool touches = false;
  for (const dfm_pair_report &p : test::pairs(s.world)) touches = touches || p.a == s.lower;
  EXPECT_TRUE(touches) << "the floor leads it out";
}

TEST(MayTouch, RulesAndMasksComeFirst) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  Calls calls;
  test::ok(dfm_world_filter_pair(s.world, "lower", "upper", false));
  test::ok(dfm_body_set_filter(s.upper, 2, 2));
  test::ok(dfm_world_set_may_touch(s.world, &Calls::may_touch, &calls));
  test::run(s.world, 1e-3, 1e-3);
  EXPECT_EQ(calls.pairs, Pairs({{s.lower, s.floor}}));
  test::ok(dfm_body_set_filter(s.upper, 1, ~0u));
  test::run(s.world, 1e-3, 1e-3);
  EXPECT_EQ(calls.pairs, Pairs({{s.lower, s.floor}, {s.upper, s.floor}})) << "its masks let it touch again";
}

TEST(MayTouch, CallsIntoTheWorld_AreRefused) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  struct Attack {
    test::Stack s;
    int refused = 0, calls = 0;
  } attack{s, 0, 0};
  test::ok(dfm_world_set_may_touch(
      s.world,
      [](void *user, uint64_t, uint64_t) {
        Attack &a = *static_cast<Attack *>(user);
        const dfm_query_shape point = dfm_query_shape_default();
        dfm_query_hits hits{};
        ++a.calls;
        a.refused += dfm_world_query(a.s.world, &point, nullptr, 0, nullptr, nullptr, &hits) == DFM_E_BUSY;
        a.refused += dfm_body_destroy(a.s.upper) == DFM_E_BUSY;
        a.refused += dfm_world_ask_again(a.s.world, 0, 0) == DFM_E_BUSY;
        test::says({"busy with another call"});
        return true;
      },
      &attack));
  test::ok(dfm_world_step(s.world, 1e-3, nullptr));
  EXPECT_EQ(attack.calls, 3);
  EXPECT_EQ(attack.refused, 9);
}

TEST(PreSolve, SeesEveryContactWithItsSides) {
  OnFloor s;
  Choice choice;
  test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  ASSERT_FALSE(choice.all.empty());
  const std::vector<dfm_contact> contacts = test::contacts(s.w);
  uint32_t touched = 0;
  for (const dfm_contact_choice &k : choice.all) {
    EXPECT_EQ(k.a, s.body);
    EXPECT_EQ(k.b, s.floor);
    EXPECT_EQ(k.kind, uint32_t{DFM_CONTACT_PRIMITIVE});
    EXPECT_EQ(k.normal[2], 1);
    EXPECT_NEAR(k.velocity[2], 0, 0.1);
    EXPECT_EQ(k.friction_scale, 1);
    EXPECT_EQ(k.enabled, 1u);
    touched += k.flags & DFM_CHOICE_TOUCHED;
  }
  EXPECT_GE(touched, contacts.size());
  for (const dfm_contact &k : contacts)
    EXPECT_TRUE(std::any_of(choice.all.begin(), choice.all.end(), [&](const dfm_contact_choice &a) {
      return a.key == k.key && a.feature_a == k.feature_a && a.law == k.law;
    }));
  const size_t before = choice.all.size();
  test::ok(dfm_world_set_pre_solve(s.w, nullptr, nullptr));
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  EXPECT_EQ(choice.all.size(), before);
}

TEST(PreSolve, ResultsThatChangeNothing_KeepTheBits) {
  uint64_t hash[2];
  for (const bool with : {false, true}) {
    OnFloor s("lugre");
    Choice choice;
    if (with) test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
    test::set_velocity(s.body, {0.3, 0.1, 0});
    test::run(s.w, 0.05, 1e-3);
    hash[with] = dfm_world_hash(s.w);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(PreSolve, Disabled_LetsThrough_ThenHoldsAgain) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  // a thin platform, 0.3 m up, that is solid from above only
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "platform";
  d.shape = DFM_SHAPE_BOX;
  d.half_size[0] = d.half_size[1] = 0.5;
  d.half_size[2] = 0.01;
  d.pose.position[2] = 0.3;
  dfm_obstacle platform = 0;
  test::ok(dfm_obstacle_create(w, &d, &platform));
  test::BodyOptions o;
  o.young = 1e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 0.5;
  o.velocity = {0, 0, 3};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  struct Platform {
    bool solid = false;
    static void pre_solve(void *user, dfm_contact_choice *k) {
      k->enabled = static_cast<Platform *>(user)->solid;
    }
  } state;
  test::ok(dfm_world_set_pre_solve(w, &Platform::pre_solve, &state));
  double top = 0;
  std::vector<double> x;
  uint32_t n = 0;
  test::ok(dfm_surface_positions(b, 0, nullptr, &n));
  x.resize(3 * n);
  for (int i = 0; i < 1500; ++i) {
    test::ok(dfm_surface_positions(b, n, x.data(), &n));
    double lowest = 1e9;
    for (uint32_t k = 0; k < n; ++k) lowest = std::min(lowest, x[3 * k + 2]);
    state.solid = lowest >= 0.31;
    top = std::max(top, lowest);
    ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
  }
  EXPECT_GT(top, 0.4) << "it came through from below, with its speed";
  EXPECT_NEAR(height(b), 0.36, 2e-3) << "and stands on it";
  EXPECT_NEAR(mean_velocity(b, 2), 0, 1e-3);
  dfm_world_stats stats{};
  stats.size = sizeof stats;
  test::ok(dfm_world_get_stats(w, &stats));
  EXPECT_EQ(stats.guard_cuts, 0u) << "the guard does not hold what may pass";
}

TEST(PreSolve, SurfaceVelocity_IsABelt) {
  OnFloor s, belt;
  Choice choice;
  choice.belt = {0.2, 0.1, 5};  // what points out of the surface does nothing
  test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
  const double own[3] = {0.2, 0.1, 0};
  test::ok(dfm_obstacle_set_velocity_surface(belt.floor, own));
  test::run(s.w, 0.3, 1e-3);
  test::run(belt.w, 0.3, 1e-3);
  EXPECT_NEAR(mean_velocity(s.body, 0), 0.2, 5e-3) << "it is carried along, and wobbles";
  for (size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(mean_velocity(s.body, k), mean_velocity(belt.body, k), 1e-9) << "as by the obstacle's own";
}

class FrictionScale : public ::testing::TestWithParam<const char *> {};

// mu times the scale is the coefficient: the same deceleration as of a law with that coefficient.
TEST_P(FrictionScale, IsThatOfTheCoefficient) {
  double after[2];
  for (const bool scaled : {false, true}) {
    OnFloor s(GetParam(), scaled ? 0.6 : 0.3);
    Choice choice;
    choice.scale = 0.5;
    if (scaled) test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
    test::set_velocity(s.body, {1, 0, 0});
    test::run(s.w, 0.1, 1e-3);
    after[scaled] = mean_velocity(s.body, 0);
  }
  EXPECT_NEAR(after[0], 1 - 0.3 * 9.81 * 0.1, 0.02);
  EXPECT_NEAR(after[1], after[0], 2e-3);
}

TEST_P(FrictionScale, OfZero_IsNoFriction) {
  OnFloor s(GetParam(), 0.6);
  Choice choice;
  choice.scale = 0;
  test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
  test::set_velocity(s.body, {1, 0, 0});
  test::run(s.w, 0.1, 1e-3);
  EXPECT_NEAR(mean_velocity(s.body, 0), 1, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Laws, FrictionScale,
                         ::testing::Values("coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"));

TEST(PreSolve, LawByNumber_IsTheContactsLaw) {
  OnFloor s;
  dfm_friction_def f{};
  f.size = sizeof f;
  f.between[0] = "cube";
  f.between[1] = "cube";  // no contact has it by itself
  f.law = "none";
  test::ok(dfm_world_add_friction(s.w, &f));
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  uint32_t none = UINT32_MAX;
  for (uint32_t law = 0;; ++law) {
    dfm_law_info info{};
    info.size = sizeof info;
    if (dfm_world_law_info(s.w, law, &info) != DFM_OK) break;
    if (std::string(info.id) == "org.deform.none") none = law;
  }
  ASSERT_NE(none, UINT32_MAX);
  Choice choice;
  choice.law = none;
  test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
  test::set_velocity(s.body, {1, 0, 0});
  test::run(s.w, 0.05, 1e-3);
  EXPECT_NEAR(mean_velocity(s.body, 0), 1, 1e-6);
  for (const dfm_contact &k : test::contacts(s.w)) EXPECT_EQ(k.law, none);
}

// A crossing of a law without memory gives way, and with a law that has one it bears its part of the load,
// whoever has chosen the law.
TEST(PreSolve, ALawWithMemory_BearsAtCrossingsAsByARule) {
  const auto sinks = [](const char *rule, bool choose) {
    test::Context c;
    const dfm_world w = test::make_world(c);
    test::set_friction(w, 0.5, rule);
    dfm_friction_def f{};
    f.size = sizeof f;
    f.between[0] = f.between[1] = "top";  // no contact has it by itself
    f.law = "lugre";
    const double mu = 0.5;
    const dfm_param_value v{"mu", &mu, 1};
    f.params = {sizeof(dfm_params), 1, &v};
    test::add_plane(w, "floor");
    test::BodyOptions o;
    o.damping_stiffness = 2e-3;
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 12, o);
    o.name = "top";
    o.position = {0.03, 0.02, 0.101};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 12, o);
    test::ok(dfm_world_add_friction(w, &f));
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    Choice choice;
    for (uint32_t law = 0;; ++law) {
      dfm_law_info info{};
      info.size = sizeof info;
      if (dfm_world_law_info(w, law, &info) != DFM_OK) break;
      if (choose && std::string(info.id) == "org.deform.lugre") choice.law = law;
    }
    test::ok(dfm_world_set_pre_solve(w, &Choice::pre_solve, &choice));
    test::run(w, 0.05, 1e-3);
    double crossings = 0;
    for (const dfm_contact &k : test::contacts(w))
      if (k.kind == DFM_CONTACT_EDGE_EDGE) crossings += k.fn;
    return crossings;
  };
  const double ruled = sinks("lugre", false), chosen = sinks("coulomb", true), soft = sinks("coulomb", false);
  EXPECT_GT(ruled, 1.5 * soft);
  EXPECT_NEAR(chosen, ruled, 0.05 * ruled);
}

TEST(PreSolve, OnSeveralThreads_IsCalledInTheSameOrderWithTheSameBits) {
  std::vector<double> seen[2];
  uint64_t hash[2];
  for (const uint32_t threads : {1u, 4u}) {
    OnFloor s("coulomb", 0.5, threads);
    Choice choice;
    choice.scale = 0.7;
    choice.belt = {0.1, 0.05, 0};
    test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
    test::set_velocity(s.body, {0.5, 0, 0.2});
    test::run(s.w, 0.1, 1e-3);
    seen[threads > 1] = choice.seen;
    hash[threads > 1] = dfm_world_hash(s.w);
  }
  EXPECT_FALSE(seen[0].empty());
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(PreSolve, ImpossibleResults_EndTheStepWithAnError) {
  OnFloor s;
  Choice choice;
  test::ok(dfm_world_set_pre_solve(s.w, &Choice::pre_solve, &choice));
  const uint64_t before = dfm_world_hash(s.w);
  const auto refused = [&](const char *what) {
    EXPECT_EQ(dfm_world_step(s.w, 1e-3, nullptr), DFM_E_ARG);
    test::says({"pre-solve", what});
    EXPECT_EQ(dfm_world_hash(s.w), before);
  };
  choice.scale = -1;
  refused("friction scale -1");
  choice.scale = NAN;
  refused("nan");
  choice.scale = 1;
  choice.belt[1] = INFINITY;
  refused("not finite");
  choice.belt[1] = 0;
  choice.law = 99;
  refused("law 99");
  choice.law = UINT32_MAX;
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
}

TEST(PreSolve, TakesNoMemoryOnceItHasRun) {
  OnFloor s;
  test::ok(
      dfm_world_set_pre_solve(s.w, [](void *, dfm_contact_choice *k) { k->friction_scale = 0.5; }, nullptr));
  test::run(s.w, 0.02, 1e-3);
  const uint64_t heap = test::heap_calls;
  test::run(s.w, 0.02, 1e-3);
  EXPECT_EQ(test::heap_calls - heap, 0u);
}

TEST(PreSolve, CallsIntoTheWorld_AreRefused) {
  OnFloor s;
  struct Attack {
    OnFloor &s;
    int refused = 0, calls = 0;
  } attack{s, 0, 0};
  test::ok(dfm_world_set_pre_solve(
      s.w,
      [](void *user, dfm_contact_choice *) {
        Attack &a = *static_cast<Attack *>(user);
        ++a.calls;
        dfm_query_hits hits{};
        const dfm_query_shape point = dfm_query_shape_default();
        a.refused += dfm_world_step(a.s.w, 1e-3, nullptr) == DFM_E_BUSY;
        a.refused += dfm_world_query(a.s.w, &point, nullptr, 1, nullptr, nullptr, &hits) == DFM_E_BUSY;
        a.refused += dfm_world_set_pre_solve(a.s.w, nullptr, nullptr) == DFM_E_BUSY;
        a.refused += dfm_surface_vertices(a.s.body, nullptr, 0, nullptr, nullptr) == DFM_E_BUSY;
        test::says({"busy with another call"});
      },
      &attack));
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  EXPECT_GT(attack.calls, 0);
  EXPECT_EQ(attack.refused, 4 * attack.calls);
}

TEST(PreSolve, OfNoWorld_IsRefused) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  EXPECT_EQ(dfm_world_set_pre_solve(77, nullptr, nullptr), DFM_E_HANDLE);
  EXPECT_EQ(dfm_world_set_may_touch(77, nullptr, nullptr), DFM_E_HANDLE);
  EXPECT_EQ(dfm_world_ask_again(w, 99, 0), DFM_E_HANDLE);
}
