#include "dynamics/dynamics.h"

#include "dynamics/explicit_points.h"
#include "dynamics/self_stepping.h"

namespace dfm {

Dynamics::Dynamics(Phyxels &points, Surface &surface, ModelInstance &model)
    : p_(points), surface_(surface), model_(model) {}

const double *Dynamics::contact_velocity() const {
  const double *const points = point_velocity();
  return points ? points : surface_.v.data();
}

dfm_kin Dynamics::kin(double time, double h, bool trial) const {
  dfm_kin k{};
  k.size = sizeof k;
  k.stride = kStride;
  k.t = time;
  k.dt = h;
  k.x = p_.x.data();
  k.v = p_.v.data();
  k.state = model_.state.data();
  k.state_out = trial && !model_.state_out.empty() ? model_.state_out.data() : nullptr;
  return k;
}

void Dynamics::push(uint32_t point, double weight, const double *impulse) {
  const size_t at = size_t(point) * kStride;
  for (size_t k = 0; k < 3; ++k) p_.v[at + k] += weight * p_.inv_mass[at + k] * impulse[k];
}

std::unique_ptr<Dynamics> make_dynamics(const Memory &memory, Phyxels &points, Surface &surface,
                                        ModelInstance &model, const Array<uint32_t> &edges) {
  if (model.stepper) return std::make_unique<SelfStepping>(memory, points, surface, model);
  return std::make_unique<ExplicitPoints>(memory, points, surface, model, edges);
}

}  // namespace dfm
