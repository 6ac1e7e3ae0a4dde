// Bodies near poisson 1/2 against the truth: with the volume change by points they follow it, without it they
// lock. The study of all cases: tests/bench/locking_study.cpp.
#include "locking.h"

namespace {

TEST(Locking, ThickCylinderNearlyIncompressible_FollowsLameWithNodalVolume) {
  EXPECT_NEAR(test::lame(false, 2, 0.499, 1), 1, 0.005);
  EXPECT_LT(test::lame(false, 2, 0.499, 0), 0.9);
}

TEST(Locking, ThickSphereNearlyIncompressible_FollowsLameWithNodalVolume) {
  EXPECT_NEAR(test::lame(true, 2, 0.499, 1), 1, 0.03);
  EXPECT_LT(test::lame(true, 2, 0.499, 0), 0.5);
}

TEST(Locking, BentBarNearlyIncompressible_BendsWithNodalVolume) {
  EXPECT_NEAR(test::bent_made_bar(0.3, 0), 0.9, 0.1);
  EXPECT_LT(test::bent_made_bar(0.499, 0), 0.55);
  EXPECT_NEAR(test::bent_made_bar(0.499, 1), 0.9, 0.1);
}

TEST(Locking, CooksMembraneInPlaneStrain_RisesAsTheReferenceWithNodalVolume) {
  EXPECT_NEAR(test::cooks_membrane(3, 1), 1, 0.05);
  EXPECT_LT(test::cooks_membrane(3, 0), 0.35);
}

}  // namespace
