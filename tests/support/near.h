// Vectors that must be near each other, component by component; the worst of many errors.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

namespace test {

template <class Vector>
void expect_near(const Vector &a, const std::type_identity_t<Vector> &b, double tolerance) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "component " << k;
}

// The larger one, where an error that is no number stays the worst: std::max() would drop it.
inline double worse(double most, double error) { return most >= error || std::isnan(most) ? most : error; }

}  // namespace test
