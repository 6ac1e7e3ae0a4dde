#include "dynamics/symplectic_euler.h"

#include <algorithm>
#include <limits>

#include "math/width.h"

namespace dfm {

const PointsKernels &points_kernels() {
  if constexpr (kHasWider) {
    if (doubles_at_once() >= 4) return points_kernels_avx2();
  }
  return points_kernels_sse2();
}

// They see 1 / (1 + 2 (s lag)^2 / (1 + 2 s lag)) of a velocity that varies by e^st, and of the roots s of
// s^2 + ratio w^2 s + w^2 the larger is w in size until they are real.
double damper_lag(double ratio, double frequency) {
  // At most so stiff, relative to the springs beside them: half the step that these allow, and a mode with a
  // damping ratio below 0.15 is damped within kError. So is the slowest strain, whatever its ratio.
  constexpr double kStiffening = 3, kError = 0.02;
  const double damped = std::max(1.0, 0.5 * ratio * frequency);
  const double rate = frequency * (damped + std::sqrt(damped * damped - 1));
  return std::min(ratio / kStiffening, std::sqrt(0.5 * kError) / rate);
}

double stable_step(const Phyxels &p, const double *ksum, const double *csum, uint32_t *worst) {
  constexpr double kBeyond = 1 + 1e-9;  // more than rounding
  double best = std::numeric_limits<double>::infinity(), q = 0;
  *worst = p.n;
  for (uint32_t i = 0; i < p.n; ++i) {
    if ((p.held[i] & 7) == 7) continue;  // a held point does not move
    const double k = ksum[i], c = csum[i], m = p.mass[i];
    // q = 4 / (kBeyond best): where 4 k < q (m q - 2 c), c + sqrt(c^2 + 4 m k) < m q, so h > best.
    if (4 * k < q * (m * q - 2 * c)) continue;
    const double h = stable_step(k, c, m);
    if (h < best) {
      best = h;
      q = 4 / (kBeyond * best);
      *worst = i;
    }
  }
  return best;
}

}  // namespace dfm
