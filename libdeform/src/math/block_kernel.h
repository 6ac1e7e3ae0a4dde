// Loops over 3x3 blocks, compiled for several vector widths. Every element sees the same operations in the
// same order at each width. Blocks are stored column after column. A column is loaded as one vector of four;
// its last lane holds the next value in memory and is ignored. Therefore one more double must follow the last
// block.
#pragma once
#include <cstddef>
#include <cstdint>

namespace dfm {

struct BlockRows {  // rows of a BlockMatrix, an even number of blocks each
  const uint32_t *row, *column;
  const double *value;
};

struct BlockKernels {
  // y = A x in rows [begin, end); the sum of x.y there
  double (*multiply)(const BlockRows &a, uint32_t begin, uint32_t end, const double *x, double *y);
  // z = M r, M one block per point; the sum of r.z
  double (*diagonal)(const double *m, uint32_t begin, uint32_t end, const double *r, double *z);
  // x += alpha p, r -= alpha q in rows [begin, end)
  void (*advance)(uint32_t begin, uint32_t end, double alpha, const double *p, const double *q, double *x,
                  double *r);
  // p = z + beta p
  void (*turn)(uint32_t begin, uint32_t end, double beta, const double *z, double *p);
};

const BlockKernels &block_kernels_sse2();
const BlockKernels &block_kernels_avx2();

}  // namespace dfm
