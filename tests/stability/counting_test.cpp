// Small and stiff bodies that are left to the library begin implicitly, and go on explicitly where the count
// of what their steps take says so (doc/decisions/implicit_time.md).
#include <algorithm>
#include <cmath>

#include "logged_context.h"
#include "support.h"
#include "world.h"

namespace {

// A sheet that lands flat: its matrix with all contacts is factored in each implicit step.
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
  test::make_body(context, w, "beam", {0.02, 0.02, 0.001}, 1500, o);
  test::add_plane(w, "floor");
  return w;
}

// By steps that the library chooses, with a record every 0.02 s, to t; what they are made of.
uint64_t to(dfm_world w, double t) {
  constexpr double kEvery = 0.02;
  while (dfm_world_time(w) < t) {
    double h = 0;
    test::ok(dfm_world_stable_step(w, &h, nullptr, nullptr));
    const double now = dfm_world_time(w), record = kEvery * (std::floor(now / kEvery + 1e-9) + 1);
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, std::min(h, record - now), &trouble));
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

constexpr double kFrame = 1.0 / 60;  // s

// A world that is stepped by frames, with a floor.
dfm_world frames_over_a_floor(dfm_context *context) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -9.81;
  d.step = kFrame;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &d, &w));
  test::add_plane(w, "floor");
  return w;
}

// Steps of 1/60 s; a cube of 35 points, 5 cm and 1e7 Pa in each third of them, onto each other: 382 explicit
// sub-steps. They go on explicitly while they fall on each other.
dfm_world cubes(dfm_context *context, int frames, int most = 8) {
  const dfm_world w = frames_over_a_floor(context);
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
    test::ok(dfm_world_step(w, kFrame, &trouble));
  }
  return w;
}

struct Told {
  double all = 0, implicit = 0;
  unsigned changes = 0;
};
Told told(dfm_world w) {
  Told out;
  const std::string text = explained(w);
  const size_t at = text.find("\"auto\":{");
  if (at == std::string::npos) return out;
  EXPECT_EQ(std::sscanf(text.c_str() + at, "\"auto\":{\"steps_s\":%lf,\"implicit_s\":%lf,\"changes\":%u",
                        &out.all, &out.implicit, &out.changes),
            3);
  return out;
}

}  // namespace

TEST(Counting, Explain_TellsWhatStepsWere) {
  const test::Context context;
  const dfm_world w = cubes(context, 60);
  const Told steps = told(w);
  EXPECT_NEAR(steps.all, 1, 1e-9);
  EXPECT_GE(steps.changes, 1u);
  EXPECT_GT(steps.implicit, 0.03);
  EXPECT_LT(steps.implicit, 0.9);
}

namespace {

// Four boxes fall on each other: a landing takes more implicit work than explicit time does, and the stack
// that then stands a tenth of it.
dfm_world boxes(dfm_context *context) {
  const dfm_world w = frames_over_a_floor(context);
  for (int k = 0; k < 4; ++k) {
    test::BodyOptions o;
    o.model = "msm";
    o.young = 2e7;
    o.poisson = 0.45;
    o.damping_stiffness = 1e-4;
    o.position = {0, 0, 0.001 + 0.0605 * k};
    test::make_body(context, w, "beam", {0.1, 0.1, 0.06}, 300, o);
  }
  return w;
}

}  // namespace

// Explicit time has contacts, too, and each costs as much as 30 to 80 cells.
TEST(Counting, StackOfBoxes_IsImplicit) {
  const test::Context context;
  const dfm_world w = boxes(context);
  for (int k = 0; k < 30; ++k) {
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, kFrame, &trouble));
  }
  const Told steps = told(w);
  EXPECT_GT(steps.implicit, 0.6 * steps.all) << steps.changes << " changes";
  const dfm_world chosen = boxes(context);
  to(chosen, 0.5);
  const Told by_library = told(chosen);
  EXPECT_GT(by_library.implicit, 0.8 * by_library.all) << by_library.changes << " changes";
}

// After the landing the ball vibrates, and each implicit step of 16 ms costs too much.
TEST(Counting, NamedStepsThatAllCostTooMuch_AreSeldomTried) {
  const test::Context context;
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -9.81;
  d.step = 0.016;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &d, &w));
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.model = "msm";
  o.young = 5e6;
  o.position = {0, 0, 0.15};
  test::make_body(context, w, "ball", {0.05, 0, 0}, 4320, o);
  const auto steps = [&](int n) {
    for (int k = 0; k < n; ++k) test::ok(dfm_world_step(w, d.step, nullptr));
  };
  steps(12);  // 0.19 s, and 0.14 s to fall
  const unsigned before = told(w).changes;
  ASSERT_GE(before, 1u);
  steps(30);
  EXPECT_LE(told(w).changes, before + 12) << "each try that is given up is two changes";
}

// Neither grows with the number of bodies.
TEST(Counting, OneWarningForAllBodies_AndALineForAllThatChange) {
  test::LoggedContext context;
  cubes(context.context, 60);
  EXPECT_EQ(count(context.log, "which damps"), 1u) << context.log;
  EXPECT_GE(count(context.log, "more are integrated by symplectic_euler"), 1u) << context.log;
  EXPECT_GE(count(context.log, "and 7 more are integrated by implicit steps"), 1u)
      << "cubes that come while others are explicit go back with them: " << context.log;
  EXPECT_EQ(count(context.log, "\n"), 1 + count(context.log, "counted work"));
}
