// The next level of a preconditioner: rigid motions of patches of points. With block Jacobi alone, conjugate
// gradients carry a force through a body by one point per iteration; with this level it arrives at the other
// end in one iteration.
//
//   M^-1 = D^-1 + P C P^T      C about (P^T A P)^-1
//
// A column of P moves one patch along an axis, or turns it about its center, and leaves all else at rest (the
// coarse space of smoothed aggregation without smoothing: Vanek, Mandel and Brezina 1996). Translation and
// rotation of a patch are two points of a matrix of 3x3 blocks, so that C is a solver of such matrices: a
// factorization of a small one, else conjugate gradients with a level more, which reduce the residual by a
// constant factor (the cycle of Notay and Vassilevski 2008).
#pragma once
#include <memory>

#include "math/linear_solver.h"
#include "math/vec3.h"

namespace dfm {

class CoarseSpace {
 public:
  // motions: points 2p and 2p + 1 of the matrix are translation and rotation of a patch of a finer level
  CoarseSpace(const Memory &memory, Tasks *tasks, bool motions);

  void analyse(const BlockRows &rows, uint32_t n);
  // points [n,stride]: present positions, about which the patches turn. Returns false if there is no patch,
  // or the matrix is not positive definite.
  bool factor(const BlockRows &rows, const double *points, uint32_t stride);
  // y = C P^T r; returns r.P y
  double solve(const double *r);
  // z += P y at the points [begin, end); returns z.q there
  double add(uint32_t begin, uint32_t end, const double *q, double *z) const;

 private:
  void form_patches(const BlockRows &rows);
  void find_free(const BlockRows &rows);
  void find_arms(const double *points, uint32_t stride);
  uint32_t multiply(const BlockRows &rows, uint32_t i, uint32_t patch, Vec3 (&sum)[6]) const;
  void assemble(const BlockRows &rows);
  Tasks *tasks() const { return n_ > BlockMatrix::kAlone ? tasks_ : nullptr; }
  bool rotation(uint32_t i) const { return motions_ && i % 2; }

  const Memory &memory_;
  Tasks *tasks_;
  bool motions_;
  uint32_t n_ = 0, patches_ = 0;
  Array<uint32_t> patch_;                  // [n] patch of a point
  Array<uint32_t> member_begin_, member_;  // points of a patch
  Array<double> center_;                   // [2 patches,3]
  Array<double> arm_;                      // [n,3] from the patch's center; 0 of a rotation
  Array<double> free_;                     // [n,3] 1, or 0 for a component that A ties to nothing
  Array<uint32_t> near_begin_, near_;      // patches that a patch shares blocks with, from itself on, rising
  Array<uint32_t> ij_;                     // pairs of coarse points
  Array<double> blk_, r_, y_;
  std::unique_ptr<LinearSolver> solver_;
};

}  // namespace dfm
