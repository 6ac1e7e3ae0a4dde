// Length of a vector in a plane. std::hypot of two numbers is the C library's: one of glibc 2.35, which older
// systems lack, and other bits elsewhere; of three it is the compiler's.
#pragma once
#include <cmath>

namespace cli {

inline double plane_length(double x, double y) { return std::hypot(x, y, 0.0); }

}  // namespace cli
