#include "dynamics/settling_points.h"

#include <algorithm>
#include <utility>

namespace dfm {

SettlingPoints::SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const ImplicitOptions &options, const std::vector<double> &softness,
                               double error)
    : ImplicitPoints(memory, points, surface, model, options), error_allowed_(error) {
  use_memory(memory, softness_, last_, next_, guess_, load_, impulse_, taken_, springs_of_loads_, own_);
  for (Array<double> *a : {&last_, &next_, &impulse_, &taken_}) a->assign(size_t{3} * points.n, 0.0);
  guess_.assign(size_t{kStride} * points.n, 0.0);
  softness_.assign(softness.begin(), softness.end());
  springs_of_loads_ = softness_;
  own_.assign(points.n, 0.0);
}

void SettlingPoints::start_from(const double *surfel_impulse, double h) {
  std::fill(last_.begin(), last_.end(), 0.0);
  if (h > 0) spread_impulses(surfel_impulse, 1 / h, last_);
}

void SettlingPoints::slow_touched(double times) {
  if (times == 0 && slowed_ == 0) return;
  if (times == 0) std::fill(own_.begin(), own_.end(), 0.0);
  else
    for (uint32_t i = 0; i < p_.n; ++i) {
      const double *const push = &last_[size_t{3} * i];
      if (own_[i] == 0 && (push[0] != 0 || push[1] != 0 || push[2] != 0)) own_[i] = own_stiffness(i);
    }
  slowed_ = times;
  bool changed = false;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const double before = std::exchange(softness_[i], springs_of_loads_[i] + times * own_[i]);
    changed = changed || softness_[i] != before;
  }
  if (changed) softness_changed();
}

// The scheme is stable at any step, also with loads that depend on positions.
bool SettlingPoints::bound(double, double, const AddRowSums &, StepBound &out) {
  out = {};
  return true;
}

// One linear correction only: with contact forces that do not rotate with the body, a standing body may have
// no equilibrium near, and Newton's method would search for it forever.
bool SettlingPoints::free_motion(const SubStep &now, double &) {
  load_ = p_.load;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      p_.load[size_t{kStride} * i + c] += last_[size_t{3} * i + c];
      impulse_[size_t{3} * i + c] = now.h * last_[size_t{3} * i + c];
    }
  options_.rest = error_allowed_ / now.h;
  const bool found = take_first_way(now);
  p_.load.swap(load_);
  guess_ = p_.v_free;
  if (!found || !solve(impulse_, taken_)) return false;
  stiffest_ = largest_diagonal() / (now.h * now.h);
  double poison = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c;
      p_.v_free[at] -= taken_[size_t{3} * i + c];
      poison += 0.0 * p_.v_free[at];
    }
  return poison == 0;
}

bool SettlingPoints::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  std::fill(next_.begin(), next_.end(), 0.0);
  if (touched) spread_impulses(surfel_impulse, 1 / now.h, next_);
  return ImplicitPoints::end_state(now, surfel_impulse, touched);
}

void SettlingPoints::commit(const SubStep &now, double fraction) {
  last_.swap(next_);
  ImplicitPoints::commit(now, fraction);
}

}  // namespace dfm
