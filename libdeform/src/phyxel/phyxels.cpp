#include "phyxel/phyxels.h"

namespace dfm {

double tet_volume(const double *x, uint32_t stride, const uint32_t t[4]) {
  const auto at = [&](int k) { return load3(x + size_t(t[k]) * stride); };
  return tet_volume(at(0), at(1), at(2), at(3));
}

double lump_mass(uint32_t npoint, const double *rest, uint32_t ntet, const uint32_t *tets, double density, double *mass) {
  for (uint32_t i = 0; i < npoint; ++i) mass[i] = 0;
  double volume = 0;
  for (uint32_t t = 0; t < ntet; ++t) {
    const uint32_t *corner = tets + size_t(t) * 4;
    const double v = tet_volume(rest, 3, corner);
    volume += v;
    for (int k = 0; k < 4; ++k) mass[corner[k]] += 0.25 * density * v;
  }
  return volume;
}

void update_inverse_mass(Phyxels &p) {
  for (uint32_t i = 0; i < p.n; ++i)
    for (int k = 0; k < 3; ++k) p.inv_mass[size_t(i) * kStride + k] = p.held[i] & (1 << k) ? 0 : 1 / p.mass[i];
}

}  // namespace dfm
