// A model that moves its body itself (dfm.stepper/1): it predicts, responds to impulses at its surfels, and
// ends the sub-step. If it can compute points later (dfm.late_points/1), a sub-step moves only the points on
// which surfels depend and held points, so the cost of a probe does not grow with the interior.
#pragma once
#include <optional>

#include "dynamics/dynamics.h"

namespace dfm {

class SelfStepping : public Dynamics {
 public:
  SelfStepping(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model);

  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  double contact_step() override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  bool response(const SubStep &now, uint32_t n, const uint32_t *surfel, double *responses) override;
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  void commit(const SubStep &now) override;
  void take_part(double share, bool in_full, const double *surfel_impulse) override;
  bool sums(BodySums &out) const override;

 private:
  Array<double> mean_;     // [npoint,4] m/s
  Array<double> surfels_;  // [nsurfel,3] m/s as the model writes them; N s, zero, where nothing touches
  Array<double> unit_;     // [3n,n,3] N s: unit impulses at the touched surfels
  Array<double> stiffness_, damping_;   // row sums, of a model that names a bound
  std::optional<double> contact_step_;  // s; empty: not asked for yet
  Array<uint32_t> near_;                // late points: those that every sub-step moves

  bool respond(const SubStep &now, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
               double *du) const;
  template <class F>
  void each_moved(F &&f) const;  // f(component) of [npoint,4]
};

}  // namespace dfm
