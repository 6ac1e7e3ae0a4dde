// Solvers of A x = b for symmetric positive definite matrices of 3x3 blocks, behind one interface.
#pragma once
#include "math/block_matrix.h"

namespace dfm {

struct SolveInfo {
  uint32_t iterations = 0;  // of all right-hand sides; 0 for a direct solver
  double residual = 0;      // the largest relative residual at the end, in the solver's own norm
  bool indefinite = false;  // a direction of negative or no curvature was met
};

class LinearSolver {
 public:
  virtual ~LinearSolver() = default;
  virtual const char *name() const = 0;
  // True: exact up to rounding; the tolerance and the initial x have no effect.
  virtual bool direct() const = 0;
  // Sets a new pattern; call factor() before any solve. Throws if there is not enough memory.
  virtual void analyse(const BlockPattern &pattern) = 0;
  // Sets the present positions of the points, [n,stride], before factor(), which reads them. A solver that
  // uses them may need fewer iterations.
  virtual void place(const double *points, uint32_t stride) {}
  // Sets new values blk[nb,9], read during the call only. Returns false if the matrix is not positive
  // definite; then no solve is allowed.
  virtual bool factor(const double *blk) = 0;
  // b, x [nrhs][n,3], not overlapping; an iterative solver starts from x and ends when the residual is at
  // most tolerance times that of x = 0. Returns false if it did not get there; x is then the best iterate.
  virtual bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) = 0;
};

}  // namespace dfm
