// Small and stiff bodies that are left to the library begin implicitly, and go on explicitly where the count
// of what their steps take says so (decision 0400).
#include "logged_context.h"
#include "support.h"
#include "world.h"

namespace {

// A sheet of 1,200 cells that lands flat: 121 contacts, which answer each other where its steps are implicit.
dfm_world sheet(dfm_context *context, int32_t integrator = DFM_INTEGRATOR_AUTO) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -9.81;
  d.step = 1.0 / 60;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &d, &w));
  test::BodyOptions o;
  o.model = "msm";
  o.position = {0, 0, 0.001};
  o.integrator = integrator;
  test::make_body(context, w, "beam", {0.02, 0.02, 0.001}, 600, o);
  test::add_plane(w, "floor");
  return w;
}

// By steps that the library chooses, to t; what they are made of.
uint64_t to(dfm_world w, double t) {
  while (dfm_world_time(w) < t) {
    double h = 0;
    test::ok(dfm_world_stable_step(w, &h, nullptr, nullptr));
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, h, &trouble));
  }
  return dfm_world_hash(w);
}

std::string explained(dfm_world w) { return test::written(dfm_world_explain, w); }

bool is_explicit(dfm_world w) {
  return explained(w).find("\"used\":\"symplectic_euler\"") != std::string::npos;
}

}  // namespace

TEST(Counting, SheetThatLands_ContinuesExplicitly) {
  const test::Context context;
  const dfm_world w = sheet(context);
  to(w, 0.002);
  EXPECT_FALSE(is_explicit(w));
  to(w, 0.04);
  EXPECT_TRUE(is_explicit(w));
  EXPECT_NE(explained(w).find("by count"), std::string::npos);
}

TEST(Counting, NamedIntegrator_Stays) {
  const test::Context context;
  const dfm_world w = sheet(context, DFM_INTEGRATOR_TR_BDF2);
  to(w, 0.03);
  EXPECT_FALSE(is_explicit(w));
}

TEST(Counting, RestoredBeforeAndAfterTheChange_ContinuesWithTheSameBits) {
  const test::Context one, many(3);
  const dfm_world first = sheet(one), second = sheet(many);
  to(first, 0.002);
  const std::string before = test::snapshot(first);
  const uint64_t later = to(first, 0.03);
  ASSERT_TRUE(is_explicit(first));
  const std::string after = test::snapshot(first);
  const uint64_t latest = to(first, 0.034);
  test::ok(dfm_world_restore(second, before.data(), before.size()));
  EXPECT_EQ(to(second, 0.03), later) << "in another world, with other threads";
  EXPECT_EQ(to(second, 0.034), latest);
  const dfm_world third = sheet(many);
  test::ok(dfm_world_restore(third, after.data(), after.size()));
  EXPECT_EQ(to(third, 0.034), latest) << "in a world that has not come to the change";
  test::ok(dfm_world_restore(first, before.data(), before.size()));
  EXPECT_EQ(to(first, 0.034), latest) << "back in the same one";
}

// What lies still costs implicit steps little: the body finds back to them.
TEST(Counting, SheetAtRest_IsImplicitAgain) {
  const test::Context context;
  const dfm_world w = sheet(context);
  to(w, 0.03);
  ASSERT_TRUE(is_explicit(w));
  bool back = false;
  for (double t = 0.05; t < 1 && !back; t += 0.02) {
    to(w, t);
    back = !is_explicit(w);
  }
  EXPECT_TRUE(back);
}

namespace {

uint32_t count(const std::string &text, const std::string &word) {
  uint32_t n = 0;
  for (size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) ++n;
  return n;
}

// Steps of 1/60 s; a cube of 35 points, 5 cm and 1e7 Pa in each third of them, onto each other: 382 explicit
// sub-steps. They go on explicitly while they fall on each other.
dfm_world cubes(dfm_context *context, int frames, int most = 8) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -9.81;
  d.step = 1.0 / 60;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &d, &w));
  test::add_plane(w, "floor");
  for (int f = 0, made = 0; f < frames; ++f) {
    if (f % 3 == 0 && made < most) {
      test::BodyOptions o;
      o.model = "msm";
      o.young = 1e7;
      o.damping_stiffness = 1e-4;
      o.position = {0.02 * (made % 2), 0.02 * (made % 3), 0.01 + 0.055 * made};
      test::make_body(context, w, "beam", {0.05, 0.05, 0.05}, 60, o);
      ++made;
    }
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, d.step, &trouble));
  }
  return w;
}

}  // namespace

TEST(Counting, Explain_TellsWhatStepsWere) {
  const test::Context context;
  const dfm_world w = cubes(context, 60);
  const std::string told = explained(w);
  const size_t at = told.find("\"auto\":{");
  ASSERT_NE(at, std::string::npos) << told;
  double all = 0, implicit = 0;
  unsigned changes = 0;
  ASSERT_EQ(std::sscanf(told.c_str() + at, "\"auto\":{\"steps_s\":%lf,\"implicit_s\":%lf,\"changes\":%u",
                        &all, &implicit, &changes),
            3)
      << told.substr(at);
  EXPECT_NEAR(all, 1, 1e-9);
  EXPECT_GE(changes, 1u);
  EXPECT_GT(implicit, 0.03);
  EXPECT_LT(implicit, 0.9);
}

// Decision 0418.
TEST(Counting, OneWarningForAllBodies_AndALineForAllThatChange) {
  test::LoggedContext context;
  cubes(context.context, 60);
  EXPECT_EQ(count(context.log, "which damps"), 1u) << context.log;
  EXPECT_GE(count(context.log, "more are integrated by symplectic_euler"), 1u) << context.log;
  EXPECT_GE(count(context.log, "and 7 more are integrated by implicit steps"), 1u)
      << "cubes that come while others are explicit go back with them: " << context.log;
  EXPECT_EQ(count(context.log, "\n"), 1 + count(context.log, "counted work"));
}
