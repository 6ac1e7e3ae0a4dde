// A sparse symmetric positive definite matrix of 3 x 3 blocks: its factor by the host's solver
// (dfm.direct/1), and the lowest eigenpairs that a solve with it gives. Eigen stays inside lanczos.cpp and
// tiles.cpp and works while a body is created.
#pragma once
#include <deform/plugin.h>
#include <deform/plugin_draft.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "../model_common/buffer.h"
#include "reduced_kernel.h"

namespace reduced {

using model::Buffer;

constexpr const char *kIndefinite =
    "the stiffness of the mesh is not positive definite: it has flat cells, or parts that nothing holds";

// w [3 n,3 n]: of unit loads at n of all points, each named once, what solve(eight) makes of kLanes side by
// side, [all,3,kLanes] in place.
template <class Solve>
void responses_at(size_t all, uint32_t n, const uint32_t *points, double *w, const Solve &solve) {
  const size_t rows = 3 * size_t(n);
  std::vector<double> eight(kLanes * 3 * all);
  const auto at = [&](size_t j) { return kLanes * (3 * size_t(points[j / 3]) + j % 3); };
  for (size_t first = 0; first < rows; first += kLanes) {
    const size_t many = std::min(kLanes, rows - first);
    std::fill(eight.begin(), eight.end(), 0.0);
    for (size_t l = 0; l < many; ++l) eight[at(first + l) + l] = 1;
    solve(eight.data());
    for (size_t l = 0; l < many; ++l)
      for (size_t j = 0; j < rows; ++j) w[(first + l) * rows + j] = eight[at(j) + l];
  }
}

class Factor {
 public:
  Factor() = default;
  Factor(const Factor &) = delete;
  Factor &operator=(const Factor &) = delete;
  ~Factor();
  // ij [nb,2], i <= j, and blk [nb,9] row-major as in dfm_solver; places [n,3] m. Throws a sentence where
  // the matrix is not positive definite, or the host has no solver.
  void create(const dfm_host *host, uint32_t n, const std::vector<uint32_t> &ij,
              const std::vector<double> &blk, const double *places);
  void solve(const double *b, double *x) const;        // [n,3] each; may be the same
  void solve_eight(const double *b, double *x) const;  // [n,3,kLanes]
  // w[3 nsel,3 nsel]: rows and columns of the inverse at these points, each named once
  void inverse_at(uint32_t nsel, const uint32_t *sel, double *w) const;

 private:
  uint32_t n_ = 0;
  const dfm_direct *direct_ = nullptr;
  void *self_ = nullptr;
  mutable Buffer<double> wide_;  // [2,kLanes,n,3] right-hand sides and solutions
  void solve_wide(uint32_t nrhs) const;
};

// y = C x for kLanes vectors side by side, [size,kLanes] each, not the same: C symmetric, >= 0.
using Apply = std::function<void(const double *x, double *y)>;

// Eigenpairs of C with the largest values, falling; vectors of length one, orthogonal.
struct Pairs {
  std::vector<double> value;
  std::vector<std::vector<double>> vector;
};

// The `count` pairs of the largest values (fewer where C has fewer above zero), copies of a multiple value
// all among them. Throws a sentence where they are not found.
Pairs largest_pairs(const Kernels &kernels, size_t size, const Apply &c, size_t count);

}  // namespace reduced
