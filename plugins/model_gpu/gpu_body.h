// A body that a compute device moves. The host keeps places and velocities: the device's are a copy of them,
// which is renewed where they are not those that the last step left. Equations, limits, cost:
// doc/models/msm_gpu.md.
#pragma once
#include <memory>

#include "../model_common/entry.h"
#include "parts.h"

namespace gpu {

enum Choice : uint32_t { kAuto, kHardware, kSoftware, kReference };

// The device that this choice means, opened once for the process; throws model::Refused after the reason was
// logged in the name of `who`. Not for kReference.
std::unique_ptr<Stepper> open_stepper(const dfm_host *host, const char *who, Choice choice, uint32_t npoint);

// Of: Springs or Cells.
template <class Of>
class Body {
 public:
  using Row = typename Of::Param;
  static constexpr const char *kName = Of::kId;
  const dfm_host *host = nullptr;
  Of &springs() { return parts_; }
  const Of &springs() const { return parts_; }
  void mask_changed() {
    unlike_ = true;
    if constexpr (requires { parts_.put_stiffness(); }) parts_.put_stiffness();
    stepper_->take(parts_.work());
  }
  const char *const *active() const { return parts_.active_effects; }
  const char *idle(Row which) const { return parts_.idle(which); }
  // m/s, the velocity that dampers see; s, the longest sub-step that is stable at the worst shape of the last
  // step, 0 before the first; of branches alone m, r, and b of the last sub-step
  static constexpr dfm_slot kSlots[] = {{DFM_PER_POINT, 3, DFM_SLOT_VECTOR, 0},
                                        {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0},
                                        {DFM_PER_EDGE, 1, DFM_SLOT_SCALAR, 0},
                                        {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0}};
  bool has_branch() const { return parts_.branches.n > 0; }
  void begin(double *state) const;

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);
  bool lacks_state(const dfm_kin &k) const {
    if (k.state) return false;
    model::complain(host, Of::kId, "the host gives no state");
    return true;
  }

  dfm_status predict(const dfm_kin &k, const double *f, double *u_s);
  void respond(const dfm_kin &, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
               double *du);
  void diagonal(const dfm_kin &, uint32_t n, const uint32_t *surfel, double *w) const;
  void commit(const dfm_kin &k, const double *p_s, double *x, double *v);
  void bound(const dfm_kin &k, double *ksum, double *csum);
  double energy(const dfm_kin &k);
  static constexpr uint32_t kFactCount = 3;
  const dfm_fact *facts() const { return facts_; }

 private:
  Of parts_;
  double params_[Of::kValueCount] = {};
  uint32_t npoint_ = 0, nsurfel_ = 0;
  Buffer<double> inverse_mass_;  // [npoint] 1/kg
  Buffer<uint8_t> held_;
  Buffer<uint32_t> surfel_row_, surfel_point_;  // coupling
  Buffer<double> surfel_weight_;
  Buffer<double> impulse_;       // [npoint,3] N s, zero between calls
  Buffer<double> block_energy_;  // J
  std::unique_ptr<Stepper> stepper_;
  bool unlike_ = true;   // the device's arrays may differ from those of stepper_
  Buffer<double> rest_;  // [npoint,3] m
  Dampers dampers_;
  double h_ = 0;      // s, of the step that was predicted
  double part_ = 0;   // s, of its sub-steps
  double shape_ = 0;  // s, stable at its worst shape
  dfm_fact facts_[kFactCount] = {};

  double share() const;
  void take_surface(const dfm_mesh &m);
  double own_frequency();
  void find_lag();
  double longest();
  bool take_points(const dfm_kin &k);
  bool take_loads(const double *f, uint32_t stride);
  template <class F>
  void each_point(const F &f) const {
    Parts::each(host, npoint_, f);
  }
  double free_inverse_mass(uint32_t point, int axis) const {
    return held_[point] >> axis & 1 ? 0 : inverse_mass_[point];
  }
};

}  // namespace gpu
