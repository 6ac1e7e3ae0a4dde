// What hits the ground bounces at the defaults, where bodies are implicit between impacts
// (doc/decisions/implicit_time.md).
#include <algorithm>
#include <cstdio>
#include <string>

#include "logged_context.h"
#include "support.h"
#include "world.h"

namespace {

dfm_world_def scene() {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -9.81;
  d.step = 1.0 / 60;  // what `deform` announces where a scene names no step
  return d;
}

// 5 cm, undamped, its lowest point 0.45 m above a plane.
dfm_body drop(dfm_context *c, dfm_world w, double young, const char *model,
              int32_t integrator = DFM_INTEGRATOR_AUTO) {
  test::BodyOptions o;
  o.name = "ball";
  o.model = model;
  o.young = young;
  o.position = {0, 0, 0.5};
  o.integrator = integrator;
  const dfm_body ball = test::make_body(c, w, "ball", {0.05, 0, 0}, 2000, o);
  test::add_plane(w, "floor");
  return ball;
}

double offered(dfm_world w) {
  double h = 0;
  test::ok(dfm_world_stable_step(w, &h, nullptr, nullptr));
  return h;
}

void step(dfm_world w, double h) {
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(w, h, &trouble), DFM_OK) << dfm_last_error();
}

struct Bounce {
  double down = 0, up = 0;       // m/s, of its middle
  double implicit = 0, all = 0;  // s
  unsigned changes = 0;
};

// Steps of h, or those that the library offers where that is 0.
Bounce bounce(double young, const char *model, double h = 0, int32_t integrator = DFM_INTEGRATOR_AUTO) {
  const test::Context c;
  dfm_world_def d = scene();
  if (h > 0) d.step = h;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  const dfm_body ball = drop(c, w, young, model, integrator);
  Bounce out;
  while (dfm_world_time(w) < 0.4 && !testing::Test::HasFatalFailure()) {
    step(w, h > 0 ? h : std::min(offered(w), 0.02));
    const dfm_body_measure m = test::measure(ball);
    const double v = m.velocity[2];
    out.down = std::max(out.down, -v);
    out.up = std::max(out.up, v);
  }
  const std::string reported = test::written(dfm_world_explain, w);
  const size_t at = reported.find("\"auto\":{");
  if (at == std::string::npos) return out;
  const int read =
      std::sscanf(reported.c_str() + at, "\"auto\":{\"steps_s\":%lf,\"implicit_s\":%lf,\"changes\":%u",
                  &out.all, &out.implicit, &out.changes);
  EXPECT_EQ(read, 3);
  return out;
}

void expect_bounce(double young, const char *model) {
  SCOPED_TRACE(testing::Message() << model << ", " << young << " Pa");
  const Bounce fine = bounce(young, model, 1e-3, DFM_INTEGRATOR_SYMPLECTIC_EULER), now = bounce(young, model);
  EXPECT_GT(fine.up, 0.75 * fine.down);
  EXPECT_GT(now.up, 0.9 * fine.up);
  EXPECT_LT(now.up, fine.down);
  // where contact costs implicit steps more than explicit ones take, those go on a little longer
  EXPECT_LT(now.all - now.implicit, 0.15) << "explicit in the impact";
}

}  // namespace

TEST(Bounce, Springs_AtTheDefaults) {
  for (const double young : {1e6, 5e6, 2e7}) expect_bounce(young, "msm");
}

TEST(Bounce, FiniteElements_AtTheDefaults) {
  for (const double young : {1e6, 5e6, 2e7}) expect_bounce(young, "corotational_fem");
}

// An integrator that the user names stays, and damps the impact.
TEST(Bounce, NamedIntegrator_IsNotStruck) {
  const Bounce b = bounce(2e7, "msm", 0.016, DFM_INTEGRATOR_TR_BDF2);
  EXPECT_LT(b.up, 0.4 * b.down);
}

namespace {

// Three blocks of 1e8 Pa, one on the other, each `gap` above what it falls on.
std::string log_of_stack(double gap) {
  test::LoggedContext c;
  const dfm_world_def d = scene();
  dfm_world w = 0;
  test::ok(dfm_world_create(c.context, &d, &w));
  test::add_plane(w, "floor");
  for (int k = 0; k < 3; ++k) {
    test::BodyOptions o;
    o.name = "block" + std::to_string(k);
    o.model = "msm";
    o.young = 1e8;
    o.position = {0, 0, k * 0.05 + (k + 1) * gap};
    test::make_body(c.context, w, "beam", {0.05, 0.05, 0.05}, 200, o);
  }
  while (dfm_world_time(w) < 0.3 && !testing::Test::HasFatalFailure()) step(w, std::min(offered(w), 0.02));
  return c.log;
}

}  // namespace

TEST(Bounce, StackThatSettles_IsNotStruck) {
  EXPECT_EQ(log_of_stack(1e-4).find("impact of a body"), std::string::npos);
  EXPECT_NE(log_of_stack(0.1).find("impact of a body"), std::string::npos) << "the test would see it";
}

// Also in a step that an impact has made explicit.
TEST(Bounce, InterruptedInAnImpact_IsAsBeforeTheStep) {
  struct Stop {
    dfm_world world = 0;
    int at = -1, met = 0;
    static void pre_solve(void *user, dfm_contact_choice *) {
      Stop &s = *static_cast<Stop *>(user);
      if (s.met++ == s.at) test::ok(dfm_world_interrupt(s.world));
    }
  };
  const test::Context one, other;
  Stop plain, tried;
  for (Stop *s : {&plain, &tried}) {
    const dfm_world_def d = scene();
    dfm_context *const c = s == &plain ? one : other;
    test::ok(dfm_world_create(c, &d, &s->world));
    drop(c, s->world, 2e7, "msm");
    test::ok(dfm_world_set_pre_solve(s->world, &Stop::pre_solve, s));
  }
  int stopped = 0;
  bool struck = false;
  while (dfm_world_time(plain.world) < 0.32 && !testing::Test::HasFatalFailure()) {
    const double h = std::min(offered(plain.world), 0.02);
    EXPECT_EQ(std::min(offered(tried.world), 0.02), h);
    plain.met = 0;
    step(plain.world, h);
    if (plain.met > 0) {  // at its last contact
      const std::string before = test::snapshot(tried.world);
      tried.met = 0;
      tried.at = plain.met - 1;
      ASSERT_EQ(dfm_world_step(tried.world, h, nullptr), DFM_DISCARD);
      EXPECT_EQ(test::snapshot(tried.world).size(), before.size());
      tried.at = -1;
      ++stopped;
    }
    step(tried.world, h);
    ASSERT_EQ(dfm_world_hash(tried.world), dfm_world_hash(plain.world)) << dfm_world_time(plain.world);
    const std::string reported = test::written(dfm_world_explain, tried.world);
    struck = struck || reported.find("until an impact is over") != std::string::npos;
  }
  EXPECT_GT(stopped, 0);
  EXPECT_TRUE(struck);
}

// A step that is too long for explicit bodies ends the impact.
TEST(Bounce, InterruptedWhereAnImpactEnds_IsAsBeforeTheStep) {
  const test::Context one, other;
  dfm_world w[2] = {0, 0};
  for (int k = 0; k < 2; ++k) {
    dfm_world_def d = scene();
    d.max_substeps = 300;
    test::ok(dfm_world_create(k == 0 ? one : other, &d, &w[k]));
    drop(k == 0 ? one : other, w[k], 2e7, "msm");
  }
  const auto struck = [](dfm_world world) {
    return test::explain(world).find("until an impact is over") != std::string::npos;
  };
  while (!struck(w[0]) && dfm_world_time(w[0]) < 0.4) {
    const double h = std::min(offered(w[0]), 0.002);
    for (const dfm_world world : w) step(world, h);
  }
  ASSERT_TRUE(struck(w[0]));
  test::ok(dfm_world_interrupt(w[1]));
  ASSERT_EQ(dfm_world_step(w[1], 0.1, nullptr), DFM_DISCARD);
  EXPECT_NE(std::string(dfm_last_error()).find("interrupted"), std::string::npos) << dfm_last_error();
  EXPECT_TRUE(struck(w[1]));
  EXPECT_EQ(dfm_world_hash(w[1]), dfm_world_hash(w[0]));
  for (int k = 0; k < 5; ++k) {
    const double h = std::min(offered(w[0]), 0.002);
    EXPECT_EQ(std::min(offered(w[1]), 0.002), h);
    for (const dfm_world world : w) step(world, h);
    EXPECT_EQ(dfm_world_hash(w[1]), dfm_world_hash(w[0]));
  }
  step(w[1], 0.1);
  EXPECT_FALSE(struck(w[1]));
}

TEST(Bounce, RestoredWithinAnImpact_ContinuesWithTheSameBits) {
  const test::Context one, many(3);
  dfm_world w[2] = {0, 0};
  for (int k = 0; k < 2; ++k) {
    const dfm_world_def d = scene();
    test::ok(dfm_world_create(k == 0 ? one : many, &d, &w[k]));
    drop(k == 0 ? one : many, w[k], 2e7, "msm");
  }
  const auto to = [](dfm_world world, double t) {
    while (dfm_world_time(world) < t) step(world, std::min(offered(world), 0.002));
    return dfm_world_hash(world);
  };
  const auto implicit = [&] {
    return test::written(dfm_world_explain, w[0]).find("\"used\":\"tr_bdf2\"") != std::string::npos;
  };
  double t = 0.2;
  while (implicit() && t < 0.4) to(w[0], t += 1e-3);
  ASSERT_FALSE(implicit());
  const std::string within = test::snapshot(w[0]);
  const uint64_t end = to(w[0], t + 0.1);
  EXPECT_TRUE(implicit());
  test::ok(dfm_world_restore(w[1], within.data(), within.size()));
  EXPECT_EQ(to(w[1], t + 0.1), end);
}
