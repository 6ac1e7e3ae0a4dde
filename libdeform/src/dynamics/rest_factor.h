// The matrix A = M - h df/dv - h^2 df/dx of a body at rest, factored once and turned with its points:
//
//   A^-1 ~ T^T G A0^-1 G^T T + U (U^T M U)^-1 U^T      T = I - M U (U^T M U)^-1 U^T
//
// A0 is A in the rest state, G turns each point as its neighborhood has turned since then (Hecht, Lee,
// Shewchuk and O'Brien 2012, Updated sparse Cholesky factors for corotational elastodynamics, section 3), and
// U are the six rigid motions of a body that nothing holds. These belong to the mass alone, and with their
// own term an impulse reaches the body's momentum and angular momentum exactly, however far A0 is from A.
//
// The result depends on the rest state, h, the held components and the present positions, and not on earlier
// calls: a restored world computes the same bits.
#pragma once
#include <memory>

#include "body/rigid_motion.h"
#include "dynamics/dynamics.h"
#include "dynamics/stiffness.h"
#include "math/linear_solver.h"

namespace dfm {

class RestFactor {
 public:
  // solver: direct, has analyzed the pattern of the stiffness
  RestFactor(const Memory &memory, const Phyxels &points, ModelInstance &model, ModelStiffness &stiffness,
             std::unique_ptr<LinearSolver> solver);

  // Factors for sub-steps of h seconds and the present held components; returns at once if nothing has
  // changed. Returns false if it cannot be used: A0 is not positive definite, or rotating points are held in
  // some directions only.
  bool prepare(double h);
  // Rotates to the present positions, [npoint,4] m.
  void turn(const double *x);

  bool solve(const double *b, double *x);                      // [npoint,3]
  const Array<double> &diagonal() const { return diagonal_; }  // [npoint,3] kg, 0 where held

 private:
  const Phyxels &p_;
  ModelInstance &model_;
  ModelStiffness &stiffness_;
  std::unique_ptr<LinearSolver> solver_;
  bool turns_ = false;                   // G is not the identity
  Array<double> rest_;                   // [npoint,4] m
  Array<double> state_;                  // of the model when the factor was made
  Array<double> stiff_, damp_;           // [nb,9] df/dx, df/dv at rest
  std::vector<double> params_;           // of the model when these were computed
  double h_ = 0;                         // s, of the factor; 0: none
  Array<uint8_t> held_;                  // [npoint] as in the factor
  bool serves_ = false, loose_ = false;  // loose: no point is held
  Array<double> diagonal_;
  Array<double> turned_;  // [npoint,9] G, row-major
  Array<double> b_, y_;   // [npoint,3] scratch of solve

  RigidMotion rigid_;  // of the body at the present positions, without its velocities
  Array<double> arm_;  // [npoint,3] m, from the center

  bool query_stiffness();
  struct Motion { Vec3 speed, spin; };
  Motion motion_of(Vec3 impulse, Vec3 moment) const;
  void find_turns(const double *x);
  void find_rigid(const double *x);
};

}  // namespace dfm
