// Small and stiff bodies that are left to the library begin implicitly, and go on explicitly where the count
// of what their steps take says so (decision 0400).
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
