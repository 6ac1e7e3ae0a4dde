// Row sums of the stiffness of linear tetrahedra at rest, for the step bound: with N_ab the norm of block (a,
// b) of a cell's stiffness, which no rotation changes, and weights w (even_rows.h),
//   D_a = sum over cells of (sum_b N_ab w_b) / w_a.
#pragma once
#include "cells.h"
#include "even_rows.h"
#include "tetrahedron.h"

namespace model {

constexpr int kPairOf[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};

// The ten norms of a cell. d: as in material.h.
inline void block_norms(const Tetrahedron &shape, const double (*d)[6], double *norms) {
  for (int a = 0; a < 4; ++a)
    for (int b = a; b < 4; ++b) {
      double one[9];
      stiffness_block(shape, d, a, b, one);
      norms[kPairOf[a][b]] = norm_of(one);
    }
}

// norms [ncell,10]; heights [ncell,4]: |g_a|. Fills weight [npoint]; next [npoint] is room. Then take(c, a,
// row, turn) gets what corner a of cell c adds to the row of its point, and per stiffness against a turning
// of the material in its frame, |g_a| (sum_b |g_b| w_b) / w_a.
template <class Take>
void cell_rows(uint32_t ncell, uint32_t npoint, const uint32_t *cells, const double *mass,
               const double *norms, const double *heights, double *weight, double *next, const Take &take) {
  const auto row = [&](uint32_t c, int a) {
    const uint32_t *q = cells + 4 * size_t(c);
    double sum = 0;
    for (int b = 0; b < 4; ++b) sum += norms[10 * size_t(c) + kPairOf[a][b]] * weight[q[b]];
    return sum;
  };
  even_rows(npoint, mass, weight, next, [&](double *out) {
    for (uint32_t c = 0; c < ncell; ++c)
      for (int a = 0; a < 4; ++a) out[cells[4 * size_t(c) + a]] += row(c, a);
  });
  for (uint32_t c = 0; c < ncell; ++c) {
    const uint32_t *q = cells + 4 * size_t(c);
    const double *h = heights + 4 * size_t(c);
    double sum = 0;
    for (int b = 0; b < 4; ++b) sum += h[b] * weight[q[b]];
    for (int a = 0; a < 4; ++a) take(c, a, row(c, a) / weight[q[a]], h[a] * sum / weight[q[a]]);
  }
}

}  // namespace model
