#include "dynamics/self_stepping.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dynamics/symplectic_euler.h"

namespace dfm {

SelfStepping::SelfStepping(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model)
    : Dynamics(points, surface, model),
      mean_(size_t(kStride) * points.n, 0.0, memory),
      surfels_(size_t(3) * surface.nsurfel, 0.0, memory) {
  use_memory(memory, unit_, near_, stiffness_, damping_);
  if (!(abilities_.late = model.late.has_value())) return;
  std::vector<uint8_t> near(points.n, 0);
  for (uint32_t s = 0; s < surface.nsurfel; ++s)
    surface.each_phyxel(s, [&](uint32_t point, double) { near[point] = 1; });
  for (uint32_t i = 0; i < points.n; ++i)
    if (near[i] || points.held[i]) near_.push_back(i);
}

template <class F>
void SelfStepping::each_moved(F &&f) const {
  if (!model_.late) {
    for (size_t j = 0; j < size_t(p_.n) * kStride; ++j) f(j);
    return;
  }
  for (const uint32_t i : near_)
    for (size_t j = size_t(i) * kStride; j < size_t(i + 1) * kStride; ++j) f(j);
}

// A model that divides its steps itself takes impulses at the end of a step only. If it names a bound,
// contact needs steps within that.
bool SelfStepping::bound(double time, double, const AddRowSums &outside, StepBound &out) {
  contact_step_ = std::numeric_limits<double>::infinity();
  if (!model_.ops->bound) return true;
  stiffness_.assign(p_.n, 0.0);
  damping_.assign(p_.n, 0.0);
  const dfm_kin k = kin(time, 0);
  double cell = *contact_step_;
  const auto query = [&] {
    return model_.ops->bound(model_.self, &k, stiffness_.data(), damping_.data(), &cell);
  };
  if (model_.call("bound", query) != DFM_OK) return false;
  outside(stiffness_.data(), damping_.data());
  out.step = std::min(cell, stable_step(p_, stiffness_.data(), damping_.data(), &out.point));
  contact_step_ = out.step;
  return true;
}

double SelfStepping::contact_step() {
  StepBound found;
  if (!contact_step_) bound(0, 1, [](double *, double *) {}, found);
  return *contact_step_;
}

// Loads and gravity are external forces of the model, which returns the mean velocities of the surfels. The
// kinetic energy is that at the start: the end without contact is not known for points.
bool SelfStepping::free_motion(const SubStep &now, double &kinetic) {
  double sum = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const size_t at = size_t(i) * kStride;
    store3(&p_.f[at], load3(&p_.load[at]) + p_.mass[i] * now.gravity);
  }
  // with late points: of the points that every sub-step moves, whether or not the others have been computed
  const uint32_t count = model_.late ? uint32_t(near_.size()) : p_.n;
  for (uint32_t n = 0; n < count; ++n) {
    const uint32_t i = model_.late ? near_[n] : n;
    sum += p_.mass[i] * norm2(load3(&p_.v[size_t(i) * kStride]));
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

// If the number of unit impulses is that of the last sub-step, they are the same.
bool SelfStepping::response(const SubStep &now, uint32_t n, const uint32_t *surfel, double *responses) {
  const uint32_t width = 3 * n;
  if (unit_.size() != size_t(width) * width) {
    unit_.assign(size_t(width) * width, 0.0);
    for (uint32_t c = 0; c < width; ++c) unit_[size_t(c) * width + c] = 1;
  }
  std::fill_n(responses, unit_.size(), 0.0);
  return respond(now, n, surfel, width, unit_.data(), responses);
}

bool SelfStepping::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  if (!touched) {
    std::fill(surfels_.begin(), surfels_.end(), 0.0);
    surfel_impulse = surfels_.data();
  }
  const dfm_kin k = kin(now.time, now.h, true);
  double *const x = p_.x_end.data(), *const v = p_.v_end.data();
  const auto ends = model_.late ? model_.late->commit : model_.stepper->commit;
  const auto end = [&] { return ends(model_.self, &k, surfel_impulse, x, v); };
  if (model_.call("commit", end) != DFM_OK) return false;
  end_ = {v, mean_.data()};
  double nan_flag = 0;
  each_moved([&](size_t j) {
    nan_flag += 0.0 * x[j] + 0.0 * v[j];
    mean_[j] = (x[j] - p_.x[j]) / now.h;
  });
  return nan_flag == 0;
}

void SelfStepping::commit(const SubStep &) {
  p_.x.swap(p_.x_end);
  p_.v.swap(p_.v_end);
  model_.commit_state();
  unseen_ = model_.late.has_value();
}

// A partial displacement is no state of the model: it then continues from the positions of all points.
void SelfStepping::take_part(double share, bool in_full, const double *surfel_impulse) {
  if (model_.late) {
    see_points();
    dfm_kin k = kin(0, 0);
    k.x = p_.x_end.data();
    k.v = p_.v_end.data();
    k.state = model_.state_out.data();
    model_.call("points",
                [&] { return model_.late->points(model_.self, &k, p_.x_end.data(), p_.v_end.data()); });
    model_.call("look", [&] { return model_.late->look(model_.self, model_.state_out.data()); });
  }
  Dynamics::take_part(share, in_full, surfel_impulse);
}

bool SelfStepping::sums(BodySums &out) const {
  if (!model_.late || !model_.late->sums) return false;
  const dfm_kin k = kin(0, 0);
  double found[5] = {};
  if (model_.call("sums", [&] { return model_.late->sums(model_.self, &k, found); }) != DFM_OK) return false;
  out = {found[0], found[1], load3(found + 2), 0};
  for (const uint32_t i : near_)
    for (size_t c = 0; c < 3; ++c) out.reach = std::max(out.reach, std::fabs(p_.x[size_t(i) * kStride + c]));
  return true;
}

}  // namespace dfm
