#include "dynamics/self_stepping.h"

#include <algorithm>
#include <cmath>

namespace dfm {

SelfStepping::SelfStepping(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model)
    : Dynamics(points, surface, model),
      mean_(size_t(kStride) * points.n, 0.0, HookAllocator<double>(memory)),
      surfels_(size_t(3) * surface.nsurfel, 0.0, HookAllocator<double>(memory)) {
  use_memory(memory, unit_);
}

// Loads and gravity are external forces of the model, which answers the surfels' mean velocities.
// The kinetic energy is that of its start: points are not told how they end without contact.
bool SelfStepping::free_motion(const SubStep &now, double &kinetic) {
  double sum = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const size_t at = size_t(i) * kStride;
    store3(&p_.f[at], load3(&p_.load[at]) + p_.mass[i] * now.gravity);
    sum += p_.mass[i] * norm2(load3(&p_.v[at]));
  }
  kinetic = 0.5 * sum;
  const dfm_kin k = kin(now.time, now.h);
  const auto predict = [&] { return model_.stepper->predict(model_.self, &k, p_.f.data(), surfels_.data()); };
  bool good = model_.call("predict", predict) == DFM_OK;
  for (uint32_t s = 0; s < surface_.nsurfel; ++s) {
    const double *const u = &surfels_[3 * size_t(s)];
    store3(&surface_.v[size_t(s) * kStride], load3(u));
    for (int c = 0; c < 3; ++c) good = good && std::fabs(u[c]) <= now.fastest;
  }
  return good;
}

bool SelfStepping::respond(const SubStep &now, uint32_t n, const uint32_t *surfel, uint32_t nrhs,
                           const double *p, double *du) const {
  const dfm_kin k = kin(now.time, now.h);
  const dfm_stepper &ops = *model_.stepper;
  if (ops.respond_many) {
    const auto many = [&] { return ops.respond_many(model_.self, &k, n, surfel, nrhs, p, du); };
    return model_.call("respond_many", many) == DFM_OK;
  }
  for (uint32_t r = 0; r < nrhs; ++r) {
    const size_t at = size_t(3) * n * r;
    const auto one = [&] { return ops.respond(model_.self, &k, n, surfel, p + at, du + at); };
    if (model_.call("respond", one) != DFM_OK) return false;
  }
  return true;
}

// As many unit impulses as in the last sub-step are the same ones.
bool SelfStepping::response(const SubStep &now, uint32_t n, const uint32_t *surfel, double *answers) {
  const uint32_t width = 3 * n;
  if (unit_.size() != size_t(width) * width) {
    unit_.assign(size_t(width) * width, 0.0);
    for (uint32_t c = 0; c < width; ++c) unit_[size_t(c) * width + c] = 1;
  }
  std::fill_n(answers, unit_.size(), 0.0);
  return respond(now, n, surfel, width, unit_.data(), answers);
}

bool SelfStepping::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  if (!touched) {
    std::fill(surfels_.begin(), surfels_.end(), 0.0);
    surfel_impulse = surfels_.data();
  }
  const dfm_kin k = kin(now.time, now.h, true);
  double *const x = p_.x_end.data(), *const v = p_.v_end.data();
  const auto end = [&] { return model_.stepper->commit(model_.self, &k, surfel_impulse, x, v); };
  if (model_.call("commit", end) != DFM_OK) return false;
  double poison = 0;
  for (size_t j = 0; j < size_t(p_.n) * kStride; ++j) {
    poison += 0.0 * x[j] + 0.0 * v[j];
    mean_[j] = (x[j] - p_.x[j]) / now.h;
  }
  return poison == 0;
}

void SelfStepping::bound_ends(double &speed, double &change) const {
  bound_surfel_ends(mean_.data(), speed, change);
}

void SelfStepping::commit(const SubStep &, double fraction) {
  if (fraction < 1)
    for (size_t j = 0; j < p_.x.size(); ++j) p_.x_end[j] = p_.x[j] + fraction * (p_.x_end[j] - p_.x[j]);
  p_.x.swap(p_.x_end);
  p_.v.swap(p_.v_end);
  model_.commit_state();
}

}  // namespace dfm
