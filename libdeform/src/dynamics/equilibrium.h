// The equilibrium of the points of one body: f(x) + loads = 0 in all components that are not held, by
// Newton's method with line search on the stiffness of the model.
#pragma once
#include <functional>
#include <memory>

#include "dynamics/at_rest.h"
#include "dynamics/dynamics.h"
#include "dynamics/stiffness.h"
#include "math/linear_solver.h"

namespace dfm {

struct EquilibriumLimits {
  double tolerance = 1e-10;  // N left per N of the largest load or reaction
  uint32_t iterations = 200;
};
struct EquilibriumResult {
  bool found = false;
  uint32_t iterations = 0;  // linear solves
  double left = 0;          // N, largest component of an unbalanced force
  double scale = 0;         // N, largest component of a load or of a reaction
};

class Equilibrium {
 public:
  // Throws Error if the model has no stiffness.
  Equilibrium(const Memory &memory, Phyxels &points, ModelInstance &model, const ImplicitOptions &options);

  // Writes loads at the present positions, weight included, into f [npoint,4] N.
  using Loads = std::function<void(double *f)>;
  // Goes from the present positions to the equilibrium. softness: [npoint] N/m, stiffness of the loads, added
  // to the matrix. free: no point is held, so the matrix must be regularized. If no equilibrium is found,
  // positions are undefined. Velocities are taken as zero.
  EquilibriumResult find(const EquilibriumLimits &limits, double time, const Loads &loads,
                         const double *softness, bool free);

 private:
  Phyxels &p_;
  ModelInstance &model_;
  ModelStiffness stiffness_;
  std::unique_ptr<LinearSolver> solver_;
  double solve_tolerance_;
  AtRest rest_;
  Array<double> residual_, way_;  // [npoint,3] N; m
  Array<uint8_t> held_;           // as in the present factor
  double floor_ = 0;              // N, rounding of forces at the present positions
  double scale_ = 0;              // N, the largest load or reaction
  bool factored_ = false;

  bool residual(double time, const Loads &loads);
  bool linearize(double time, const double *softness, bool free);
  bool factor(double share);
  bool search(double time, const Loads &loads);
  void move(double share);
  double left() const;
};

}  // namespace dfm
