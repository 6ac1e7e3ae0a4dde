// A model that moves its body itself (dfm.stepper/1): it predicts, answers impulses at its surfels, and
// ends the sub-step.
#pragma once
#include "dynamics/dynamics.h"

namespace dfm {

class SelfStepping : public Dynamics {
 public:
  SelfStepping(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model);

  Abilities abilities() const override { return {}; }
  bool bound(double, const AddRowSums &, StepBound &) override { return true; }
  bool free_motion(const SubStep &now, double &kinetic) override;
  bool response(const SubStep &now, uint32_t n, const uint32_t *surfel, double *answers) override;
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  EndState end() const override { return {p_.v_end.data(), mean_.data()}; }
  void bound_ends(double &speed, double &change) const override;
  void commit(const SubStep &now, double fraction) override;

 private:
  Array<double> mean_;     // [npoint,4] m/s
  Array<double> surfels_;  // [nsurfel,3] m/s as the model writes them; N s, zero, where nothing touches
  Array<double> unit_;     // [3n,n,3] N s: unit impulses at the touched surfels

  bool respond(const SubStep &now, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
               double *du) const;
};

}  // namespace dfm
