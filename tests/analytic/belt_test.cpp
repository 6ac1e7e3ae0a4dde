// Stick-slip of a soft pad that a spring holds on a belt, against a point mass in the same rig (reference
// set, stickslip_*): a pad that is stiff beside the spring has its period and its amplitude. Laws with
// bristles do only if each contact has bristles for what it carries (contact/exchange.h): with a third of the
// triangles around it each, LuGre's period is 1.1 % short. The whole range of moduli:
// tests/bench/belt_study.cpp.
#include "belt.h"

namespace {

void expect_like_rigid(const char *law) {
  for (const test::belt::Rigid &rigid : test::belt::kRigid) {
    if (std::string(rigid.law) != law) continue;
    const test::belt::Result r = test::belt::run(law, 3e5, 60, 19, 4);
    ASSERT_GE(r.cycles, 1);
    EXPECT_NEAR(r.period, rigid.period, 0.004 * rigid.period);
    EXPECT_NEAR(r.force_max, rigid.force_max, 0.003);
    EXPECT_NEAR(r.force_min, rigid.force_min, 0.003);
  }
}

}  // namespace

TEST(PadOnABelt, Coulomb_SticksAndSlipsAsAPointMass) { expect_like_rigid("coulomb"); }
TEST(PadOnABelt, LuGre_SticksAndSlipsAsAPointMass) { expect_like_rigid("lugre"); }
TEST(PadOnABelt, ElastoPlastic_SticksAndSlipsAsAPointMass) { expect_like_rigid("elastoplastic"); }

// Dahl's law has no Stribeck curve and cannot stick and slip: what the spring and the start shook dies out or
// swings at the spring's own period.
TEST(PadOnABelt, ALawWithoutStribeck_DoesNotStickAndSlip) {
  const test::belt::Result r = test::belt::run("dahl", 1e5, 60, 19, 12);
  EXPECT_LT(r.force_max - r.force_min, 0.4);
  EXPECT_NEAR(0.5 * (r.force_max + r.force_min), 1, 0.02);
}
