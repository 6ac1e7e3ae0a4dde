// Which stages a scene calls for, in which order, and what is said of those that it does not.
#include <gtest/gtest.h>

#include "core/error.h"
#include "world/stages.h"

namespace {

using dfm::StageId;

dfm::SceneFacts two_bodies() {
  dfm::SceneFacts f;
  f.bodies = 2, f.body_pairs = 1;
  return f;
}

std::vector<StageId> stages(const dfm::SceneFacts &f) {
  std::vector<StageId> out;
  for (const auto &s : dfm::make_plan(f).stages) out.push_back(s.id);
  return out;
}

std::string why_not(const dfm::SceneFacts &f, const std::string &name) {
  for (const auto &s : dfm::make_plan(f).absent)
    if (s.name == name) return s.why;
  return {};
}

TEST(Plan, OfAnEmptyWorld_HasNoStage) {
  EXPECT_TRUE(stages({}).empty());
  EXPECT_EQ(why_not({}, "sleep"), "no body");
}

TEST(Plan, OfBodiesThatTouch_HasTheStagesOfContactInOrder) {
  const std::vector<StageId> want = {StageId::model, StageId::predict, StageId::broad, StageId::narrow, StageId::solve, StageId::distribute, StageId::guard,
                                     StageId::commit};
  EXPECT_EQ(stages(two_bodies()), want);
  EXPECT_TRUE(dfm::make_plan(two_bodies()).touches());
}

TEST(Plan, OfOneBody_HasNothingOfContact) {
  dfm::SceneFacts f;
  f.bodies = 1;
  EXPECT_EQ(stages(f), (std::vector<StageId>{StageId::model, StageId::predict, StageId::commit}));
  EXPECT_EQ(why_not(f, "guard"), "one body and nothing to touch");
}

TEST(Plan, OfABodyThatTouchesItselfAlone_LooksForNoPairs) {
  dfm::SceneFacts f;
  f.bodies = 1, f.self_bodies = 1, f.self = true;
  EXPECT_EQ(stages(f), (std::vector<StageId>{StageId::model, StageId::predict, StageId::self, StageId::solve, StageId::distribute, StageId::guard,
                                             StageId::commit}));
  EXPECT_EQ(why_not(f, "broad"), "no pair may touch");
}

TEST(Plan, OfRollback_HasItsStagesInPlaceOfTheSolve) {
  dfm::SceneFacts f = two_bodies();
  f.rollback = true;
  EXPECT_EQ(stages(f), (std::vector<StageId>{StageId::model, StageId::predict, StageId::lagged, StageId::broad, StageId::rollback, StageId::commit}));
  EXPECT_EQ(why_not(f, "guard"), "contact.method is rollback");
  f.self_bodies = 1;
  EXPECT_THROW(dfm::make_plan(f), dfm::Error);
}

TEST(Plan, OfRigidBodies_EndsThemBeforeImpulsesAreDistributed) {
  dfm::SceneFacts f = two_bodies();
  f.rigid_bodies = 3, f.rigid_hosts = "builtin", f.obstacle_pairs = 1;
  const std::vector<StageId> all = stages(f);
  EXPECT_EQ(all[2], StageId::rigid_predict);
  EXPECT_EQ(all[6], StageId::rigid_commit);
  EXPECT_EQ(all[7], StageId::distribute);
}

}  // namespace
