// sin in a step: + - * / only, so that the bits do not depend on the variant of libm that the processor
// selects.
#pragma once
#include <cmath>

namespace dfm {

// sin(2 pi turns). The argument is reduced exactly to |r| <= 1/8 turn; Taylor polynomials to below one unit
// in the last place there.
inline double sin_turns(double turns) {
  double r = turns - std::floor(turns + 0.5);  // [-0.5, 0.5)
  const double sign = r < 0 ? -1 : 1;
  r = r < 0 ? -r : r;
  if (r > 0.25) r = 0.5 - r;  // sin(pi - x) = sin x
  const double tau = 6.283185307179586476925;
  if (r <= 0.125) {
    const double x = tau * r, q = x * x;
    double s = -1.0 / 1307674368000.0;
    s = s * q + 1.0 / 6227020800.0;
    s = s * q - 1.0 / 39916800.0;
    s = s * q + 1.0 / 362880.0;
    s = s * q - 1.0 / 5040.0;
    s = s * q + 1.0 / 120.0;
    s = s * q - 1.0 / 6.0;
    return sign * (x + x * q * s);
  }
  const double x = tau * (0.25 - r), q = x * x;  // sin = cos of the complement
  double c = 1.0 / 20922789888000.0;
  c = c * q - 1.0 / 87178291200.0;
  c = c * q + 1.0 / 479001600.0;
  c = c * q - 1.0 / 3628800.0;
  c = c * q + 1.0 / 40320.0;
  c = c * q - 1.0 / 720.0;
  c = c * q + 1.0 / 24.0;
  c = c * q - 0.5;
  return sign * (1.0 + q * c);
}

}  // namespace dfm
