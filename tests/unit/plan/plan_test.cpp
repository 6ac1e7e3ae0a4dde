// Which stages a scene calls for, in which order, and what is said of those that it does not.
#include <gtest/gtest.h>

#include "core/error.h"
#include "step/stages.h"

namespace {

using dfm::StageRole;
using Names = std::vector<std::string>;

dfm::SceneFacts two_bodies() {
  dfm::SceneFacts f;
  f.bodies = 2;
  f.body_pairs = 1;
  return f;
}

Names stages(const dfm::SceneFacts &f) {
  Names out;
  for (const auto &s : dfm::make_plan(f).stages) out.push_back(dfm::stage_table()[s.row].name);
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
  const Names want = {"model",      "predict", "broad", "narrow", "contact+friction",
                      "distribute", "guard",   "commit"};
  EXPECT_EQ(stages(two_bodies()), want);
  EXPECT_TRUE(dfm::make_plan(two_bodies()).touches());
}

TEST(Plan, OfOneBody_HasNothingOfContact) {
  dfm::SceneFacts f;
  f.bodies = 1;
  EXPECT_EQ(stages(f), (Names{"model", "predict", "commit"}));
  EXPECT_EQ(why_not(f, "guard"), "one body and nothing to touch");
}

TEST(Plan, OfABodyThatTouchesItselfAlone_LooksForNoPairs) {
  dfm::SceneFacts f;
  f.bodies = 1;
  f.self_bodies = 1;
  f.self = true;
  const Names want = {"model",      "predict", "self contact", "contact+friction",
                      "distribute", "guard",   "commit"};
  EXPECT_EQ(stages(f), want);
  EXPECT_EQ(why_not(f, "broad"), "no pair may touch");
}

TEST(Plan, OfRigidBodies_EndsThemBeforeImpulsesAreDistributed) {
  dfm::SceneFacts f = two_bodies();
  f.rigid_bodies = 3;
  f.rigid_hosts = "builtin";
  f.obstacle_pairs = 1;
  const Names all = stages(f);
  EXPECT_EQ(all[2], "rigid predict");
  EXPECT_EQ(all[6], "rigid commit");
  EXPECT_EQ(all[7], "distribute");
}

TEST(Plan, OfWhatIsPrescribed_NamesWhatMoves) {
  dfm::SceneFacts f = two_bodies();
  EXPECT_EQ(why_not(f, "motion"), "nothing is prescribed over time");
  f.loads_vary = true;
  f.obstacles_move = true;
  const dfm::Plan plan = dfm::make_plan(f);
  ASSERT_EQ(stages(f)[0], "motion");
  EXPECT_EQ(plan.stages[0].why, "loads vary, obstacles move");
}

TEST(Plan, OfCoupledSurfaces_GathersThemWhereTheyMayTouch) {
  dfm::SceneFacts f = two_bodies();
  EXPECT_EQ(why_not(f, "gather"), "every surfel is a point of its body");
  f.coupled = 1;
  f.coupled_surfels = 50;
  EXPECT_EQ(stages(f)[2], "gather");
  f.body_pairs = 0;
  EXPECT_EQ(why_not(f, "gather"), "filters let no pair touch");
}

TEST(Plan, OfAnUnguardedWorld_HasNoGuard) {
  dfm::SceneFacts f = two_bodies();
  EXPECT_TRUE(dfm::make_plan(f).has(StageRole::guards));
  f.unguarded = true;
  EXPECT_FALSE(dfm::make_plan(f).has(StageRole::guards));
  EXPECT_NE(why_not(f, "guard").find("contact.guard"), std::string::npos);
}

TEST(Plan, OfAWorldThatMaySleep_EndsWithThatStage) {
  dfm::SceneFacts f = two_bodies();
  f.sleep = true;
  EXPECT_EQ(stages(f).back(), "sleep");
}

// Over all combinations of facts: the stages stand in the order of the table, none of them is among those
// left out too, contact is there where something may touch, and then it gives impulses to points. `f` has the
// facts of the mask `bits`.
TEST(Plan, OfAnyFacts_HasTheOrderOfTheTable) {
  for (uint32_t bits = 0; bits < 1u << 11; ++bits) {
    const auto bit = [&](uint32_t k) { return (bits >> k & 1) != 0; };
    dfm::SceneFacts f;
    f.bodies = 2 * bit(0);
    f.self_stepping = f.bodies && bit(1);
    f.obstacles = bit(2);
    f.body_pairs = f.bodies && bit(3);
    f.obstacle_pairs = f.bodies && f.obstacles && bit(4);
    f.self_bodies = f.bodies && bit(5);
    f.coupled = f.bodies && bit(6);
    f.rigid_bodies = bit(7);
    f.gravity_keys = bit(8);
    f.sleep = bit(9);
    f.unguarded = bit(10);
    const dfm::Plan plan = dfm::make_plan(f);
    for (size_t k = 0; k < plan.stages.size(); ++k) {
      if (k > 0) {
        ASSERT_LT(plan.stages[k - 1].row, plan.stages[k].row);
      }
      const std::string name = dfm::stage_table()[plan.stages[k].row].name;
      for (const auto &absent : plan.absent) ASSERT_NE(absent.name, name);
    }
    const bool touches = f.body_pairs || f.obstacle_pairs || f.self_bodies;
    ASSERT_EQ(plan.touches(), touches);
    ASSERT_EQ(plan.has(StageRole::reports_impulses), touches);
    ASSERT_EQ(plan.has(StageRole::guards), touches && !f.unguarded);
  }
}

// An effect of the content is there without being asked for; one that is asked for needs somebody who
// provides it.
TEST(PlanEffects, OfTheContent_NameTheirProviders) {
  dfm::SceneFacts f = two_bodies();
  f.offered = {{"volume", "model.a"}, {"stiction", "law.b"}, {"volume", "model.c"}};
  const dfm::Plan plan = dfm::make_plan(f);
  ASSERT_EQ(plan.effects.size(), 2u);
  EXPECT_EQ(plan.effects[0].name, "stiction");
  EXPECT_EQ(plan.effects[1].name, "volume");
  EXPECT_EQ(plan.effects[1].requested_by, "content");
  EXPECT_EQ(plan.effects[1].provided_by, "model.a, model.c");
}

TEST(PlanEffects, ThatNoPluginProvides_AreRefusedWithPossibleProviders) {
  const auto refusal = [](const dfm::SceneFacts &f) {
    try {
      dfm::make_plan(f);
    } catch (const dfm::Error &e) {
      return std::string(e.what());
    }
    return std::string();
  };
  dfm::SceneFacts f = two_bodies();
  f.effects_listed = true;
  f.requested = {"volume"};
  EXPECT_NE(refusal(f).find("no loaded plugin could"), std::string::npos) << refusal(f);
  f.available = {{"volume", "model.a"}};
  EXPECT_NE(refusal(f).find("these loaded plugins could: model.a"), std::string::npos) << refusal(f);
  f.idle = {{"volume", "model.a"}};
  EXPECT_NE(refusal(f).find("the parameters switch it off everywhere"), std::string::npos) << refusal(f);
  f.offered = {{"volume", "model.a"}};
  EXPECT_EQ(refusal(f), "");
  dfm::SceneFacts empty;  // whoever comes first may provide it
  empty.effects_listed = true;
  empty.requested = {"volume"};
  empty.available = {{"volume", "model.a"}};
  EXPECT_EQ(refusal(empty), "");
}

// A body that is cut or folds touches itself, so these effects call for self contact.
TEST(PlanEffects, ThatFold_CallForSelfContact) {
  dfm::SceneFacts f;
  f.bodies = 1;
  EXPECT_EQ(dfm::self_requested_by(f), "");
  f.offered = {{"folding", "model.a"}};
  EXPECT_EQ(dfm::self_requested_by(f), "folding");
  f.self = true;
  EXPECT_EQ(dfm::self_requested_by(f), "contact.self");
  f.self_bodies = 1;
  const dfm::Plan plan = dfm::make_plan(f);
  ASSERT_EQ(plan.effects.size(), 2u);
  EXPECT_EQ(plan.effects[1].name, dfm::kSelfContact);
  EXPECT_EQ(plan.effects[1].requested_by, "contact.self");
}

}  // namespace
