// The coupling of a separate surface to the phyxels: a sparse matrix N, computed once from rest positions.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "mesh/cell_finder.h"

namespace dfm {

// x_s = N x_p. Row s holds the phyxels col[row[s]] .. col[row[s + 1] - 1], ascending, with their weights;
// each row sums to one.
struct Coupling {
  Array<uint32_t> row, col;
  Array<double> weight;
  // surfels outside all cells (barycentric) or with too few phyxels in reach (mls, thesis): nearest ones used
  uint32_t outside = 0;
  double farthest = 0;  // m, distance of the farthest such surfel from its cell
};

// Input of couplings, all at rest.
struct CouplingInput : CellsAtRest {
  uint32_t nsurfel = 0;
  const double *surfel = nullptr;  // [nsurfel,3] m
  double support = 3;              // mean distances to the ten nearest phyxels
};

// [nsurfel] the lowest cell that contains each surfel, else the nearest one.
Array<uint32_t> cells_of_surfels(const Memory &memory, const CouplingInput &in);

Coupling couple_barycentric(const Memory &memory, const CouplingInput &in);
Coupling couple_mls(const Memory &memory, const CouplingInput &in);
Coupling couple_thesis(const Memory &memory, const CouplingInput &in);

}  // namespace dfm
