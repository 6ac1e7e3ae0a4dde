// A sparse symmetric positive definite matrix of 3 x 3 blocks: its factor, and the lowest eigenpairs that a
// solve with it gives. Eigen and Spectra stay inside sparse.cpp and work while a body is created; what a step
// calls is in factor.cpp, in an order of operations that no library decides.
#pragma once
#include <deform/plugin.h>

#include <functional>
#include <vector>

#include "../model_common/buffer.h"
#include "reduced_kernel.h"

namespace reduced {

using model::Buffer;

// A = L L^T of the points in an order that keeps L sparse. Column block j of L holds that of its point with
// itself (a triangle), then the blocks of the points below, in rising order.
class Factor {
 public:
  // ij [nb,2], i <= j, and blk [nb,9] row-major as in dfm_solver. Throws a sentence where the matrix is not
  // positive definite.
  void create(const dfm_host *host, uint32_t n, const std::vector<uint32_t> &ij,
              const std::vector<double> &blk);
  void solve(const double *b, double *x) const;                                // [n,3] each; may be the same
  void solve_eight(const Kernels &kernels, const double *b, double *x) const;  // [n,3,kLanes]

 private:
  uint32_t n_ = 0;
  Buffer<uint32_t> place_;          // [n] of a point in the order
  Buffer<uint32_t> begin_, row_;    // [n + 1], [entries / 9]
  Buffer<double> block_;            // [entries / 9, 9] row-major
  mutable Buffer<double> ordered_;  // [n,3,kLanes]
};

// y = C x for [3 n] numbers: C symmetric, >= 0.
using Apply = std::function<void(const double *x, double *y)>;

// Eigenpairs of C with the largest values, falling; vectors of length one, orthogonal.
struct Pairs {
  std::vector<double> value;
  std::vector<std::vector<double>> vector;
};

// The `count` pairs of the largest values (fewer where C has fewer above zero), copies of a multiple value
// all among them. Throws a sentence where they are not found.
Pairs largest_pairs(size_t size, const Apply &c, size_t count);

}  // namespace reduced
