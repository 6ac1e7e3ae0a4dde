// Length of a vector in a plane. std::hypot of two numbers asks for a symbol of glibc 2.35, which systems of
// 2021 lack, and has other bits with other C libraries; that of three numbers is compiled from a header.
#pragma once
#include <cmath>

namespace cli {

inline double plane_length(double x, double y) { return std::hypot(x, y, 0.0); }

}  // namespace cli
