// One contact under a friction law, through the public API only: parameters of a case by the law's own keys,
// state held here, and the implicit step of a mass that the contact brakes.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "cli.h"
#include "case.h"
#include "slots.h"

namespace cli {

// Inputs of the law; vt is the mean slip of the step.
struct Slip { double dt = 0, fn = 1, vx = 0, vy = 0, stop_x = 0, stop_y = 0, dwell = 0; };

// What it answered; f is resistive, f = -ft.
struct Resistance {
  double fx = 0, fy = 0, slope = 0, limit = 0, stored = 0;  // slope: df_x/dv_x
  int mode = 0;
  bool stopped = false;  // a set-valued law gave the force that stops the slip
};

class RigLaw {
 public:
  struct alignas(64) Column { double lane[8] = {}; };

  RigLaw(const Globals &globals, const FrictionCase &rig, const std::string &law);
  RigLaw(const RigLaw &) = delete;
  RigLaw &operator=(const RigLaw &) = delete;

  const dfm_type &type() const { return *type_; }
  const dfm_friction &ops() const { return *static_cast<const dfm_friction *>(type_->ops); }
  // N, what makes a coefficient of a force; loads that vary are in Slip
  double normal_force() const { return fn_; }
  double param(const std::string &key, double otherwise, uint32_t at = 0) const;

  // The trial state is kept until commit() or the next evaluation. Throws Failure(kStopped) where the law
  // gives nothing finite.
  Resistance eval(const Slip &slip, bool derivative = false);
  void commit() { state_ = trial_; }
  const std::vector<Column> &memory() const { return state_; }
  void recall(const std::vector<Column> &memory) { state_ = memory; }
  // in a flag: whole numbers in a slot that is no vector in the tangent plane
  bool differs(const std::vector<Column> &other) const;
  // state + share (state - whole), of what is one
  void extrapolate(const std::vector<Column> &whole, double share);
  void reset(const FrictionCase &rig);  // state at rest, or the case's initial z
  double state(uint32_t i) const { return i < state_.size() ? state_[i].lane[0] : 0.0; }
  double trial(uint32_t i) const { return i < trial_.size() ? trial_[i].lane[0] : 0.0; }
  // where the k-th tangent pair of the state begins, -1 where there is none
  int tangent(uint32_t k) const;
  bool jumps_at_rest() const { return (ops().flags & DFM_FRIC_SET_VALUED) != 0; }
  uint64_t evaluations() const { return evaluations_; }

 private:
  void fill_params(const FrictionCase &rig);
  void warn_of(const FrictionCase &rig, const std::vector<std::string> &used) const;

  std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context_;
  dfm_law law_ = 0;
  const dfm_type *type_ = nullptr;
  double fn_ = 1;
  std::vector<double> params_;
  std::vector<dfm_slot> slots_;  // what its parameters call for
  std::vector<Column> state_, trial_;
  uint64_t evaluations_ = 0;
};

// Solves  m_h u + f(u) = drive  for the speed u at the end of a step: m_h = m/h (plus what else is linear in
// u), drive = m v/h + the rest of the applied force. Where a falling Stribeck curve leaves several solutions
// it is the first that is met from the old speed in the direction in which the mass accelerates: the one that
// continues the motion as the step is made smaller.
// falls: R was seen to, or could not be seen, so there may be several solutions; limit: N, what the law
// can carry there.
struct StepResult {
  double u, f;
  bool on_jump, falls = false;
  double limit = 0;
};
StepResult implicit_step(RigLaw &law, Slip slip, double m_h, double drive, double v);

}  // namespace cli
