// The rigid motion of points on a line, whose inertia about the line is zero.
#include "body/rigid_motion.h"

#include <gtest/gtest.h>

namespace {

using namespace dfm;

// Three points of 1 kg at -1, 0 and 1 m along a direction that is no axis turn about one across it: moment
// 2 kg m2, and every point has the velocity that it was given.
TEST(RigidMotion, PointsOnAnObliqueLine_TurnAcrossIt) {
  const Vec3 along = (1.0 / 3) * Vec3{1, 2, 2}, across = (1.0 / 3) * Vec3{2, 1, -2};
  const double mass[3] = {1, 1, 1};
  const auto place = [&](uint32_t i) { return (double(i) - 1) * along; };
  const auto velocity = [&](uint32_t i) { return cross(0.7 * across, place(i)) + Vec3{0.1, 0, 0}; };
  const RigidMotion of = rigid_motion(3, mass, place, velocity);
  for (uint32_t i = 0; i < 3; ++i) EXPECT_LT(norm(of.at(place(i)) - velocity(i)), 1e-7);
  EXPECT_LT(norm(of.spin - 0.7 * across), 1e-6);
  // a push across the line at its end: 1/3 kg for the center, 1 m squared over 2 kg m2 for the turn
  EXPECT_NEAR(of.response(place(2), across), 1.0 / 3 + 0.5, 1e-6);
}

}  // namespace
