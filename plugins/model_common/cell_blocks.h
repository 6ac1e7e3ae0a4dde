// The stiffness of cells at rest, in blocks of pairs of nodes.
#pragma once
#include <algorithm>

#include "buffer.h"
#include "cells.h"

namespace model {

struct CellBlocks {
  uint32_t nodes = 0;
  Buffer<double> block;  // [ncell,each(),9] N/m

  void create(const dfm_host *host, uint32_t kind, uint32_t ncell) {
    nodes = nodes_of(kind);
    block.create(host, 9 * each() * ncell);
  }
  size_t each() const { return size_t(nodes) * (nodes + 1) / 2; }
  // Block (a, b), a <= b, in the order (0, 0), (0, 1) ...
  size_t place(uint32_t a, uint32_t b) const { return size_t(a) * nodes - a * (a + 1) / 2 + b; }
  const double *of(uint32_t c) const { return block.data() + 9 * each() * c; }
  void set(uint32_t c, const RestCell &cell) {
    double *k = block.data() + 9 * each() * c;
    for (uint32_t a = 0; a < nodes; ++a)
      for (uint32_t b = a; b < nodes; ++b)
        for (uint32_t n = 0; n < 9; ++n) *k++ = cell.stiffness[3 * a + n / 3][3 * b + n % 3];
  }

  // out = K u, K the blocks of a cell
  void apply(const double *k, const double (*u)[3], double (*out)[3]) const {
    std::fill(&out[0][0], &out[0][0] + 3 * nodes, 0.0);
    for (uint32_t a = 0; a < nodes; ++a)
      for (uint32_t b = a; b < nodes; ++b, k += 9)
        for (uint32_t i = 0; i < 3; ++i) {
          out[a][i] += (k[3 * i] * u[b][0] + k[3 * i + 1] * u[b][1]) + k[3 * i + 2] * u[b][2];
          if (b > a) out[b][i] += (k[i] * u[a][0] + k[3 + i] * u[a][1]) + k[6 + i] * u[a][2];
        }
  }
  // J, of displacements u; h becomes K u.
  double energy(uint32_t c, const double (*u)[3], double (*h)[3]) const {
    double sum = 0;
    apply(of(c), u, h);
    for (uint32_t a = 0; a < nodes; ++a) sum += (u[a][0] * h[a][0] + u[a][1] * h[a][1]) + u[a][2] * h[a][2];
    return 0.5 * sum;
  }
};

}  // namespace model
