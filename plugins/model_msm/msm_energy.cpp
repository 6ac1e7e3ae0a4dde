// Energies. A spring holds k/2 (L - L0)^2 in the length that counts (form B), a branch k1/2 p^2 with p the
// stretch of its spring, and form A the integral of its force, which is elementary:
//   E/k = int_l0^l (sqrt(s^2 + w^2) - L0) ds.
// With t = l + L, t0 = l0 + L0, t = t0 (1 + q), b = w^2/t0^2 all terms of first order cancel:
//   E/(k t0^2) = [ q^2/2 + b q^2/(1+q) - (b q)^2/(2 (1+q)^2) - 2 b (q - ln(1+q)) ]/4.
#include <deform/elementary.h>

#include "msm_body.h"

namespace msm {
namespace {

// q - ln(grown), grown = 1 + q; near zero by the series of ln(1+q) = 2 artanh s, s = q/(2+q), so that small
// strains keep their digits.
double less_log(double q, double grown) {
  if (!(q > -0.25 && q < 0.25)) return q - dfm_log(grown);
  const double s = q / (2 + q), s2 = s * s;
  double series = 0;  // s^2/3 + s^4/5 + ..., |s| <= 1/7: ten terms leave 1e-18
  for (int n = 21; n >= 3; n -= 2) series = s2 * (1.0 / n + series);
  return 2 * s * (s / (1 - s) - series);
}

}  // namespace

double turned_energy(double l, double l0, double tilt2) {
  if (!(tilt2 > 0)) return 0.5 * ((l - l0) * (l - l0));
  const double length = __builtin_sqrt(l * l + tilt2);
  const double length0 = __builtin_sqrt(l0 * l0 + tilt2);
  const double t0 = l0 + length0;
  const double b = tilt2 / (t0 * t0);
  // 1 + q by itself: where the ends meet it is w/t0, of which 1 + q would keep no digit
  const double more = l - l0;
  const double q = (more + more * ((l + l0) / (length + length0))) / t0;
  const double grown = (l + length) / t0;
  const double bq = b * q / grown;
  return t0 * t0 * 0.25 * (0.5 * (q * q) + q * bq - 0.5 * (bq * bq) - 2 * b * less_log(q, grown));
}

double Body::spring_energy(uint32_t e, const dfm_kin &k, const Branch &branch) const {
  const uint32_t *ends = edges.data() + 2 * size_t(e);
  const double dd = square_between(k.x + size_t(k.stride) * ends[0], k.x + size_t(k.stride) * ends[1]);
  const double stiff = stiffness_of(e);
  if (form() == kTurned)
    return stiff > 0 ? stiff * turned_energy(__builtin_sqrt(dd), edge_length[e], edge_tilt[e]) : 0;
  const double stretch = __builtin_sqrt(edge_tilt.empty() ? dd : dd + edge_tilt[e]) - rest_length(e);
  if (!has_branch()) return 0.5 * stiff * (stretch * stretch);
  const double kept = branch.state[e] + branch.kept * stretch;
  return 0.5 * stiff * ((1 - branch.part) * (stretch * stretch) + branch.part * (kept * kept));
}

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
  const Branch branch = branch_at(k);
  for (uint32_t e = first; e < nedge; ++e) springs += spring_energy(e, k, branch);
  for (uint32_t n = 0; cells_on && n < nblock; ++n)
    volumes = kernels->cell_energies(block[n], k.x, k.stride, volumes);
  return springs + volumes;
}

void Body::cell_energy(const dfm_kin &k, double *density) {
  const Branch branch = branch_at(k);
  for (uint32_t e = 0; e < nedge; ++e)
    edge_energy[e] = edge_volume[e] > 0 ? spring_energy(e, k, branch) / edge_volume[e] : 0;
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
