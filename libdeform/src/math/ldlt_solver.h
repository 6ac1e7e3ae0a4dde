// Direct solver: A = P^T L D L^T P by a multifrontal factorization with supernodes. Order and pattern are
// found once; factor() computes values only.
#pragma once
#include "math/dense_kernel.h"
#include "math/linear_solver.h"
#include "math/supernodes.h"

namespace dfm {

class LdltSolver final : public LinearSolver {
 public:
  explicit LdltSolver(const Memory &memory, Tasks *tasks = nullptr);

  const char *name() const override { return "ldlt"; }
  bool direct() const override { return true; }
  void analyse(const BlockPattern &pattern) override;
  // The same with the positions of the points, [n,3]: uses the order that suits a solid body
  // (nested_dissection.h).
  void analyse(const BlockPattern &pattern, const double *places);
  bool factor(const double *blk) override;
  bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) override;
  // w[3 nsel, 3 nsel] = S A^-1 S^T, row-major and symmetric: how the selected points (each given once)
  // respond to forces on each other.
  bool restricted(uint32_t nsel, const uint32_t *sel, double *w);
  size_t factor_doubles() const { return value_.size(); }  // entries of L that are stored

 private:
  void find_places(const BlockPattern &pattern);
  void assemble(uint32_t s, const double *blk, double *panel);
  void extend_add(uint32_t child, const double *update, uint32_t s, double *panel, double *own) const;
  bool factor_panel(uint32_t s, double *panel, double *own);
  void subtract_product(uint32_t m, uint32_t columns, uint32_t k, const double *a, size_t ld, const double *d,
                        double *c, size_t ldc);
  void solve_one(const double *b, double *x);
  void solve_panel(uint32_t lanes, const double *b, double *x, double *panel) const;
  void find_reach();
  void forward_reached(uint32_t p, double *panel);
  void gram(uint32_t p, uint32_t q, double *sum) const;
  uint32_t slots() const { return tasks_ ? 2 * tasks_->threads() : 1; }

  const DenseKernels &kernels_;
  Tasks *tasks_;
  Supernodes nodes_;
  uint32_t n_ = 0;
  bool ready_ = false;
  // Blocks of A by the supernode of their column: place of its first value in the panel, index of the block,
  // and whether it goes there transposed.
  struct Entry {
    size_t at;
    uint32_t block, transposed;
  };
  Array<uint32_t> entry_begin_;
  Array<Entry> entry_;
  Array<double> value_, pivot_, inverse_, floor_;  // L, D, 1/D, least pivots
  Array<double> stack_, left_, right_;             // scratch of factor
  Array<uint32_t> waiting_;                        // supernodes whose updates are on the stack
  Array<double> panels_;                           // scratch: right-hand sides, [slot][3n][kLanes]

  // For restricted(), in panels of kLanes columns: Y = D^-1/2 L^-1 P S^T.
  Array<uint32_t> order_;                // [nsel] the selected points as they are eliminated
  Array<uint32_t> row_;                  // [columns] row of the unit vector; kNone: the column is empty
  Array<uint32_t> reach_begin_, reach_;  // supernodes that a panel reaches
  Array<size_t> reached_begin_;
  Array<double> reached_;  // Y, rows of the reached supernodes only
};

}  // namespace dfm
