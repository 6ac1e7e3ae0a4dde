// The matrix of an implicit step with the stiffness of contacts that press back, factored again for each
// (body/backing.h).
#pragma once
#include <memory>
#include <span>

#include "body/backing.h"
#include "geometry/surface.h"
#include "math/linear_solver.h"

namespace dfm {

class BackedMatrix {
 public:
  // solver: direct, has analyzed the pattern
  BackedMatrix(const Memory &memory, const BlockPattern &pattern, std::unique_ptr<LinearSolver> solver);

  // base: [nb,9] kg, held components not treated yet; held: [points], bits as in hold_components(). Returns
  // false if the contacts join points that the pattern does not, or the matrix is not positive definite.
  bool factor(const double *base, const uint8_t *held, const Surface &surface, const Backing &contacts);
  bool solve(const uint8_t *held, const Surface &surface, const Backing &contacts, const double *impulse,
             double *change);
  double factor_work() const { return solver_->factor_work(); }
  double solve_work() const { return solver_->solve_work(); }

 private:
  BlockPattern pattern_;
  std::unique_ptr<LinearSolver> solver_;
  Array<uint32_t> begin_, other_, block_;  // by the first point of a pair: the second one, rising; the block
  Array<double> blocks_, b_, x_;
  double *find(uint32_t i, uint32_t j);  // i <= j; null: no such pair
};

}  // namespace dfm
