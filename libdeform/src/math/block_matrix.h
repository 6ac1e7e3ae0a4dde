// Symmetric matrices of 3x3 blocks between pairs of points: the stiffness of a model, the matrix of an
// implicit step. Vectors are [n,3].
#pragma once
#include "core/memory.h"
#include "core/tasks.h"
#include "math/block_kernel.h"

namespace dfm {

// The upper triangle by pairs of points, as dfm_model.pattern lists them: i <= j, each pair once, each point
// with itself, in any order. Values blk[nb,9] are row-major, in the same order; block (j, i) is the transpose
// of (i, j).
struct BlockPattern {
  uint32_t n = 0, nb = 0;
  const uint32_t *ij = nullptr;  // [nb,2]
};

// Rows and columns of held components become those of the identity; mask[n]: bits 1 x, 2 y, 4 z.
void hold_components(const BlockPattern &pattern, const uint8_t *mask, double *blk);

// The whole matrix by rows, with both triangles stored: the product reads memory once and in order, and
// threads can share its rows without changing any bit.
class BlockMatrix {
 public:
  explicit BlockMatrix(const Memory &memory);

  void set_pattern(const BlockPattern &pattern);
  void set_values(Tasks *tasks, const double *blk);  // tasks may be null
  uint32_t size() const { return n_; }               // points
  // Blocks of row i: column[k] and value + 9k for k in [row[i], row[i+1]), columns of the matrix rising; each
  // block column after column. Rows have an even number of blocks: one of zeros on the diagonal may follow.
  BlockRows rows() const { return {row_.data(), column_.data(), value_.data()}; }
  const double *diagonal(uint32_t i) const { return &value_[9 * size_t{diagonal_[i]}]; }

  // y = A x in rows [begin, end); returns the sum of x.y there
  double multiply(uint32_t begin, uint32_t end, const double *x, double *y) const {
    return kernels_.multiply(rows(), begin, end, x, y);
  }

  static constexpr uint32_t kGrain = 64;   // rows that one thread takes at a time
  static constexpr uint32_t kAlone = 512;  // rows up to which one thread alone is faster

 private:
  const BlockKernels &kernels_;
  uint32_t n_ = 0, nb_ = 0;
  Array<uint32_t> row_, column_, diagonal_;
  Array<uint32_t> upper_, lower_;  // [nb] place of block b of the pattern, as it is and transposed
  Array<double> value_;
};

}  // namespace dfm
