// The equations of motion of one body whose points move implicitly, over one sub-step:
//
//     r(v) = p        v: [n,4] m/s, velocities at the end of the sub-step;  p: impulses at the points, N s
//
// with the symmetric matrix A = dr/dv. The contact solve finds v (contact/newton.h). One thread at a time.
#pragma once
#include "math/block_matrix.h"

namespace dfm {

class ImplicitSystem {
 public:
  virtual ~ImplicitSystem() = default;
  virtual BlockPattern pattern() const = 0;  // of A
  virtual double mass() const = 0;           // kg, of the points that move
  // [n,4] m/s: where the solve starts, the last solution where the sub-step has one (of an equilibrium: the
  // guess). Components that are held have their velocity at the end.
  virtual const double *start() const = 0;
  virtual const double *places() const = 0;  // [n,4] m, at the start of the sub-step
  // [n,4] 1/kg, estimate of the inverse of A's diagonal; zero where a component is held
  virtual const double *diagonal_inverse() const = 0;
  // Writes r [n,3]; zero where a component is held. False: the model cannot tell it at v.
  virtual bool residual(const double *v, double *r) = 0;
  // Adds A, at the v of the last residual(), to blk[at[b]] [9] for block b of the pattern; rows and columns
  // of held components are those of the identity. False: the model fails.
  virtual bool matrix(const uint32_t *at, double *blk) = 0;
  virtual void take(const double *v) = 0;  // the solution
};

}  // namespace dfm
