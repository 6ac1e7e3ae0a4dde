#include "body/phyxels.h"

#include <algorithm>

namespace dfm {

void Phyxels::size(const Memory &m, uint32_t points) {
  n = points;
  const auto zeros = [&](size_t count) { return Array<double>(count, 0.0, m); };
  rest = zeros(size_t{3} * n);
  mass = zeros(n);
  held = Array<uint8_t>(n, 0, m);
  for (Array<double> *a : {&x, &v, &v_free, &x_end, &v_end, &f, &load, &impulse, &inv_mass})
    *a = zeros(size_t{kStride} * n);
}

Extent extent_of(const double *x, size_t n, size_t stride) {
  Extent out;
  for (size_t i = 0; i < n; ++i) out.add(load3(x + stride * i));
  return out;
}

double tet_volume(const double *x, uint32_t stride, const uint32_t t[4]) {
  const auto at = [&](int k) { return load3(x + size_t(t[k]) * stride); };
  return tet_volume(at(0), at(1), at(2), at(3));
}

LumpedMass lump_mass(uint32_t npoint, const double *rest, uint32_t ntet, const uint32_t *tets, double density,
                     const double *cell_density, const double *share, double *mass) {
  for (uint32_t i = 0; i < npoint; ++i) mass[i] = 0;
  LumpedMass sum = {0, 0};
  for (uint32_t t = 0; t < ntet; ++t) {
    const uint32_t *corner = tets + size_t(t) * 4;
    const double v = share ? share[t] * tet_volume(rest, 3, corner) : tet_volume(rest, 3, corner);
    const double rho = cell_density ? cell_density[t] : density;
    sum.volume += v;
    sum.mass += rho * v;
    for (int k = 0; k < 4; ++k) mass[corner[k]] += 0.25 * rho * v;
  }
  if (!cell_density) sum.mass = density * sum.volume;
  return sum;
}

uint8_t Phyxels::held_anywhere() const {
  uint8_t all = 0;
  for (const uint8_t bits : held) all |= bits;
  return all;
}

void update_inverse_mass(Phyxels &p) {
  for (uint32_t i = 0; i < p.n; ++i)
    for (int k = 0; k < 3; ++k)
      p.inv_mass[size_t(i) * kStride + k] = p.held[i] & (1 << k) ? 0 : 1 / p.mass[i];
  p.least_mass = p.n ? *std::min_element(p.mass.begin(), p.mass.end()) : 0;
}

}  // namespace dfm
