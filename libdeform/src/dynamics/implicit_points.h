// Points that the library moves implicitly under the forces of a model that gives their stiffness:
//
//   r(v) = M (v - v0) - h (f(x0 + h v, v) + loads + M g) = p        p: contact impulses at the points, N s
//   A    = dr/dv = M - h df/dv - h^2 df/dx
//
// Backward Euler is this with x0, v0 at the start of the sub-step and h its length. TR-BDF2 (Bank et al.
// 1985, Transient simulation of silicon devices and circuits, section III) is this twice with a part of h and
// other x0, v0. Contact is solved for with backward Euler alone: doc/decisions/implicit_time.md.
//
// free_motion() solves r(v) = 0 by Newton's method with a line search, with the rest state's factor in place
// of A (rest_factor.h) or with the last A. With contact the solve of contact finds v and p together
// (contact/newton.h), so that forces and contacts hold at the same state, the end of the sub-step. Linear
// momentum is conserved to the tolerance: the forces of a model and the rows of its stiffness sum to zero.
// Source: Baraff and Witkin 1998, Large steps in cloth simulation, section 3.
#pragma once
#include <memory>

#include "body/implicit_system.h"
#include "dynamics/dynamics.h"
#include "dynamics/rest_factor.h"
#include "dynamics/stiffness.h"
#include "math/anderson.h"
#include "math/linear_solver.h"

namespace dfm {

class ImplicitPoints : public Dynamics, public ImplicitSystem {
 public:
  ImplicitPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                 const ImplicitOptions &options);

  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool choose_scheme(bool touched) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  double accurate_step(const SubStep &now) const override;
  bool end_forces(const SubStep &) override { return !staged_ && evaluate_after(p_.v_end.data(), false); }
  void commit(const SubStep &now) override;

  BlockPattern pattern() const override { return stiffness_.pattern(); }
  double mass() const override { return moving_; }
  const double *start() const override { return (solved_ ? p_.v_end : p_.v).data(); }
  const double *places() const override { return p_.x.data(); }
  const double *diagonal_inverse() const override { return alone_.data(); }
  bool residual(const double *v, double *r) override;
  bool matrix(const uint32_t *at, double *blk) override;
  void take(const double *v) override;

 protected:
  ImplicitOptions options_;
  Array<double> softness_;  // [npoint] N/m, stiffness of loads; empty: none

  double largest_diagonal() const;  // kg, of A
  // v_free: Newton's first correction of the velocities at the start, as a whole
  bool take_first_way(const SubStep &now);
  // adds scale times the impulses at the surfels [nsurfel,3] to the free points [npoint,3]
  void spread_impulses(const double *surfel_impulse, double scale, Array<double> &to) const;

 private:
  ModelStiffness stiffness_;
  Memory memory_;
  std::unique_ptr<RestFactor> rest_;     // null if the solver is not direct, or only one solve is allowed
  std::unique_ptr<LinearSolver> exact_;  // of A itself; null until it is needed
  bool by_rest_ = false;                 // which of the two represents A
  uint32_t slow_ = 0;                    // iterations with rest_ that did not halve the residual
  Anderson ways_;
  // The present stage: its h (s); s since the start of the sub-step, and its start; x0, v0 ([npoint,4] m,
  // m/s). Loads and gravity are interpolated linearly between start and end.
  struct Stage {
    double h, elapsed, time;
    const double *x, *v;
    double share;
    Vec3 gravity;
  };
  Stage stage_{};
  bool staged_ = false;                  // this sub-step uses TR-BDF2
  Array<double> stage_x_, stage_v_;      // [npoint,4] m, m/s: x0, v0 of its stages
  Array<double> middle_;                 // [npoint,4] m/s, the end of its first stage
  Array<double> x_, v_;                  // [npoint,4] m, m/s: state of the last force evaluation
  Array<double> residual_;               // [npoint,3] N s
  Array<double> push_, there_, change_;  // [npoint,3] m/s: scratch; a solution
  Array<double> springs_, dampers_;      // [npoint] N/m, N s/m of loads
  Array<double> weight_, scale_;         // [npoint,3] kg, diagonal of A; 1/kg, its inverse; zero where held
  Array<uint8_t> held_;                  // [npoint] as in the present factor
  Array<double> alone_;                  // [npoint,4] scale_
  double moving_ = 0;                    // kg, of points that are not held
  double factor_h_ = 0;                  // s, of the present factor; 0: none
  std::vector<double> factor_params_;    // of the model at that time, if its stiffness is constant
  bool solved_ = false;                  // v_end is the solution of a contact solve

  std::unique_ptr<LinearSolver> new_solver() const;
  bool begin_stage(const SubStep &now);
  bool evaluate_after(const double *v, bool commits);
  void turn_on();
  bool evaluate_at(const dfm_kin &k, double share);
  bool newton(Array<double> &v);
  bool two_stages(const SubStep &now);
  bool solve_stage(const SubStep &now, Array<double> &v);
  bool residual_at(const double *v);
  bool take_rest();
  void see_diagonal();
  bool assemble();
  bool linearize();
  bool solve(const Array<double> &b, Array<double> &x);
  bool patient(double left);
  double inertia(uint32_t point, double h) const {  // kg
    return softness_.empty() ? p_.mass[point] : p_.mass[point] + h * h * softness_[point];
  }
  bool solve_way(const Array<double> &r);
  void accelerate(const Array<double> &v);
  void add(Array<double> &v, double share) const;
  bool search(Array<double> &v);
  double scaled_square(const Array<double> &r) const;
  double allowed_error(const Array<double> &v, double share) const;
};

}  // namespace dfm
