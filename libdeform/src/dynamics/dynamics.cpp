#include "dynamics/dynamics.h"

#include <algorithm>
#include <cmath>

#include "dynamics/explicit_points.h"
#include "dynamics/implicit_points.h"
#include "dynamics/self_stepping.h"

namespace dfm {

Dynamics::Dynamics(Phyxels &points, Surface &surface, ModelInstance &model)
    : p_(points), surface_(surface), model_(model) {}

dfm_kin Dynamics::kin(double time, double h, bool trial) const {
  dfm_kin k = kin_at(time, h, p_.x.data(), p_.v.data(), model_.state.data());
  k.state_out = trial && !model_.state_out.empty() ? model_.state_out.data() : nullptr;
  return k;
}

void Dynamics::take_part(double share, bool, const double *) {
  for (size_t j = 0; j < p_.x.size(); ++j) p_.x_end[j] = p_.x[j] + share * (p_.x_end[j] - p_.x[j]);
}

void Dynamics::push(uint32_t point, double weight, const double *impulse) {
  const size_t at = size_t(point) * kStride;
  for (size_t k = 0; k < 3; ++k) p_.v[at + k] += weight * p_.inv_mass[at + k] * impulse[k];
  points_changed();
}

std::unique_ptr<Dynamics> make_dynamics(const Memory &memory, Phyxels &points, Surface &surface,
                                        ModelInstance &model, const Array<uint32_t> &edges,
                                        const ImplicitOptions *implicit) {
  if (model.stepper) return std::make_unique<SelfStepping>(memory, points, surface, model);
  if (implicit) return std::make_unique<ImplicitPoints>(memory, points, surface, model, *implicit);
  return std::make_unique<ExplicitPoints>(memory, points, surface, model, edges);
}

}  // namespace dfm
