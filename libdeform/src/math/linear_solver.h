// Solvers of A x = b for symmetric positive definite matrices of 3x3 blocks, behind one interface.
#pragma once
#include "math/block_matrix.h"

namespace dfm {

struct SolveInfo {
  uint32_t iterations = 0;  // of all right-hand sides; 0 for a direct solver
  double residual = 0;      // the largest relative residual that the solver stopped at, in its own norm
  bool indefinite = false;  // a direction of negative or no curvature was met
};

class LinearSolver {
 public:
  virtual ~LinearSolver() = default;
  virtual const char *name() const = 0;
  // Exact up to rounding: neither the tolerance nor what x holds before the call matters.
  virtual bool direct() const = 0;
  // A new pattern; what is asked of the solver before the next factor() is void. Throws where memory ends.
  virtual void analyse(const BlockPattern &pattern) = 0;
  // Where the points are now, [n,stride]: before factor(), read there. Who is told may need fewer iterations.
  virtual void place(const double *points, uint32_t stride) {}
  // New values blk[nb,9], read during the call only. False: the matrix is not positive definite, and nothing
  // may be solved with it.
  virtual bool factor(const double *blk) = 0;
  // b, x [nrhs][n,3], not overlapping; an iterative solver starts from x and ends where the residual is
  // tolerance times that of x = 0. False: it did not get there; x is its best.
  virtual bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) = 0;
  // w[3 nsel, 3 nsel] = S A^-1 S^T, row-major and symmetric: how the selected points, each named once, answer
  // forces on each other.
  virtual bool restricted(uint32_t nsel, const uint32_t *sel, double tolerance, double *w,
                          SolveInfo &info) = 0;
  // Multiplications of a factor() and of a right-hand side (or of one of its iterations), by the pattern
  // alone; those of dense panels, which take less time, as fewer. 0: not known.
  virtual double factor_work() const { return 0; }
  virtual double solve_work() const { return 0; }
};

// restricted() of a solver that can only solve: a right-hand side per column, some at a time.
class RestrictedBySolving {
 public:
  explicit RestrictedBySolving(const Memory &memory) { use_memory(memory, b_, x_); }
  bool run(LinearSolver &solver, uint32_t points, uint32_t nsel, const uint32_t *sel, double tolerance,
           double *w, SolveInfo &info);

 private:
  Array<double> b_, x_;
};

}  // namespace dfm
