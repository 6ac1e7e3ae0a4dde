// The mean spin of a body that turns freely, also by more than a radian in a step.
#pragma once
#include <algorithm>
#include <cmath>

#include "math/turn.h"

namespace dfm {

// As mean_spin(); where that turns by more than half a radian, what leads to the end of parts of a tenth,
// one after the other: over a radian its fixed point does not converge, and its energy is anything up to
// L^2 / 2 of the least moment.
inline Vec3 free_spin(Quat q, Vec3 inverse_moments, Vec3 L, double h) {
  constexpr double kWhole = 0.5, kPart = 0.1;  // rad
  constexpr double kMostParts = 4096;
  const bool round = inverse_moments.x == inverse_moments.y && inverse_moments.y == inverse_moments.z;
  const double turn = h * norm(in_axes(q, inverse_moments, L));
  if (round || !(turn > kWhole)) return mean_spin(q, inverse_moments, L, h);
  const double parts = std::min(std::ceil(turn / kPart), kMostParts), part = h / parts;
  Quat at = q;
  for (double k = 0; k < parts; ++k) at = turned(at, part * mean_spin(at, inverse_moments, L, part));
  return (1 / h) * rotation_vector(at * conjugate(q));
}

}  // namespace dfm
