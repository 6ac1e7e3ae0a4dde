// The distance at the start of a sub-step below which a contact between two features is made. Shared by
// broad/, whose lists must cover it, and narrow/, which applies it.
#pragma once
#include <algorithm>
#include <cmath>

#include "geometry/surface.h"

namespace dfm {

// speed: bound of the relative speed, m/s. Twice the motion, because contact impulses change the predicted
// motion.
inline double contact_reach(double h, double offset, double speed) { return 2 * offset + 2 * h * speed; }
// Contribution of one side: contact_reach(va + vb) = reach_share(va) + reach_share(vb).
inline double reach_share(double h, double offset, double speed) { return offset + 2 * h * speed; }

// A surfel behind a face is pushed back only up to this depth: deeper, the nearest face may not be the one
// through which it came.
inline double recovery_depth(const Surface &faces) { return 0.25 * faces.median_edge; }
// Edges that have passed through each other are pushed back up to a smaller depth: their cones of normals are
// less reliable than a face.
inline double edge_recovery_depth(const Surface &a, const Surface &b) {
  return 0.02 * std::min(a.median_edge, b.median_edge);
}
// Within one surface the rest shape determines the sides, not the nearest face alone.
inline double self_recovery_depth(const Surface &s) { return 0.1 * s.median_edge; }

// Largest length of the differences of two arrays [n,4] whose fourth components are zero; y null: of x
// itself. Two points at a time, since every body pays this in every sub-step; a maximum has the same
// bits in any order.
//   common   [4] is taken from each difference
inline double largest_norm(uint32_t n, const double *x, const double *y, const double *common = nullptr) {
  using Two = double __attribute__((vector_size(16)));
  const Two *p = reinterpret_cast<const Two *>(x);
  const Two *q = reinterpret_cast<const Two *>(y);
  const Two *less = reinterpret_cast<const Two *>(common);
  const Two zero = {0, 0}, f = less ? less[0] : zero, g = less ? less[1] : zero;
  Two most = zero;
  for (uint32_t s = 0; s < n; s += 2) {
    const uint32_t i = 2 * s, j = s + 1 < n ? i + 2 : i;
    const Two a = p[i] - (q ? q[i] : zero) - f, b = p[i + 1] - (q ? q[i + 1] : zero) - g;
    const Two c = p[j] - (q ? q[j] : zero) - f, d = p[j + 1] - (q ? q[j + 1] : zero) - g;
    const Two u = a * a + b * b, v = c * c + d * d;
    const Two sum = __builtin_shufflevector(u, v, 0, 2) + __builtin_shufflevector(u, v, 1, 3);
    most = sum > most ? sum : most;
  }
  return std::sqrt(std::max(most[0], most[1]));
}
inline double largest_speed(const Surface &surface) {
  return largest_norm(surface.nsurfel, surface.v.data(), nullptr);
}

}  // namespace dfm
