// Energies of springs (../model_common/spring_energy.h) and cells.
#include "../model_common/spring_energy.h"

#include "msm_body.h"

namespace msm {

double Body::energy(const dfm_kin &k) const {
  double springs = 0, volumes = 0;
  uint32_t first = 0;  // spring that the kernel leaves
  if (form() != kTurned && !has_branch() && edge_off.empty()) {
    first = nedge & ~3u;
    const double *const rests = edge_tilt.empty() ? edge_length.data() : edge_rest.data();
    const double *const tilts = edge_tilt.empty() ? nullptr : edge_tilt.data();
    springs = kernels->spring_energies({first, edges.data(), scale, shape.data(), rests, tilts}, k.x,
                                       k.stride, springs);
  }
  for (uint32_t e = first; e < nedge; ++e) springs += spring_energy(*this, e, k, k.state);
  for (uint32_t n = 0; cells_on && n < nblock; ++n)
    volumes = kernels->cell_energies(block[n], k.x, k.stride, volumes);
  return springs + volumes;
}

void Body::cell_energy(const dfm_kin &k, double *density) {
  for (uint32_t e = 0; e < nedge; ++e)
    edge_energy[e] = edge_volume[e] > 0 ? spring_energy(*this, e, k, k.state) / edge_volume[e] : 0;
  for (uint32_t c = 0; c < ncell; ++c) {
    double sum = 0;
    for (int n = 0; n < 6; ++n) sum += edge_energy[cell_edge[6 * size_t(c) + n]];
    const double *x[4], v0 = cell_volume6[c] / 6;
    for (int a = 0; a < 4; ++a) x[a] = k.x + size_t(k.stride) * cells[4 * size_t(c) + a];
    if (cells_on && v0 > 0) {
      const CellStiffness own = cell_stiffness(c);
      sum += cell_energy_of(x, own.bulk, own.collapse, cell_volume6[c], limit_of(c)) / v0;
    }
    density[c] = sum;
  }
}

}  // namespace msm
