// Contact of bodies that answer impulses by the inverse of a large sparse matrix A, matrix-free: neither A^-1
// nor the responses between contacts are formed (doc/concepts/implicit.md).
//
//   1/2 (v - v_free)^T A (v - v_free) + sum_i phi_i(J_i v)   is least,
//
// where phi_i is the augmented Lagrangian of contact i (Alart and Curnier 1991): -d phi_i / d u is the
// impulse
//   l_n = max(0, l_n' - (u_n + b) / w),   l_t = the linearized law at the slip u_t, with l_n of the last
// update with multipliers l' and a penalty 1/w. The condition A v = b + J^T l(J v) is solved by a semismooth
// Newton method: conjugate gradients on A + J^T C J, C = -dl/du, and a search along the line for the root of
// the directional derivative, which needs no product with A. Then l' = l, until the contacts' own residual is
// good.
//
// Other bodies of the same island take part by their responses (ContactRows: points that answer alone, rigid
// groups, bodies that step themselves). Their matrix is never formed either: with the response as their
// preconditioner, the product of the matrix with a preconditioned residual is the residual.
#pragma once
#include <span>

#include "contact/matrix_points.h"
#include "contact/rigid_modes.h"
#include "contact/solver.h"
#include "math/anderson.h"

namespace dfm {

// Why a solve ended and what it took.
struct AugmentedWork {
  uint32_t updates = 0, newton = 0, iterations = 0;  // of multipliers; systems; conjugate gradients
  double linear = 0;                                 // m/s: max |A_ii^-1 (A v - load - J^T l)_i|
  bool converged = false;
};

class AugmentedSolve {
 public:
  explicit AugmentedSolve(const Memory &memory);
  // [n,4] 1/kg, what an impulse changes of its own point, about: by the blocks of A, and for loose bodies by
  // the rigid motion too. What `alone` of the rows is to be.
  void respond(const MatrixPoints &points, double *out);
  // Before the first run of a sub-step. place: [ndof] the point of each dof of the rows in `points`; kNone:
  // the dof answers by itself or in a block. The rows' y of dofs that are none has been changed by the rows'
  // impulses from y_free.
  void start(const ContactRows &rows, const MatrixPoints &points, std::span<const uint32_t> place);
  void show(ContactRows &rows, const double *v) const;  // the rows' y of matrix points is v
  // What the residuals of contacts are weighed with: the inverse penalties. An impulse that the residual is r
  // off for is exactly what the law answers at a velocity r off.
  Weights weights() const { return {pn_.data(), pt_.data()}; }
  // m/s, max |A_ii^-1 (A v - load - J^T l)_i| with the rows' impulses, rigid motions included.
  double error(const ContactRows &rows, const MatrixPoints &points, const double *v);
  // On the laws as they were last answered: changes the impulses and y of the rows, and v [n,4].
  // linear: m/s, how large `AugmentedWork::linear` may be. most_newton: systems, at most
  AugmentedWork run(ContactRows &rows, const ContactState &law, double h, const Tolerance &tolerance,
                    double linear, uint32_t most_newton, const MatrixPoints &points, double *v);

 private:
  // A vector over all unknowns: matrix points [n,4], then the dofs of the rows [ndof,4], zero where they are
  // matrix points.
  using Vector = Array<double>;
  uint32_t n_ = 0, ndof_ = 0;
  Array<uint32_t> place_;
  Array<double> local_;           // [n,9] inverse diagonal blocks of A
  Array<double> pn_, pt_;         // [contacts] 1/kg, inverse penalties
  Array<double> inverse_;         // [n,9] of A + J^T C J
  Array<double> touched_;         // [ndof,9] diagonal blocks of J^T C J
  Array<double> normal_;          // [contacts] N s, normal impulse that the friction limits belong to
  Array<double> answer_;          // [contacts,3] N s, at the present velocity
  Array<double> slope_;           // [contacts,4] kg: normal; tangential a, b, c
  Array<double> speed_, change_;  // [contacts,3] relative velocity, and along the direction
  Array<double> seen_, given_;    // [ndof,4] scratch: velocities of dofs, impulses on dofs
  // [contacts,3] multipliers before an update, what it changes, 1/kg what that is weighed with
  Array<double> last_, off_, metric_;
  double last_size_ = 0;
  Anderson updates_;
  RigidModes rigid_;
  Vector force_;  // A v - load, of dofs: A (y - y_free)
  Vector r_, z_, p_, ap_, d_, ad_;

  void set_force(const ContactRows &rows, const MatrixPoints &points, const double *v);
  void penalties(const ContactRows &rows);
  void gather(const double *v);  // -> seen_
  void answers(const ContactRows &rows, const ContactState &law, double h, bool slopes);
  void residual(const ContactRows &rows, const MatrixPoints &points);  // -> r_
  void factor(const ContactRows &rows, const MatrixPoints &points);
  double precondition(const ContactRows &rows, const MatrixPoints &points);  // z_ = P r_; largest m/s
  uint32_t gradients(const ContactRows &rows, const MatrixPoints &points, double first, double target);
  void take(ContactRows &rows, const ContactState &law, double h);
  void extrapolate(ContactRows &rows);
  double search(const ContactRows &rows, const ContactState &law, double h);
};

}  // namespace dfm
