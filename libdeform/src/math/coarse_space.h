// The second level of a preconditioner: rigid motions of patches of points. With block Jacobi alone,
// conjugate gradients carry a force through a body by one point per iteration; with this level it arrives at
// the other end in one iteration.
//
//   M^-1 = D^-1 + P (P^T A P)^-1 P^T      (additive, two levels)
//
// A column of P moves one patch along an axis, or turns it about its center, and leaves all else at rest (the
// coarse space of smoothed aggregation without smoothing: Vanek, Mandel and Brezina 1996).
#pragma once
#include "math/ldlt_solver.h"

namespace dfm {

class CoarseSpace {
 public:
  CoarseSpace(const Memory &memory, Tasks *tasks);

  void analyse(const BlockPattern &pattern, const BlockRows &rows);
  // points [n,stride]: present positions, about which the patches turn. Returns false if the matrix is not
  // positive definite.
  bool factor(const BlockPattern &pattern, const double *blk, const BlockRows &rows, const double *points,
              uint32_t stride);
  // y = (P^T A P)^-1 P^T r; returns r.P y
  double solve(const double *r);
  // z += P y at the points [begin, end)
  void add(uint32_t begin, uint32_t end, double *z) const;

 private:
  void form_patches(const BlockRows &rows);
  void find_free(const BlockRows &rows);
  void find_arms(const double *points, uint32_t stride);
  void assemble(const BlockPattern &pattern, const double *blk);

  Tasks *tasks_;
  uint32_t n_ = 0, patches_ = 0;
  Array<uint32_t> patch_;                  // [n] patch of a point
  Array<uint32_t> member_begin_, member_;  // points of a patch
  Array<double> arm_;                      // [n,3] from the patch's center, in units of its radius
  Array<double> free_;                     // [n,3] 1, or 0 for a component that A ties to nothing
  Array<uint32_t> ij_, first_;             // pairs of coarse points; [nb] first block that a block adds to
  Array<double> blk_, r_, y_;
  LdltSolver solver_;
};

}  // namespace dfm
