// Conjugate gradients with a preconditioner of inverted 3x3 blocks (block Jacobi), and, if the solver knows
// the positions of the points, of rigid motions of patches (coarse_space.h).
#pragma once
#include "math/coarse_space.h"

namespace dfm {

class PcgSolver final : public LinearSolver {
 public:
  // max_iterations per right-hand side; 0: as many as the matrix has rows
  // motions: points 2p and 2p + 1 are translation and rotation of a patch (coarse_space.h)
  explicit PcgSolver(const Memory &memory, Tasks *tasks = nullptr, uint32_t max_iterations = 0,
                     bool motions = false);

  const char *name() const override { return "pcg"; }
  bool direct() const override { return false; }
  void analyse(const BlockPattern &pattern) override;
  void place(const double *points, uint32_t stride) override;
  bool factor(const double *blk) override;
  // Stops where sqrt(r.M^-1 r) <= tolerance sqrt(b.M^-1 b).
  bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) override;

 private:
  bool solve_one(const double *b, double *x, double tolerance, SolveInfo &info);
  template <class F>
  void each(F &&f);
  template <class F>
  double sum(F &&f);
  template <class F>
  double precondition(F &&before);

  const BlockKernels &kernels_;
  Tasks *tasks_;
  uint32_t max_iterations_;
  bool ready_ = false;
  BlockMatrix a_;
  Array<double> inverse_;  // [n,9] of the diagonal blocks
  Array<double> r_, z_, p_, q_;
  Array<double> partial_, other_;  // scratch: sums of grains, of r.z and z.q
  double z_q_ = 0;
  CoarseSpace coarse_;
  const double *points_ = nullptr;
  uint32_t stride_ = 0;
  bool with_coarse_ = false, patched_ = false;  // has a factor; has patches
};

}  // namespace dfm
