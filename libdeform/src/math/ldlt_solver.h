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
  bool restricted(uint32_t nsel, const uint32_t *sel, double tolerance, double *w, SolveInfo &info) override;
  void forget_restricted();  // frees the cache of restricted(), which is for points that recur
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
  void forget();
  void learn();
  void find_reach(uint32_t first);
  void forward_reached(uint32_t p, double *panel);
  void gram(uint32_t p, uint32_t q, double *sum) const;
  uint32_t slots() const { return tasks_ ? 2 * tasks_->threads() : 1; }

  const DenseKernels &kernels_;
  Tasks *tasks_;
  Supernodes nodes_;
  uint32_t n_ = 0;
  bool ready_ = false;
  // Blocks of A by the supernode of their column: index of the block, place of its first value in the panel,
  // and whether it goes there transposed.
  struct Entry { uint32_t block, at, transposed; };
  Array<uint32_t> entry_begin_;
  Array<Entry> entry_;
  Array<double> value_, pivot_, inverse_, floor_;  // L, D, 1/D, least pivots
  Array<double> stack_, left_, right_;             // scratch of factor
  Array<uint32_t> waiting_;                        // supernodes whose updates are on the stack
  Array<double> panels_;                           // scratch: right-hand sides, [slot][3n][kLanes]

  // Results of restricted() for the present factor: Y = D^-1/2 L^-1 P S^T of the points of all calls so far,
  // and Y^T Y. Columns are in panels of kLanes; every call with new points begins a new panel.
  uint32_t known_ = 0;      // points
  Array<uint32_t> row_;     // [columns] row of Y^T's unit vector in the order of elimination; kNone: empty
  Array<uint32_t> column_;  // [n] first column of a point, kNone
  Array<uint32_t> fresh_;   // scratch: points that are not known yet
  Array<double> root_;      // 1/sqrt(D)
  Array<uint32_t> reach_begin_, reach_;  // supernodes that a panel reaches
  Array<size_t> reached_begin_;
  Array<double> reached_;  // Y by panels, rows of the reached supernodes only
  Array<double> product_;  // Y^T Y, tiles [kLanes, kLanes] of the lower triangle, row after row
};

}  // namespace dfm
