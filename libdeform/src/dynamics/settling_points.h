// Points on their way to an equilibrium with contact, in steps of backward Euler from rest:
//
//   f(x) + loads + M g + contact = (M / h^2 + S) (x - x0)
//
// (S: of compliant loads, and of what slows touched points, N/m)
// which is the condition of equilibrium once x stops changing. M / h^2 decides the length of a step, not
// where steps end; it bounds the motion of bodies that nothing holds (the proximal point method, Rockafellar
// 1976). A step starts with the contact forces of the step before. Without them bodies would fall freely by
// h^2 g before contacts are found, which is meters in a step of a second.
#pragma once
#include "dynamics/implicit_points.h"

namespace dfm {

class SettlingPoints : public ImplicitPoints {
 public:
  // softness: [npoint] N/m, S. error: m, tolerance of Newton's method for points at rest.
  SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                 const ImplicitOptions &options, const std::vector<double> &softness, double error);

  // The contact forces to start with: impulses at the surfels [nsurfel,3] over h seconds; h 0: none.
  void start_from(const double *surfel_impulse, double h);
  // In the next steps, points that contacts push, or have pushed since the last call with 0, resist their
  // motion in a step by this multiple of their own stiffness, as softness does. It shortens steps there, and
  // does not change where they end.
  void slow_touched(double times);
  const double *contact_force() const { return last_.data(); }  // [npoint,3] N, of the last step
  double stiffest() const { return stiffest_; }                 // N/m, of a point, in the last step

  Abilities abilities() const override {
    Abilities a = ImplicitPoints::abilities();
    a.damps = false;  // its steps are not steps in time
    return a;
  }
  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  // with the last contact forces: used to find contacts
  const double *point_velocity() const override { return guess_.data(); }
  const double *start() const override { return guess_.data(); }
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  double accurate_step(const SubStep &) const override { return std::numeric_limits<double>::infinity(); }
  void commit(const SubStep &now, double fraction) override;

 private:
  double error_allowed_, stiffest_ = 0;
  double slowed_ = 0;  // multiple of their own stiffness by which touched points resist
  // [npoint] N/m: stiffness of loads; the model's own at a touched point, else 0
  Array<double> springs_of_loads_, own_;
  Array<double> last_, next_;  // [npoint,3] N, contact forces of the last step and at the end of this one
  Array<double> guess_;        // [npoint,4] m/s
  Array<double> load_;         // [npoint,4] N, loads alone
  // [npoint,3] N s, m/s: the last contact forces, and their effect on velocities
  Array<double> impulse_, taken_;
};

}  // namespace dfm
