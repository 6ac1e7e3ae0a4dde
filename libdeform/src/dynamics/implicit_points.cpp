#include "dynamics/implicit_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "body/turning.h"
#include "core/error.h"
#include "dynamics/line_search.h"
#include "dynamics/symplectic_euler.h"
#include "math/elementary.h"
#include "plugin/plugin_solver.h"

namespace dfm {
namespace {

// Tolerance of Newton's method: this share of the largest change of velocity in the sub-step, and that of
// ImplicitOptions. Contact at rest is solved to 1e-6 m/s. The remaining error is of first order; for a scheme
// of second order it must be small compared with the error of that order.
constexpr double kShare = 1e-3, kStagedShare = 1e-6;
// What rounding leaves in a position, over the largest coordinate.
constexpr double kRounding = 2 * std::numeric_limits<double>::epsilon();
// If a correction is not at most half of the one before, a new matrix is needed.
constexpr double kContracts = 0.5;
// The factor of the rest state may fail to do so this often in a sub-step.
constexpr uint32_t kPatience = 4;
constexpr uint32_t kCuts = 8;  // of a correction that leads too far
// What a sub-step may err by, over the median edge of the surface; how much longer the next one may be.
constexpr double kErrs = 0.005, kGrows = 2;

// TR-BDF2: the trapezoidal rule to kMiddle of the sub-step, then the second backward difference formula over
// both parts. With kMiddle = 2 - sqrt 2 both have the matrix of backward Euler over kPart of the sub-step.
// An end is kAhead times what the middle has beyond the start, plus kPart times the derivative there.
constexpr double kMiddle = 0.585786437626904951, kPart = kMiddle / 2;
constexpr double kAhead = 1 / (kMiddle * (2 - kMiddle));
// Error coefficient, times h^3 times the third derivative (Hosea and Shampine 1996, Analysis and
// implementation of TR-BDF2, section 2).
constexpr double kError = (3 * kMiddle * kMiddle - 4 * kMiddle + 2) / (12 * (2 - kMiddle));

double largest(const Array<double> &a) {
  double most = 0;
  for (const double value : a) most = std::max(most, std::fabs(value));
  return most;
}

}  // namespace

ImplicitPoints::ImplicitPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const ImplicitOptions &options)
    : Dynamics(points, surface, model),
      options_(options),
      stiffness_(memory),
      memory_(memory),
      ways_(memory) {
  use_memory(memory, stage_x_, stage_v_, middle_, p_.load_before);
  use_memory(memory, x_, v_, residual_, push_, change_, there_, springs_, dampers_, scale_, weight_, held_,
             alone_);
  x_.assign(size_t{kStride} * points.n, 0.0);
  v_ = alone_ = x_;
  if (options_.second_order) stage_x_ = stage_v_ = middle_ = p_.load_before = x_;
  for (Array<double> *a : {&residual_, &push_, &change_, &there_, &scale_, &weight_})
    a->assign(size_t{3} * points.n, 0.0);
  held_.assign(points.n, 0);
  stiffness_.create(model, points.n);
  abilities_ = {
      .springs = true,
      .placed = true,
      .accurate = true,
      .damps = true,
      .parts = options_.second_order,
      .claims = DFM_CAP_STIFFNESS | (stiffness_.constant() ? uint32_t{DFM_CAP_CONSTANT_STIFFNESS} : 0),
      // of a stage; measured: 30 at 700 points, 60 at 4,300
      .work = (options_.second_order ? 2 : 1) * kImplicitWork};
  system_ = this;
  if (options_.second_order && options_.newton == 1 && !stiffness_.constant())
    fail(DFM_E_UNSUPPORTED,
         "the integrator tr_bdf2 needs more than one Newton iteration with model '%s'; choose "
         "implicit_euler, or set solver.newton above 1",
         model.type->id);
  std::unique_ptr<LinearSolver> solver = new_solver();
  if (options_.rest_factor && solver->direct() && (options_.newton > 1 || stiffness_.constant()))
    rest_ = std::make_unique<RestFactor>(memory, points, model, stiffness_, std::move(solver));
  else exact_ = std::move(solver);
  // a plugin's solver is made and analyzes between steps
  const SolverChoice choice{options_.solver.c_str(), p_.n, stiffness_.constant(), 0};
  if (rest_ && std::strcmp(solver_name(choice), "ldlt") != 0) exact_ = new_solver();
  ways_.start(weight_);
}

std::unique_ptr<LinearSolver> ImplicitPoints::new_solver() const {
  std::unique_ptr<LinearSolver> solver =
      make_solver({options_.solver.c_str(), p_.n, stiffness_.constant(), options_.solver_iterations},
                  *static_cast<const dfm_context *>(model_.host->ctx), memory_, options_.tasks);
  solver->analyse(stiffness_.pattern());
  return solver;
}

// The scheme is stable at any step. The stiffness of load springs is that at the start of the sub-step.
bool ImplicitPoints::bound(double, double, const AddRowSums &outside, StepBound &out) {
  springs_.assign(p_.n, 0.0);
  dampers_.assign(p_.n, 0.0);
  outside(springs_.data(), dampers_.data());
  out.step = stable_step(p_, springs_.data(), dampers_.data(), &out.point);
  return true;
}

// Writes the model's forces at the positions that the velocities v [npoint,4] lead to into f. commits: also
// its next state.
bool ImplicitPoints::evaluate_after(const double *v, bool commits) {
  for (size_t j = 0; j < x_.size(); ++j) {
    v_[j] = v[j];
    x_[j] = stage_.x[j] + stage_.h * v[j];
  }
  if (!staged_ && !stiffness_.constant()) turn_on();
  dfm_kin k = kin(stage_.time + stage_.elapsed, stage_.elapsed, commits);
  k.x = x_.data();
  k.v = v_.data();
  return evaluate_at(k, stage_.share);
}

// Backward Euler's velocities are those of chords. In the frame at the end of a rotation by the angle a they
// expand the body at the rate a^2 / 2h: dampers that saw them would press a spinning body together, and that
// gains energy. They see the velocities at the ends of the arcs. Models of constant stiffness take a rotation
// for a strain in any case.
void ImplicitPoints::turn_on() {
  const Turning turning = turning_of(p_, v_.data(), stage_.h);
  for (uint32_t i = 0; i < p_.n; ++i) {
    double *const v = &v_[size_t{kStride} * i];
    add3(v, turning.arc(load3(v)));
  }
}

// share: position between the loads at the start of the sub-step (0) and those at its end (1).
bool ImplicitPoints::evaluate_at(const dfm_kin &k, double share) {
  if (share == 1) std::copy(p_.load.begin(), p_.load.end(), p_.f.begin());
  else
    for (size_t j = 0; j < x_.size(); ++j)
      p_.f[j] = p_.load_before[j] + share * (p_.load[j] - p_.load_before[j]);
  return model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, p_.f.data()); }) ==
         DFM_OK;
}

bool ImplicitPoints::residual_at(const double *v) { return residual(v, residual_.data()); }

bool ImplicitPoints::residual(const double *v, double *r) {
  if (!evaluate_after(v, false)) return false;
  double nan_flag = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c, own = size_t{3} * i + c;
      const double force = p_.f[at] + p_.mass[i] * stage_.gravity[int(c)];
      const double change = v[at] - stage_.v[at];
      r[own] = p_.moves(at) ? inertia(i, stage_.h) * change - stage_.h * force : 0;
      nan_flag += 0.0 * r[own];
    }
  return nan_flag == 0;
}

// Uses the factor of the rest state instead of A, rotated to the positions of the last force evaluation.
// Returns false if there is none.
bool ImplicitPoints::take_rest() {
  by_rest_ = rest_ && rest_->prepare(stage_.h);
  if (!by_rest_) return false;
  rest_->turn(x_.data());
  slow_ = 0;
  weight_ = rest_->diagonal();
  for (size_t k = 0; k < scale_.size(); ++k) scale_[k] = weight_[k] > 0 ? 1 / weight_[k] : 0;
  return true;
}

// A at the state of the last force evaluation, into the blocks of the stiffness.
bool ImplicitPoints::assemble() {
  dfm_kin k = kin(stage_.time + stage_.elapsed, stage_.elapsed);
  k.x = x_.data();
  k.v = v_.data();
  if (!stiffness_.evaluate(model_, k, -stage_.h * stage_.h, -stage_.h)) return false;
  stiffness_.each_own([&](uint32_t i, double *block) {
    for (size_t c = 0; c < 3; ++c) {
      double &diagonal = block[4 * c];
      diagonal += inertia(i, stage_.h);
      const bool held = p_.held[i] & (1 << c);
      scale_[3 * size_t{i} + c] = held ? 0 : 1 / diagonal;
      weight_[3 * size_t{i} + c] = held ? 0 : diagonal;
    }
  });
  hold_components(stiffness_.pattern(), p_.held.data(), stiffness_.blocks().data());
  return true;
}

bool ImplicitPoints::matrix(const uint32_t *at, double *blk) {
  if (!assemble()) return false;
  const Array<double> &blocks = stiffness_.blocks();
  for (uint32_t b = 0; b < stiffness_.pattern().nb; ++b)
    for (size_t k = 0; k < 9; ++k) blk[9 * size_t{at[b]} + k] += blocks[9 * size_t{b} + k];
  return true;
}

// A factor of A at the state of the last force evaluation.
bool ImplicitPoints::linearize() {
  const bool known =
      stiffness_.constant() && factor_h_ == stage_.h && held_ == p_.held && factor_params_ == model_.params;
  if (known) return true;
  factor_h_ = 0;
  by_rest_ = false;
  if (!exact_) exact_ = new_solver();
  if (!assemble()) return false;
  // a constant matrix must not depend on the positions at the time when it was made
  if (stiffness_.constant()) exact_->place(p_.rest.data(), 3);
  else exact_->place(x_.data(), kStride);
  if (!exact_->factor(stiffness_.blocks().data())) return false;
  factor_h_ = stage_.h;
  held_ = p_.held;
  if (stiffness_.constant()) factor_params_ = model_.params;
  return true;
}

bool ImplicitPoints::solve(const Array<double> &b, Array<double> &x) {
  if (by_rest_) return rest_->solve(b.data(), x.data());
  SolveInfo info;
  std::fill(x.begin(), x.end(), 0.0);
  return exact_->solve(1, b.data(), x.data(), options_.tolerance, info);
}

// Whether the factor of the rest state is still good enough, if it left this share of the residual.
bool ImplicitPoints::patient(double left) { return by_rest_ && (left <= kContracts || ++slow_ <= kPatience); }

// Far from the origin the rounding of positions, over the length of the stage, is all that is left. Where
// that counts, a body is small against its distance, so its first point stands for all.
double ImplicitPoints::allowed_error(const Array<double> &v, double share) const {
  double most = 0, far = 0;
  for (size_t j = 0; j < v.size(); ++j) most = std::max(most, std::fabs(v[j] - p_.v[j]));
  for (size_t k = 0; k < 3; ++k) far = std::max(far, std::fabs(p_.x[k]));
  return std::max(options_.rest, kRounding * far / stage_.h) + share * most;
}

// Moves from v, whose residual is known, along change_. The residual is then that of the new v.
bool ImplicitPoints::search(Array<double> &v) {
  return search_line(
      -product(residual_, change_), kCuts, [&](double share) { add(v, share); },
      [&](double &slope) {
        const bool known = residual_at(v.data());
        slope = -product(residual_, change_);
        return known;
      });
}

// Starts from the velocities at the start of the sub-step.
bool ImplicitPoints::begin_stage(const SubStep &now) {
  stage_ = {now.h, now.h, now.time, p_.x.data(), p_.v.data(), 1, now.gravity};
  p_.v_free = p_.v;
  solved_ = false;
  return residual_at(p_.v_free.data());
}

double ImplicitPoints::largest_diagonal() const { return largest(weight_); }

bool ImplicitPoints::take_first_way(const SubStep &now) {
  if (!begin_stage(now) || !linearize() || !solve_way(residual_)) return false;
  add(p_.v_free, 1);
  see_diagonal();
  return true;
}

// Newton's method. A factorization costs as much as many solves, so the factor of the rest state is used
// while the residual decreases fast enough, then a factor of A itself; Anderson acceleration makes up for the
// inexact matrix. v: start, whose residual is known, and result. Returns false if the model fails, or a stage
// of TR-BDF2 is not solved.
bool ImplicitPoints::newton(Array<double> &v) {
  bool fresh = !take_rest();
  ways_.start(weight_);
  for (uint32_t k = 0; k < options_.newton; ++k) {
    if (fresh) {
      if (!linearize()) return false;
      ways_.start(weight_);
    }
    if (!solve_way(residual_)) return false;
    const double step = largest(change_), before = scaled_square(residual_);
    accelerate(v);
    if (!search(v)) return false;
    if (stiffness_.constant()) return true;
    const double left = before > 0 ? std::sqrt(scaled_square(residual_) / before) : 0;
    if (step * std::min(1.0, left) <= allowed_error(v, staged_ ? kStagedShare : kShare)) return true;
    fresh = by_rest_ ? !patient(left) : !exact_->direct() || left > kContracts;
  }
  return !staged_;
}

bool ImplicitPoints::free_motion(const SubStep &now, double &kinetic) {
  staged_ = staged_ && two_stages(now);
  if (!staged_ && (!begin_stage(now) || !newton(p_.v_free))) return false;
  see_diagonal();
  kinetic = 0;
  bool good = true;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const Vec3 u = load3(&p_.v_free[size_t{kStride} * i]);
    kinetic += 0.5 * p_.mass[i] * norm2(u);
    for (int c = 0; c < 3; ++c) good = good && std::fabs(u[c]) <= now.fastest;
  }
  return good;
}

// Returns false if a stage was not solved accurately enough: the remaining residual could add energy, while
// backward Euler dissipates it. Writes the end into v_end and the mean velocity into v_free, computed from
// the velocities at the three times, because a difference of positions would lose digits.
bool ImplicitPoints::two_stages(const SubStep &now) {
  const double part = kPart * now.h;
  if (!evaluate_at(kin(now.time, 0), 0)) return false;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c;
      stage_x_[at] = p_.x[at] + part * p_.v[at];
      stage_v_[at] = p_.v[at] + part * (p_.inv_mass[at] * p_.f[at]);
      if (p_.moves(at)) stage_v_[at] += part * now.gravity_before[int(c)];
    }
  const Vec3 change = now.gravity - now.gravity_before;
  stage_ = {part,
            kMiddle * now.h,
            now.time,
            stage_x_.data(),
            stage_v_.data(),
            kMiddle,
            now.gravity_before + kMiddle * change};
  middle_ = p_.v;
  if (!solve_stage(now, middle_)) return false;
  for (size_t j = 0; j < x_.size(); ++j) {
    stage_x_[j] = p_.x[j] + kAhead * (part * (p_.v[j] + middle_[j]));
    stage_v_[j] = p_.v[j] + kAhead * (middle_[j] - p_.v[j]);
  }
  stage_.elapsed = now.h;
  stage_.share = 1;
  stage_.gravity = now.gravity;
  p_.v_end = middle_;
  if (!solve_stage(now, p_.v_end)) return false;
  for (size_t j = 0; j < x_.size(); ++j)
    p_.v_free[j] = kPart * (kAhead * (p_.v[j] + middle_[j]) + p_.v_end[j]);
  return true;
}

bool ImplicitPoints::choose_scheme(bool touched) {
  const bool before = std::exchange(staged_, options_.second_order && !touched);
  return staged_ == before;
}

bool ImplicitPoints::solve_stage(const SubStep &now, Array<double> &v) {
  return residual_at(v.data()) && newton(v) &&
         std::all_of(v.begin(), v.end(), [&](double value) { return std::fabs(value) <= now.fastest; });
}

// change_ = -A^-1 r
bool ImplicitPoints::solve_way(const Array<double> &r) {
  if (!solve(r, change_)) return false;
  for (double &d : change_) d = -d;
  return true;
}

// Improves the correction in change_ by the previous corrections (Anderson), if it remains a descent
// direction.
void ImplicitPoints::accelerate(const Array<double> &v) {
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) push_[size_t{3} * i + c] = v[size_t{kStride} * i + c];
  for (size_t k = 0; k < there_.size(); ++k) there_[k] = push_[k] + change_[k];
  if (!ways_.next(push_.data(), there_.data(), push_.data())) return;
  for (size_t k = 0; k < there_.size(); ++k) push_[k] += change_[k];
  if (-product(residual_, push_) > 0) change_.swap(push_);
}

void ImplicitPoints::add(Array<double> &v, double share) const {
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) v[size_t{kStride} * i + c] += share * change_[size_t{3} * i + c];
}

double ImplicitPoints::scaled_square(const Array<double> &r) const {
  double sum = 0;
  for (size_t j = 0; j < r.size(); ++j) sum += scale_[j] * (r[j] * r[j]);
  return sum;
}

// What contact needs before it has seen A: estimates.
void ImplicitPoints::see_diagonal() {
  moving_ = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    if (p_.moves(size_t{kStride} * i) || p_.moves(size_t{kStride} * i + 1) ||
        p_.moves(size_t{kStride} * i + 2))
      moving_ += p_.mass[i];
    for (size_t c = 0; c < 3; ++c) alone_[size_t{kStride} * i + c] = scale_[size_t{3} * i + c];
  }
}

void ImplicitPoints::take(const double *v) {
  std::copy_n(v, p_.v_end.size(), p_.v_end.begin());
  solved_ = true;
}

void ImplicitPoints::spread_impulses(const double *surfel_impulse, double scale, Array<double> &to) const {
  for (uint32_t s = 0; s < surface_.nsurfel; ++s) {
    const Vec3 q = load3(&surfel_impulse[3 * size_t{s}]);
    if (q.x == 0 && q.y == 0 && q.z == 0) continue;
    surface_.each_phyxel(s, [&](uint32_t p, double w) {
      for (uint32_t c = 0; c < 3; ++c)
        if (p_.moves(size_t{kStride} * p + c)) to[size_t{3} * p + c] += scale * w * q[int(c)];
    });
  }
}

// If the model has a state, forces are evaluated once more, which writes its next value.
bool ImplicitPoints::end_state(const SubStep &now, const double *, bool touched) {
  if (!staged_ && !(touched && solved_)) p_.v_end = p_.v_free;
  const Array<double> &v = p_.v_end;
  end_ = {v.data(), (staged_ ? p_.v_free : v).data()};
  if (!model_.state.empty() && !evaluate_after(v.data(), true)) return false;
  double nan_flag = 0;
  for (size_t j = 0; j < v.size(); ++j) {
    nan_flag += 0.0 * v[j];
    p_.x_end[j] = p_.x[j] + now.h * end_.mean[j];
  }
  return nan_flag == 0;
}

// The error of backward Euler is h^2 a / 2 in the position, with the acceleration a; that of TR-BDF2 follows
// from the velocities at its three times (Hosea and Shampine 1996). The part that all points have in common
// deforms nothing and is left out.
double ImplicitPoints::accurate_step(const SubStep &now) const {
  const auto gained = [&](uint32_t i) {
    const size_t at = size_t{kStride} * i;
    const Vec3 v = load3(&p_.v[at]), end = load3(&p_.v_end[at]);
    if (!staged_) return end - v;
    const Vec3 middle = load3(&middle_[at]);
    return (1 / (1 - kMiddle)) * (end - middle) - (1 / kMiddle) * (middle - v);
  };
  Vec3 mean;
  double mass = 0, most = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    mean += p_.mass[i] * gained(i);
    mass += p_.mass[i];
  }
  mean = (1 / mass) * mean;
  for (uint32_t i = 0; i < p_.n; ++i) most = std::max(most, norm2(gained(i) - mean));
  const double allowed = kErrs * surface_.median_edge, change = now.h * std::sqrt(most);
  if (!staged_) return now.h * std::min(kGrows, std::sqrt(allowed / (0.5 * change)));
  const double share = allowed / (2 * kError * change);
  return now.h * (share < kGrows * kGrows * kGrows ? dfm_pow(share, 1.0 / 3) : kGrows);
}

void ImplicitPoints::commit(const SubStep &) {
  p_.x.swap(p_.x_end);
  p_.v.swap(p_.v_end);
  model_.commit_state();
}

}  // namespace dfm
