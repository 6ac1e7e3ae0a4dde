// What a host sets anew each frame (the motion of held points, friction of a pair, filters) takes no more
// memory for it, and holds as the last call said.
#include "refused_memory.h"

#include "world.h"

namespace {

using test::Refusal;

struct Scene {
  dfm_context *c = nullptr;
  dfm_world w = 0;
  dfm_body body = 0;
  Scene() {
    dfm_context_def d = test::refusing_context();
    d.plugin_dir = DEFORM_PLUGIN_DIR;
    EXPECT_EQ(dfm_context_create(&d, &c), DFM_OK) << dfm_last_error();
    w = test::make_world(c);
    test::add_plane(w, "floor");
    test::BodyOptions o;
    o.name = "block";
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 4e-5};
    body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  }
  ~Scene() { dfm_context_destroy(c); }
  size_t bytes() const {
    size_t n = 0;
    test::ok(dfm_world_snapshot(w, nullptr, &n));
    return n;
  }
};

void slide(Scene &s, double x) {
  const uint32_t points[] = {0, 1, 2};
  const dfm_pose_key keys[] = {{0, {{x, 0, 0}, {0, 0, 0, 1}}}, {1, {{x + 1, 0, 0}, {0, 0, 0, 1}}}};
  ASSERT_EQ(dfm_body_move_held(s.body, 3, points, 2, keys, nullptr), DFM_OK) << dfm_last_error();
}

double speed_of(const Scene &s, uint32_t point) {
  double v[3 * 64];
  uint32_t n = 0;
  test::ok(dfm_body_get_state(s.body, 64, nullptr, v, &n));
  return v[3 * point];
}

void friction(Scene &s, double mu, const char *a = "block", const char *b = "floor") {
  const dfm_param_value value{"mu", &mu, 1};
  dfm_friction_def f{};
  f.size = sizeof f;
  f.between[0] = a;
  f.between[1] = b;
  f.law = "coulomb";
  f.params = {sizeof(dfm_params), 1, &value};
  ASSERT_EQ(dfm_world_add_friction(s.w, &f), DFM_OK) << dfm_last_error();
}

}  // namespace

// unsanitized: so many calls take minutes there
TEST(Superseded, MotionsOfHeldPoints_TakeTheSameMemoryAfterAMillionCalls) {
  Scene s;
  const uint32_t points[] = {0, 1, 2};
  test::ok(dfm_body_hold(s.body, 3, points, 7));
  for (int i = 0; i < 10; ++i) slide(s, i);
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  const int64_t live = Refusal::live;
  const size_t bytes = s.bytes();
  for (int i = 0; i < 1000000; ++i) slide(s, i);
  EXPECT_EQ(Refusal::live, live);
  EXPECT_EQ(s.bytes(), bytes);
}

// unsanitized: so many calls take minutes there
TEST(Superseded, FrictionAndFilters_TakeTheSameMemoryAfterAMillionCalls) {
  Scene s;
  const auto set = [&](int i) {
    friction(s, 0.3 + 1e-7 * i, i % 2 ? "block" : "floor", i % 2 ? "floor" : "block");
    ASSERT_EQ(dfm_world_filter_pair(s.w, "floor", "block", true), DFM_OK);
  };
  for (int i = 0; i < 20; ++i) {
    set(i);
    test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  }
  const int64_t live = Refusal::live;
  const size_t bytes = s.bytes();
  for (int i = 0; i < 1000000; ++i) set(i);
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  EXPECT_LE(Refusal::live, live + 8);  // an instance of a law more or less
  EXPECT_LE(s.bytes(), bytes + 200);
}

TEST(Superseded, AMotion_ReplacesTheOneBeforePointByPoint) {
  Scene s;
  const uint32_t points[] = {0, 1}, second = 1;
  test::ok(dfm_body_hold(s.body, 2, points, 7));
  const dfm_pose_key slow[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{0.1, 0, 0}, {0, 0, 0, 1}}}};
  const dfm_pose_key fast[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{0.2, 0, 0}, {0, 0, 0, 1}}}};
  test::ok(dfm_body_move_held(s.body, 2, points, 2, slow, nullptr));
  test::ok(dfm_body_move_held(s.body, 1, &second, 2, fast, nullptr));
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  EXPECT_NEAR(speed_of(s, 0), 0.1, 1e-9);
  EXPECT_NEAR(speed_of(s, 1), 0.2, 1e-9);
}

TEST(Superseded, AReleasedPoint_IsNotMovedByItsOldMotionWhenHeldAgain) {
  Scene s;
  const uint32_t points[] = {0, 1};
  test::ok(dfm_body_hold(s.body, 2, points, 7));
  const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{0.1, 0, 0}, {0, 0, 0, 1}}}};
  test::ok(dfm_body_move_held(s.body, 2, points, 2, keys, nullptr));
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  test::ok(dfm_body_hold(s.body, 1, points, 0));
  test::ok(dfm_body_hold(s.body, 2, points, 5));
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  EXPECT_EQ(speed_of(s, 0), 0) << "released and held anew: at rest";
  EXPECT_NEAR(speed_of(s, 1), 0.1, 1e-9) << "held all the time: it goes on";
}

TEST(Superseded, ARule_HoldsAsItWasGivenLast) {
  Scene s;
  for (const double mu : {0.9, 0.1, 0.4}) {
    friction(s, mu);
    friction(s, mu, "*", "floor");
  }
  friction(s, 0.7, "floor", "block");
  const double push[3] = {2.5, 0, -9.81};
  test::ok(dfm_world_set_gravity(s.w, push));
  for (int i = 0; i < 3000; ++i) test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  const std::vector<dfm_contact> contacts = test::contacts(s.w);
  ASSERT_FALSE(contacts.empty());
  EXPECT_NEAR(test::measure(s.body).velocity[0], 0, 1e-2)
      << "mu 0.7 holds 2.5 m/s2; the 0.1 and 0.4 that went before would not";
}

TEST(Superseded, RulesOfADestroyedBody_GoWithIt) {
  Scene s;
  const size_t bytes = s.bytes();
  const dfm_world w = s.w;
  for (int i = 0; i < 50; ++i) {
    const std::string name = "guest" + std::to_string(i);
    test::BodyOptions o;
    o.name = name;
    o.position = {1, 0, 0.1};
    const dfm_body guest = test::make_body(s.c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
    friction(s, 0.2 + 0.01 * i, name.c_str(), "floor");
    test::ok(dfm_world_filter_pair(w, name.c_str(), "block", false));
    test::ok(dfm_world_step(w, 1e-4, nullptr));
    test::ok(dfm_body_destroy(guest));
  }
  EXPECT_LE(s.bytes(), bytes + 2000);
}
