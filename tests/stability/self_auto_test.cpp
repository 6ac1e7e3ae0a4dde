// Self contact acts only while a body touches itself; "auto" is another word for "true".
#include <memory>

#include "hook.h"
#include "shot.h"

namespace {

using test::Shot;

uint64_t step(dfm_world w, int steps, double dt) {
  for (int i = 0; i < steps; ++i) {
    uint32_t trouble = 0;
    EXPECT_EQ(dfm_world_step(w, dt, &trouble), DFM_OK) << dfm_last_error();
  }
  return dfm_world_hash(w);
}

std::unique_ptr<Shot> thrown_at_plane(const char *kind, test::Vec size, double speed, uint32_t self,
                                      uint32_t threads = 1) {
  auto s = std::make_unique<Shot>(true, 1, threads, self);
  test::add_plane(s->world, "wall");
  const double turn = s->jitter(0.02);
  s->add(kind, size, 300, {0, 0, 0.053}, {0, 0, -speed}, {turn, 0, 0, std::sqrt(1 - turn * turn)});
  return s;
}

void does_not_cross_itself(const char *kind, test::Vec size, double speed) {
  const auto shot = thrown_at_plane(kind, size, speed, DFM_SELF_ON);
  for (int i = 0; i < 10; ++i) {
    step(shot->world, 1, 1e-3);
    EXPECT_EQ(shot->count().within, 0u) << "step " << i;
  }
  EXPECT_EQ(test::stats(shot->world).self_max, 1u) << "the scene does not need it";
}

// Two legs whose tips are thrown at each other, and bounce.
dfm_world legs(dfm_context *c) {
  const dfm_world w = test::make_self_world(c);
  test::set_friction(w, 0.3);
  test::HookOptions o;
  o.young = 2e4;
  o.close = 1;
  test::make_hook(w, o);
  return w;
}

}  // namespace

TEST(SelfAuto, BallAt50MetersPerSecond_DoesNotCrossItself) {
  does_not_cross_itself("ball", {0.05, 0, 0}, 50);
}
TEST(SelfAuto, CubeAt50MetersPerSecond_DoesNotCrossItself) {
  does_not_cross_itself("beam", {0.1, 0.1, 0.1}, 50);
}

TEST(SelfAuto, LegsThatMeetAndPart_AreCountedWhileTheyTouch) {
  const test::Context c;
  const dfm_world w = legs(c);
  std::vector<uint32_t> on;
  for (int i = 0; i < 60; ++i) {
    step(w, 1, 1e-3);
    if (const uint32_t now = test::stats(w).self_bodies; on.empty() || now != on.back()) on.push_back(now);
  }
  ASSERT_GE(on.size(), 3u);
  EXPECT_EQ(on[0], 0u) << "a body at rest does not touch itself";
  EXPECT_EQ(on[1], 1u);
  EXPECT_EQ(on[2], 0u) << "they have parted";
  EXPECT_EQ(test::stats(w).self_max, 1u);
}

// Contacts of bodies that sleep are in the order of their keys, so those of two alternate.
TEST(SelfAuto, SleepersThatTouchThemselves_AreCountedOnce) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c);
  test::ok(dfm_world_set_sleep(w, true));
  test::HookOptions o;
  o.young = 2e4;
  o.damping_mass = 60;
  o.damping_stiffness = 1e-3;
  o.pinch = 0.05;
  o.held = true;
  for (int k = 0; k < 2; ++k) {
    o.name = k ? "other" : "one";
    o.position[1] = 0.1 * k;
    test::make_hook(w, o);
  }
  o.name = "flies";
  o.position[1] = 1;
  o.velocity[1] = 1;
  o.damping_mass = o.pinch = 0;
  o.held = false;
  test::make_hook(w, o);
  for (int i = 0; i < 40 && test::stats(w).asleep < 2; ++i) step(w, 50, 1e-3);
  ASSERT_EQ(test::stats(w).asleep, 2u);
  step(w, 2, 1e-3);
  EXPECT_EQ(test::stats(w).self_bodies, 2u);
  EXPECT_EQ(test::stats(w).self_max, 2u);
  EXPECT_GT(test::stats(w).contacts, 4u) << "their contacts can alternate";
}

TEST(SelfAuto, RestoredInTheMiddle_ContinuesWithTheSameBits) {
  auto first = thrown_at_plane("ball", {0.05, 0, 0}, 50, DFM_SELF_AUTO);
  auto second = thrown_at_plane("ball", {0.05, 0, 0}, 50, DFM_SELF_ON, 3);
  step(first->world, 2, 1e-3);
  const std::string saved = test::snapshot(first->world);
  const uint64_t later = step(first->world, 3, 1e-3);
  EXPECT_EQ(test::stats(first->world).self_max, 1u);
  test::ok(dfm_world_restore(second->world, saved.data(), saved.size()));
  EXPECT_EQ(step(second->world, 3, 1e-3), later) << "in another world, with other threads and the other word";
  test::ok(dfm_world_restore(first->world, saved.data(), saved.size()));
  EXPECT_EQ(step(first->world, 3, 1e-3), later) << "in the same one, which has looked since";
}

TEST(SelfAuto, BodyThatDoesNotFold_NeverTouchesItselfAndMovesAsWithout) {
  const auto automatic = thrown_at_plane("ball", {0.05, 0, 0}, 1, DFM_SELF_AUTO);
  const auto off = thrown_at_plane("ball", {0.05, 0, 0}, 1, DFM_SELF_OFF);
  EXPECT_EQ(step(automatic->world, 40, 1e-3), step(off->world, 40, 1e-3));
  EXPECT_EQ(test::stats(automatic->world).self_max, 0u);
}

TEST(SelfAuto, Explain_ReportsWhoRequestedIt) {
  const test::Context c;
  const std::string plan = test::explain(legs(c));
  EXPECT_NE(plan.find("\"name\":\"self_contact\",\"asked_by\":\"contact.self\""), std::string::npos) << plan;
  EXPECT_NE(plan.find("1 body may touch themselves (contact.self)"), std::string::npos) << plan;
}
