#include "integrate/symplectic_euler.h"

#include <limits>

namespace dfm {

bool predict(Phyxels &p, Vec3 gravity, double h) {
  const double g[4] = {gravity.x, gravity.y, gravity.z, 0};
  double poison[4] = {0, 0, 0, 0};  // stays zero unless a value is infinite or NaN
  for (uint32_t i = 0; i < p.n; ++i) {
    const double m = p.mass[i];
    const size_t at = size_t(i) * kStride;
    for (uint32_t k = 0; k < kStride; ++k) {
      const double v = p.v[at + k] + h * (p.inv_mass[at + k] * (p.f[at + k] + m * g[k]));
      p.v_free[at + k] = v;
      poison[k] += v * 0.0;
    }
  }
  return poison[0] + poison[1] + poison[2] + poison[3] == 0;
}

void commit(Phyxels &p, bool touched, double h) {
  const size_t count = size_t(p.n) * kStride;
  double *const x = p.x.data(), *const v = p.v.data();
  const double *const free = p.v_free.data(), *const w = p.inv_mass.data(), *const impulse = p.impulse.data();
  if (touched) {
    for (size_t i = 0; i < count; ++i) {
      v[i] = free[i] + w[i] * impulse[i];
      x[i] += h * v[i];
    }
  } else {
    for (size_t i = 0; i < count; ++i) {
      v[i] = free[i];
      x[i] += h * v[i];
    }
  }
}

double stable_step(const Phyxels &p, const double *ksum, const double *csum, uint32_t *worst) {
  double best = std::numeric_limits<double>::infinity();
  *worst = p.n;
  for (uint32_t i = 0; i < p.n; ++i) {
    if ((p.held[i] & 7) == 7) continue;  // a held point does not move
    const double k = ksum[i], c = csum[i], m = p.mass[i];
    // h = 4m / (c + sqrt(c^2 + 4 m k)): the same root without cancellation, and defined for k = 0
    const double bottom = c + std::sqrt(c * c + 4 * m * k);
    const double h = bottom > 0 ? 4 * m / bottom : std::numeric_limits<double>::infinity();
    if (h < best) best = h, *worst = i;
  }
  return best;
}

}  // namespace dfm
