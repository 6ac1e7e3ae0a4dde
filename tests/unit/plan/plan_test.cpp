// Which stages a scene calls for, in which order, and what is said of those that it does not.
#include <gtest/gtest.h>

#include "core/error.h"
#include "rollback/rollback.h"
#include "world/method.h"

namespace {

using dfm::ContactMethod;
using dfm::StageRole;
using Names = std::vector<std::string>;

const ContactMethod &velocity() { return dfm::velocity_method(); }

dfm::SceneFacts two_bodies() {
  dfm::SceneFacts f;
  f.bodies = 2, f.body_pairs = 1;
  return f;
}

Names stages(const dfm::SceneFacts &f, const ContactMethod &method = velocity()) {
  Names out;
  for (const auto &s : dfm::make_plan(method.table, f).stages) out.push_back(method.table[s.row].name);
  return out;
}

std::string why_not(const dfm::SceneFacts &f, const std::string &name, const ContactMethod &method = velocity()) {
  for (const auto &s : dfm::make_plan(method.table, f).absent)
    if (s.name == name) return s.why;
  return {};
}

TEST(Plan, OfAnEmptyWorld_HasNoStage) {
  EXPECT_TRUE(stages({}).empty());
  EXPECT_EQ(why_not({}, "sleep"), "no body");
}

TEST(Plan, OfBodiesThatTouch_HasTheStagesOfContactInOrder) {
  const Names want = {"model", "predict", "broad", "narrow", "contact+friction", "distribute", "guard", "commit"};
  EXPECT_EQ(stages(two_bodies()), want);
  EXPECT_TRUE(dfm::make_plan(velocity().table, two_bodies()).touches());
}

TEST(Plan, OfOneBody_HasNothingOfContact) {
  dfm::SceneFacts f;
  f.bodies = 1;
  EXPECT_EQ(stages(f), (Names{"model", "predict", "commit"}));
  EXPECT_EQ(why_not(f, "guard"), "one body and nothing to touch");
}

TEST(Plan, OfABodyThatTouchesItselfAlone_LooksForNoPairs) {
  dfm::SceneFacts f;
  f.bodies = 1, f.self_bodies = 1, f.self = true;
  EXPECT_EQ(stages(f), (Names{"model", "predict", "self contact", "contact+friction", "distribute", "guard", "commit"}));
  EXPECT_EQ(why_not(f, "broad"), "no pair may touch");
}

TEST(Plan, OfRollback_HasItsStagesInPlaceOfTheSolve) {
  const ContactMethod &rollback = dfm::rollback::method();
  EXPECT_EQ(stages(two_bodies(), rollback), (Names{"model", "predict", "lagged friction", "broad", "rollback", "commit"}));
  for (const char *replaced : {"narrow", "contact+friction", "distribute", "guard"})
    EXPECT_EQ(why_not(two_bodies(), replaced, rollback), "contact.method is rollback") << replaced;
  const dfm::Plan plan = dfm::make_plan(rollback.table, two_bodies());
  EXPECT_TRUE(plan.touches());
  EXPECT_FALSE(plan.has(StageRole::gives_impulses));
}

TEST(Plan, OfRigidBodies_EndsThemBeforeImpulsesAreDistributed) {
  dfm::SceneFacts f = two_bodies();
  f.rigid_bodies = 3, f.rigid_hosts = "builtin", f.obstacle_pairs = 1;
  const Names all = stages(f);
  EXPECT_EQ(all[2], "rigid predict");
  EXPECT_EQ(all[6], "rigid commit");
  EXPECT_EQ(all[7], "distribute");
}

}  // namespace
