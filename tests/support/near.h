// Vectors that must be near each other, component by component.
#pragma once
#include <gtest/gtest.h>

#include <type_traits>

namespace test {

template <class Vector>
void expect_near(const Vector &a, const std::type_identity_t<Vector> &b, double tolerance) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "component " << k;
}

}  // namespace test
