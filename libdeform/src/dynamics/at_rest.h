// Forces and stiffness of a model for a body at rest.
#pragma once
#include "body/phyxels.h"
#include "dynamics/model.h"

namespace dfm {

inline constexpr double kForever = 1e9;  // s: longer than any relaxation
// Up to this number of points a factorization is faster than conjugate gradients on a matrix without the mass
// term of a step.
inline constexpr uint32_t kFactoredAtRest = 30000;
// Rounding of forces, relative to the largest product of stiffness and coordinate.
inline constexpr double kForceRounding = 8 * 2.220446049250313e-16;

class AtRest {
 public:
  AtRest(const Memory &memory, Phyxels &points, ModelInstance &model);

  // At the present positions, velocities zero, relaxation and flow complete.
  dfm_kin kin(double time) const;
  // Adds the forces of the model to points().f. Returns false if the model fails.
  bool add_forces(double time);
  // Sets the state of the model to its limit after infinite time (relaxed, flowed). Returns false if there is
  // no limit, or the model fails.
  bool relax(double time);

 private:
  Phyxels &p_;
  ModelInstance &model_;
  Array<double> zero_;  // [npoint,4] velocities
};

}  // namespace dfm
