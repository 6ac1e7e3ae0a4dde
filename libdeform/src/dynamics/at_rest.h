// What a model does with a body that stands still.
#pragma once
#include "body/phyxels.h"
#include "dynamics/model.h"

namespace dfm {

inline constexpr double kForever = 1e9;  // s: longer than any relaxation
// Up to so many points a factorization beats conjugate gradients on a matrix without the mass of a step.
inline constexpr uint32_t kFactoredAtRest = 30000;
// Of the largest stiffness times coordinate: what forces are rounded by.
inline constexpr double kForceRounding = 8 * 2.220446049250313e-16;

class AtRest {
 public:
  AtRest(const Memory &memory, Phyxels &points, ModelInstance &model);

  // In a step of dt seconds at the present positions, velocities zero.
  dfm_kin kin(double time, double dt = kForever) const;
  // The model's forces added to points().f. False: the model cannot.
  bool add_forces(double time, double dt = kForever);
  // What relaxes or flows has done so: the model's next state in a time without end. False: there is none, or
  // the model cannot.
  bool relax(double time);

 private:
  Phyxels &p_;
  ModelInstance &model_;
  Array<double> zero_;  // [npoint,4] velocities
};

}  // namespace dfm
