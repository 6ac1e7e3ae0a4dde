#include "dynamics/dynamics.h"

#include <algorithm>
#include <cmath>

#include "body/rigid_motion.h"
#include "dynamics/explicit_points.h"
#include "dynamics/implicit_points.h"
#include "dynamics/self_stepping.h"

namespace dfm {

Dynamics::Dynamics(Phyxels &points, Surface &surface, ModelInstance &model)
    : p_(points), surface_(surface), model_(model) {}

dfm_kin Dynamics::kin(double time, double h, bool trial) const {
  dfm_kin k = kin_at(time, std::max(h, least_h_), p_.x.data(), p_.v.data(), model_.state.data());
  k.state_out = trial && !model_.state_out.empty() ? model_.state_out.data() : nullptr;
  return k;
}

Unknowns Dynamics::unknowns() const {
  if (model_.stepper) return {surface_.v.data()};
  return {p_.v_free.data(), system_ ? nullptr : p_.inv_mass.data(), system_};
}

void Dynamics::take_part(double share, bool, const double *) {
  for (size_t j = 0; j < p_.x.size(); ++j) p_.x_end[j] = p_.x[j] + share * (p_.x_end[j] - p_.x[j]);
}

void Dynamics::push(uint32_t point, double weight, const double *impulse) {
  const size_t at = size_t(point) * kStride;
  for (size_t k = 0; k < 3; ++k) p_.v[at + k] += weight * p_.inv_mass[at + k] * impulse[k];
  points_changed();
}

void Dynamics::see_points() {
  if (!unseen_.load(std::memory_order_acquire)) return;
  const std::lock_guard<std::mutex> one(seeing_);
  if (!unseen_.load(std::memory_order_relaxed)) return;
  const dfm_kin k = kin(0, 0);
  model_.call("points", [&] { return model_.late->points(model_.self, &k, p_.x.data(), p_.v.data()); });
  unseen_.store(false, std::memory_order_release);
}

void Dynamics::points_changed() {
  if (!model_.late) return;
  model_.call("look", [&] { return model_.late->look(model_.self, model_.state.data()); });
}

// K v = (f(x - e v) - f(x + e v)) / 2 e, v the velocity less the rigid motion: that strains nothing, but in a
// strained body it would seem to. f, x_end and v_end are free until the next sub-step.
void Dynamics::damp(double time, double c, double ahead) {
  const auto place = [&](uint32_t i) { return load3(&p_.x[size_t(i) * kStride]); };
  const bool held = p_.held_anywhere() != 0;
  const auto rigid_part = [&](const Array<double> &v) {
    return held ? RigidMotion{} : rigid_motion(p_.n, p_.mass.data(), place, [&](uint32_t i) {
      return load3(&v[size_t(i) * kStride]);
    });
  };
  const auto forces_along = [&](double e, const RigidMotion &rigid, Array<double> &f) {
    for (uint32_t i = 0; i < p_.n; ++i) {
      const size_t at = size_t(i) * kStride;
      store3(&p_.x_end[at], place(i) + e * (load3(&p_.v[at]) - rigid.at(place(i))));
    }
    std::fill(f.begin(), f.end(), 0.0);
    dfm_kin k = kin(time, 0);
    k.x = p_.x_end.data();
    return model_.add_forces(k, f.data()) == DFM_OK;
  };
  const RigidMotion rigid = rigid_part(p_.v);
  if (!forces_along(ahead, rigid, p_.f) || !forces_along(-ahead, rigid, p_.v_end))
    return;  // the next call tells
  Array<double> &change = p_.f;
  for (size_t at = 0; at < change.size(); ++at)
    change[at] = p_.inv_mass[at] * (c / (2 * ahead)) * (p_.f[at] - p_.v_end[at]);
  const RigidMotion turn = rigid_part(change);
  for (uint32_t i = 0; i < p_.n; ++i) {
    const size_t at = size_t(i) * kStride;
    add3(&p_.v[at], load3(&change[at]) - turn.at(place(i)));
  }
}

std::unique_ptr<Dynamics> make_dynamics(const Memory &memory, Phyxels &points, Surface &surface,
                                        ModelInstance &model, const Array<uint32_t> &edges,
                                        const ImplicitOptions *implicit) {
  if (model.stepper) return std::make_unique<SelfStepping>(memory, points, surface, model);
  if (implicit) return std::make_unique<ImplicitPoints>(memory, points, surface, model, *implicit);
  return std::make_unique<ExplicitPoints>(memory, points, surface, model, edges);
}

}  // namespace dfm
