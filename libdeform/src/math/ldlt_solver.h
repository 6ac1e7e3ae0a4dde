// Direct solver: A = P^T L D L^T P with a minimum-degree order of the points, by Eigen's simplicial
// factorization; L is applied to many right-hand sides at once by loops of our own.
#pragma once
#include <memory>

#include "math/linear_solver.h"

namespace dfm {

class LdltSolver final : public LinearSolver {
 public:
  explicit LdltSolver(const Memory &memory, Tasks *tasks = nullptr);
  ~LdltSolver() override;

  const char *name() const override { return "ldlt"; }
  bool direct() const override { return true; }
  void analyse(const BlockPattern &pattern) override;
  bool factor(const double *blk) override;
  bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) override;
  bool restricted(uint32_t nsel, const uint32_t *sel, double tolerance, double *w, SolveInfo &info) override;

 private:
  struct Factor;  // Eigen's objects
  // A right-hand side's components, in the order of the factor and with kPanel of them beside each other.
  static constexpr uint32_t kPanel = 8;
  void forward(uint32_t first, double *panel) const;
  void backward(double *panel) const;
  template <class F>
  void each(uint32_t count, F &&f) const;  // f(0) ... f(count - 1), on the threads there are

  Tasks *tasks_;
  std::unique_ptr<Factor> factor_;
  uint32_t n_ = 0, nb_ = 0;
  bool ready_ = false;
  Array<uint32_t> place_;             // [n] position of a point in the order of elimination
  Array<uint32_t> target_;            // [nb,9] where each value of a block goes, UINT32_MAX nowhere
  Array<double> diagonal_;            // [3n] of A
  Array<double> panels_;              // scratch: right-hand sides in panels, [panel][row][kPanel]
  Array<uint32_t> selected_, first_;  // scratch of restricted: order of the points, first row of each panel
};

}  // namespace dfm
