// Which bodies move implicitly, where that is left to the library.
#include "plan/integrators.h"

#include <gtest/gtest.h>

#include "dynamics/dynamics.h"

namespace {

using dfm::IntegratorOption;

IntegratorOption body(double substeps, double implicit_work = dfm::kImplicitWork, double work = 100) {
  return {.substeps = substeps, .work = work, .implicit_work = implicit_work, .open = true};
}

std::vector<bool> chosen(std::vector<IntegratorOption> bodies) {
  dfm::choose_integrators(bodies);
  std::vector<bool> out;
  for (const IntegratorOption &b : bodies) out.push_back(b.implicit);
  return out;
}

using Bools = std::vector<bool>;

TEST(Integrators, OneBody_IsImplicitWhereThatIsFourTimesCheaper) {
  const double most = 4 * dfm::kImplicitWork, constant = 4 * dfm::kConstantWork;
  EXPECT_EQ(chosen({body(most)}), Bools{false});
  EXPECT_EQ(chosen({body(most + 1)}), Bools{true});
  EXPECT_EQ(chosen({body(constant, dfm::kConstantWork)}), Bools{false});
  EXPECT_EQ(chosen({body(constant + 1, dfm::kConstantWork)}), Bools{true});
  EXPECT_EQ(chosen({}), Bools{});
}

TEST(Integrators, BodyThatCannot_IsExplicit) { EXPECT_EQ(chosen({body(1e6, 0)}), Bools{false}); }

TEST(Integrators, NamedOnes_Stay) {
  IntegratorOption named = body(1e6);
  named.open = false;
  EXPECT_EQ(chosen({named}), Bools{false});
  named.implicit = true;
  EXPECT_EQ(chosen({named}), Bools{true});
}

TEST(Integrators, BesideAnExplicitBodyOfManySubSteps_NoBodyIsImplicit) {
  IntegratorOption named = body(1000);
  named.open = false;
  EXPECT_EQ(chosen({named, body(500)}), (Bools{false, false}));
  named.implicit = true;
  EXPECT_EQ(chosen({named, body(500)}), (Bools{true, true}));
}

// Implicit time damps: a body that would not take it alone does not because of others.
TEST(Integrators, SoftNeighbor_StaysExplicit) {
  EXPECT_EQ(chosen({body(1), body(1000)}), (Bools{false, true}));
  EXPECT_EQ(chosen({body(150), body(1e5)}), (Bools{false, true}));
  EXPECT_EQ(chosen({body(40, dfm::kImplicitWork, 1e6), body(150)}), (Bools{false, false})) << "150 / 40 < 4";
  EXPECT_EQ(chosen({body(100), body(100), body(100), body(5000), body(100), body(100), body(100), body(100)}),
            (Bools{false, false, false, true, false, false, false, false}))
      << "one sliver among eight mats";
}

// Every explicit sub-step of a neighbor is one of the implicit bodies too.
TEST(Integrators, ImplicitStepsInSubStepsOfANeighbor_AreTakenWhereTheyCostLess) {
  EXPECT_EQ(chosen({body(150), body(1000)}), (Bools{false, false})) << "150 (1 + 50) > 1000 (1 + 1) / 4";
}

}  // namespace
