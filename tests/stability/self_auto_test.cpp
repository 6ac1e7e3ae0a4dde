// Self contact acts only while a body touches itself; "auto" is another word for it.
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

void is_as_on(const char *kind, test::Vec size, double speed) {
  const auto automatic = thrown_at_plane(kind, size, speed, DFM_SELF_AUTO);
  const auto on = thrown_at_plane(kind, size, speed, DFM_SELF_ON);
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(step(automatic->world, 1, 1e-3), step(on->world, 1, 1e-3)) << "step " << i;
    EXPECT_EQ(automatic->count().within, 0u) << "step " << i;
  }
  EXPECT_EQ(test::stats(automatic->world).self_max, 1u) << "the scene does not need it";
}

// Two legs whose tips are thrown at each other, and bounce.
dfm_world legs(dfm_context *c, uint32_t self) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = 0;
  d.self_contact = self;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::set_friction(w, 0.3);
  test::HookOptions o;
  o.young = 2e4;
  o.close = 1;
  test::make_hook(w, o);
  return w;
}

}  // namespace

TEST(SelfAuto, BallAt50MetersPerSecond_IsAsOn) { is_as_on("ball", {0.05, 0, 0}, 50); }
TEST(SelfAuto, CubeAt50MetersPerSecond_IsAsOn) { is_as_on("beam", {0.1, 0.1, 0.1}, 50); }

TEST(SelfAuto, LegsThatMeetAndPart_AreCountedWhileTheyTouch) {
  const test::Context c;
  const dfm_world w = legs(c, DFM_SELF_AUTO), always = legs(c, DFM_SELF_ON);
  std::vector<uint32_t> on;
  for (int i = 0; i < 60; ++i) {
    ASSERT_EQ(step(w, 1, 1e-3), step(always, 1, 1e-3)) << "step " << i;
    if (const uint32_t now = test::stats(w).self_bodies; on.empty() || now != on.back()) on.push_back(now);
  }
  ASSERT_GE(on.size(), 3u);
  EXPECT_EQ(on[0], 0u) << "a body at rest does not touch itself";
  EXPECT_EQ(on[1], 1u);
  EXPECT_EQ(on[2], 0u) << "they have parted";
  EXPECT_EQ(test::stats(w).self_max, 1u);
}

TEST(SelfAuto, RestoredInTheMiddle_ContinuesWithTheSameBits) {
  auto first = thrown_at_plane("ball", {0.05, 0, 0}, 50, DFM_SELF_AUTO);
  auto second = thrown_at_plane("ball", {0.05, 0, 0}, 50, DFM_SELF_AUTO, 3);
  step(first->world, 2, 1e-3);
  const std::string saved = test::snapshot(first->world);
  const uint64_t later = step(first->world, 3, 1e-3);
  EXPECT_EQ(test::stats(first->world).self_max, 1u);
  test::ok(dfm_world_restore(second->world, saved.data(), saved.size()));
  EXPECT_EQ(step(second->world, 3, 1e-3), later) << "in another world, with other threads";
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
  const std::string plan = test::explain(legs(c, DFM_SELF_AUTO));
  EXPECT_NE(plan.find("\"name\":\"self_contact\",\"asked_by\":\"contact.self\""), std::string::npos) << plan;
  EXPECT_NE(plan.find("1 body may touch themselves (contact.self)"), std::string::npos) << plan;
}
