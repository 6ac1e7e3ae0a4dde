// Rules of friction and filters that change and go while the world runs, and what contacts
// remember through it.
#include "bristle_law.h"
#include "refused_memory.h"
#include "stack.h"

namespace {

using test::Refusal;

struct Scene {
  dfm_context *c = nullptr;
  dfm_world w = 0;
  dfm_body block = 0;
  dfm_obstacle floor = 0;
  // A block that a slanted gravity pushes along the floor.
  explicit Scene(double push = 0.5) {
    dfm_context_def d = test::refusing_context();
    d.plugin_dir = DEFORM_PLUGIN_DIR;
    EXPECT_EQ(dfm_context_create(&d, &c), DFM_OK) << dfm_last_error();
    test::ok(dfm_plugin_register_static(c, dfm_plugin_entry_bristle, "bristle"));
    w = test::make_world(c);
    floor = test::add_plane(w, "floor");
    test::BodyOptions o;
    o.name = "block";
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 4e-5};
    block = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
    const double gravity[3] = {push, 0, -9.81};
    test::ok(dfm_world_set_gravity(w, gravity));
  }
  ~Scene() { dfm_context_destroy(c); }
  Scene(const Scene &) = delete;

  void run(int steps) {
    for (int i = 0; i < steps; ++i) test::ok(dfm_world_step(w, 1e-4, nullptr));
  }
  dfm_status add(const char *a, const char *b, double mu, const char *law = "coulomb") const {
    return test::add_friction(w, law, {{"mu", mu}}, a, b);
  }
  dfm_status set(const char *a, const char *b, const char *key, double value) const {
    const dfm_param_value v{key, &value, 1};
    const dfm_params params{sizeof params, 1, &v};
    return dfm_world_set_friction(w, a, b, &params);
  }
  // The longest bristle of all contacts, m.
  double bristle() const {
    double most = 0;
    for (const dfm_contact &contact : test::contacts(w))
      most = std::max(most, std::hypot(contact.bristle[0], contact.bristle[1]));
    return most;
  }
  // Of the bristles of each loaded contact, N/m3: least and largest.
  std::pair<double, double> stiffness() const {
    std::pair<double, double> out{INFINITY, 0};
    for (const dfm_contact &at : test::contacts(w))
      if (const double z = std::hypot(at.bristle[0], at.bristle[1]); at.fn > 0 && z > 0) {
        const double k = std::hypot(at.ft[0], at.ft[1]) / (at.area * z);
        out = {std::min(out.first, k), std::max(out.second, k)};
      }
    return out;
  }
  // Along the push, N.
  double friction() const {
    double sum = 0;
    for (const dfm_pair_report &p : test::pairs(w)) sum += p.friction[0];
    return sum;
  }
  double speed() const { return test::measure(block).velocity[0]; }
  size_t bytes() const {
    size_t n = 0;
    test::ok(dfm_world_snapshot(w, nullptr, &n));
    return n;
  }
};

}  // namespace

TEST(FrictionRules, ACoefficientThatIsSet_HoldsFromTheNextStepOn) {
  Scene s(3);
  ASSERT_EQ(s.add("block", "floor", 0.6), DFM_OK);
  s.run(3000);
  EXPECT_NEAR(s.speed(), 0, 1e-2);
  ASSERT_EQ(s.set("floor", "block", "mu", 0.1), DFM_OK) << "in either order";
  const double before = s.speed();
  s.run(1000);
  EXPECT_NEAR(s.speed() - before, 0.1 * (3 - 0.1 * 9.81), 0.01) << "it slides: push less mu g";
  ASSERT_EQ(s.set("block", "floor", "mu", 0.9), DFM_OK);
  s.run(5000);
  EXPECT_NEAR(s.speed(), 0, 1e-2);
}

TEST(FrictionRules, WhatIsNotGiven_KeepsItsValue) {
  Scene s;
  ASSERT_EQ(s.add("*", "*", 1, "test.bristle"), DFM_OK);
  ASSERT_EQ(s.set("*", "*", "sigma0", 3e7), DFM_OK);
  ASSERT_EQ(s.set("*", "*", "mu", 0.9), DFM_OK);
  s.run(2000);
  EXPECT_NEAR(s.stiffness().first, 3e7, 1e-3 * 3e7);
  EXPECT_NEAR(s.stiffness().second, 3e7, 1e-3 * 3e7);
}

TEST(FrictionRules, ABristle_StaysWhereItsStiffnessChanges) {
  Scene s;
  ASSERT_EQ(s.add("*", "*", 1, "test.bristle"), DFM_OK);
  s.run(3000);
  const double z = s.bristle(), force = s.friction();
  ASSERT_GT(z, 0);
  ASSERT_LT(force, 0);
  ASSERT_EQ(s.set("*", "*", "sigma0", 1.5e8), DFM_OK);
  s.run(1);
  EXPECT_NEAR(s.bristle(), z, 0.03 * z) << "a displacement in m";
  EXPECT_NEAR(s.friction(), 1.5 * force, 0.05 * std::fabs(force)) << "its force follows the stiffness";
  ASSERT_EQ(s.add("*", "*", 0.9, "test.bristle"), DFM_OK)
      << "given again, with another coefficient and the stiffness of the table";
  s.run(1);
  EXPECT_NEAR(s.bristle(), z, 0.05 * z);
}

TEST(FrictionRules, TwoRulesWithTheSameValues_PartWithoutLosingTheirBristles) {
  Scene s;
  ASSERT_EQ(s.add("*", "*", 0.5, "test.bristle"), DFM_OK);
  ASSERT_EQ(s.add("block", "floor", 0.5, "test.bristle"), DFM_OK);
  s.run(3000);
  const double z = s.bristle();
  ASSERT_GT(z, 0);
  ASSERT_EQ(s.set("block", "floor", "mu", 0.6), DFM_OK);
  s.run(1);
  EXPECT_NEAR(s.bristle(), z, 0.01 * z);
}

TEST(FrictionRules, ARuleThatIsRemoved_LeavesItsContactsToTheNextOne) {
  Scene s(3);
  ASSERT_EQ(s.add("*", "*", 0.05), DFM_OK);
  ASSERT_EQ(s.add("block", "floor", 0.9, "test.bristle"), DFM_OK);
  s.run(2000);
  EXPECT_NEAR(s.speed(), 0, 1e-2);
  EXPECT_GT(s.bristle(), 0);
  test::ok(dfm_world_remove_friction(s.w, "floor", "block"));
  s.run(1000);
  EXPECT_EQ(s.bristle(), 0) << "another law: its memory starts anew, and this one has none";
  EXPECT_NEAR(s.speed(), 0.1 * (3 - 0.05 * 9.81), 0.02);
  test::ok(dfm_world_remove_friction(s.w, "*", "*"));
  s.run(5000);
  EXPECT_NEAR(s.speed(), 0, 1e-2) << "pairs without a rule: Coulomb, 0.5";
}

TEST(FrictionRules, WhatIsRefused_GivesTheReasonAndChangesNothing) {
  Scene s;
  ASSERT_EQ(s.add("block", "floor", 0.5), DFM_OK);
  s.run(5);
  const size_t bytes = s.bytes();
  const auto says = [](const char *text) {
    return std::string(dfm_last_error()).find(text) != std::string::npos;
  };
  EXPECT_EQ(s.set("block", "*", "mu", 0.4), DFM_E_ARG);
  EXPECT_TRUE(
      says("there is no friction rule for ['block', '*'] (rules: ['block', 'floor']); create one with "
           "dfm_world_add_friction"))
      << dfm_last_error();
  EXPECT_EQ(dfm_world_remove_friction(s.w, "nobody", "*"), DFM_E_ARG);
  EXPECT_TRUE(says("there is no friction rule for ['nobody', '*']")) << dfm_last_error();
  EXPECT_EQ(s.set("block", "floor", "mu_K", 0.4), DFM_E_ARG);
  EXPECT_TRUE(says("did you mean")) << dfm_last_error();
  EXPECT_EQ(s.set("block", "floor", "mu", -1), DFM_E_ARG);
  EXPECT_EQ(s.set("block", "floor", "mu", NAN), DFM_E_ARG);
  const dfm_params lost{sizeof lost, 1, nullptr};
  EXPECT_EQ(dfm_world_set_friction(s.w, "block", "floor", &lost), DFM_E_ARG);
  EXPECT_EQ(dfm_world_set_friction(s.w, "block", "floor", nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_world_set_friction(s.w, nullptr, "floor", &lost), DFM_E_ARG);
  EXPECT_EQ(dfm_world_remove_filter(s.w, "block", "floor"), DFM_E_ARG);
  EXPECT_TRUE(says("there is no filter for ['block', 'floor']; create one with dfm_world_filter_pair"))
      << dfm_last_error();
  EXPECT_EQ(s.bytes(), bytes);
}

TEST(FrictionRules, WithoutMemory_NothingIsChanged) {
  Scene s;
  ASSERT_EQ(s.add("*", "*", 0.5, "test.bristle"), DFM_OK);
  ASSERT_EQ(s.add("block", "floor", 0.5, "test.bristle"), DFM_OK);
  s.run(20);
  const auto state = [&] {
    std::vector<char> bytes(s.bytes());
    size_t n = bytes.size();
    test::ok(dfm_world_snapshot(s.w, bytes.data(), &n));
    return bytes;
  };
  const std::vector<char> before = state();
  int refused = 0;
  for (int64_t i = 0;; ++i) {
    Refusal::arm(i);
    const dfm_status status = s.set("block", "floor", "mu", 0.4);
    if (!Refusal::disarm()) {
      EXPECT_EQ(status, DFM_OK);
      break;
    }
    ASSERT_EQ(status, DFM_E_NOMEM);
    ASSERT_EQ(state(), before);
    ++refused;
  }
  EXPECT_GT(refused, 3);
  EXPECT_NE(state(), before);
}

// unsanitized: so many calls take minutes there
TEST(FrictionRules, OnSliders_TakeTheSameMemoryForAnHour) {
  Scene s;
  ASSERT_EQ(s.add("*", "*", 0.5, "test.bristle"), DFM_OK);
  ASSERT_EQ(s.add("block", "floor", 0.5, "test.bristle"), DFM_OK);
  const auto turn = [&](int i) {
    ASSERT_EQ(s.set("block", "floor", "mu", 0.3 + 1e-6 * i), DFM_OK);
    ASSERT_EQ(s.set("*", "*", i % 2 ? "mu" : "sigma0", i % 2 ? 0.3 + 1e-6 * i : 1e8 + i), DFM_OK);
    if (i % 1000 < 3) s.run(1);
  };
  // The first hour meets every state that the second one does: buffers have their size by then.
  for (int i = 0; i < 100000; ++i) turn(i);
  const int64_t live = Refusal::live;
  const size_t bytes = s.bytes();
  for (int i = 0; i < 100000; ++i) turn(i);
  EXPECT_EQ(Refusal::live, live);
  EXPECT_EQ(s.bytes(), bytes);
}

// Rules and filters that come and go, and a law that changes its kind.
TEST(FrictionRules, ThatComeAndGo_TakeTheSameMemory) {
  Scene s;
  std::vector<dfm_contact_event> events(1 << 16);
  uint32_t nevent = 0;
  const auto turn = [&](int i) {
    ASSERT_EQ(s.add("block", "floor", 0.3 + 1e-6 * i, i % 2 ? "coulomb" : "test.bristle"), DFM_OK);
    test::ok(dfm_world_filter_pair(s.w, "block", "floor", true));
    s.run(1);
    if (i % 3 == 0) test::ok(dfm_world_remove_friction(s.w, "block", "floor"));
    test::ok(dfm_world_remove_filter(s.w, "floor", "block"));
    s.run(1);
  };
  const auto turns = [&](int n) {
    for (int i = 0; i < n; ++i) turn(i);
    s.run(500);
    test::ok(dfm_world_events(s.w, 1 << 16, events.data(), &nevent));
    return s.bytes();
  };
  const size_t bytes = turns(60);
  const int64_t live = Refusal::live;
  const size_t after = turns(3000);
  EXPECT_LE(Refusal::live, live + 8);
  EXPECT_LE(after, bytes + 400);
}

TEST(FilterRules, ThatAreRemoved_LetTheMasksDecideAgain) {
  Scene s(0);
  s.run(3000);
  const size_t all = test::contacts(s.w).size();
  EXPECT_GT(all, 0u);
  test::events(s.w);
  test::ok(dfm_world_filter_pair(s.w, "block", "floor", false));
  s.run(1);
  EXPECT_TRUE(test::contacts(s.w).empty());
  EXPECT_EQ(test::events(s.w).size(), all) << "each contact ends with an event";
  test::ok(dfm_world_remove_filter(s.w, "floor", "block"));
  s.run(3000);
  EXPECT_GT(test::contacts(s.w).size(), 0u);
  test::ok(dfm_world_filter_pair(s.w, "block", "floor", true));
  test::ok(dfm_body_set_filter(s.block, 0, 0));
  s.run(1);
  EXPECT_GT(test::contacts(s.w).size(), 0u) << "the rule outranks the masks";
  test::ok(dfm_world_remove_filter(s.w, "block", "floor"));
  s.run(1);
  EXPECT_TRUE(test::contacts(s.w).empty());
}

TEST(FrictionRules, AfterARestore_ContinueAsWithoutIt) {
  const auto run = [](bool restored) {
    Scene s;
    EXPECT_EQ(s.add("*", "*", 0.5, "test.bristle"), DFM_OK);
    EXPECT_EQ(s.add("block", "floor", 0.5, "test.bristle"), DFM_OK);
    s.run(300);
    if (restored) {
      std::vector<char> bytes(s.bytes());
      size_t n = bytes.size();
      test::ok(dfm_world_snapshot(s.w, bytes.data(), &n));
      s.run(7);
      test::ok(dfm_world_restore(s.w, bytes.data(), n));
    }
    EXPECT_EQ(s.set("block", "floor", "mu", 0.02), DFM_OK);
    s.run(100);
    EXPECT_EQ(s.set("block", "floor", "mu", 0.8), DFM_OK);
    s.run(100);
    return dfm_world_hash(s.w);
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(FrictionRules, RestitutionOutOfRange_IsRefusedAndNeedsItsFlag) {
  Scene s;
  dfm_friction_def f{};
  f.size = sizeof f;
  f.flags = DFM_FRICTION_RESTITUTION;
  f.between[0] = f.between[1] = "*";
  f.law = "coulomb";
  for (const double e : {-0.1, 1.01, double(NAN)}) {
    f.restitution = e;
    EXPECT_EQ(dfm_world_add_friction(s.w, &f), DFM_E_ARG) << e;
    test::says({"restitution", "from 0 to 1"});
  }
  f.restitution = 1;
  EXPECT_EQ(dfm_world_add_friction(s.w, &f), DFM_OK);
  f.flags = 2;
  EXPECT_EQ(dfm_world_add_friction(s.w, &f), DFM_E_ARG) << "a flag that there is not";
}
