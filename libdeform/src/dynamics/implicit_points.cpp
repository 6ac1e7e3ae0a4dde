#include "dynamics/implicit_points.h"

#include <algorithm>
#include <cmath>

#include "dynamics/line_search.h"
#include "dynamics/symplectic_euler.h"
#include "plugin/plugin_solver.h"

namespace dfm {
namespace {

// What Newton's method may leave: this share of the largest change of velocity in the sub-step, and what
// ImplicitOptions say. Contact at rest is solved to 1e-6 m/s.
constexpr double kShare = 1e-3;
// A correction that does not halve the one before needs a new matrix.
constexpr double kContracts = 0.5;
// The rest state's factor may fail to do so that often in a sub-step.
constexpr uint32_t kPatience = 4;
// Corrections of one solve at most, what may be left of `allowed_error` then, and how far above the least
// correction one may lie before the iteration counts as lost.
constexpr uint32_t kRevisions = 20;
constexpr double kTolerated = 100, kDiverges = 100;
constexpr uint32_t kCuts = 8;  // of a correction that leads too far
// What a sub-step may err by, over the median edge of the surface; how much longer the next one may be.
constexpr double kErrs = 0.005, kGrows = 2;

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
  use_memory(memory, x_, v_, before_, residual_, push_, change_, springs_, dampers_, scale_, weight_, held_,
             column_, points_, between_);
  x_.assign(size_t{kStride} * points.n, 0.0);
  v_ = before_ = x_;
  for (Array<double> *a : {&residual_, &push_, &change_, &scale_, &weight_})
    a->assign(size_t{3} * points.n, 0.0);
  held_.assign(points.n, 0);
  stiffness_.create(model, points.n);
  std::unique_ptr<LinearSolver> solver = new_solver();
  if (solver->direct() && (options_.newton > 1 || stiffness_.constant()))
    rest_ = std::make_unique<RestFactor>(memory, points, model, stiffness_, std::move(solver));
  else exact_ = std::move(solver);
}

std::unique_ptr<LinearSolver> ImplicitPoints::new_solver() const {
  std::unique_ptr<LinearSolver> solver =
      make_solver({options_.solver.c_str(), p_.n, stiffness_.constant(), options_.solver_iterations},
                  *static_cast<const dfm_context *>(model_.host->ctx), memory_, options_.tasks);
  solver->analyse(stiffness_.pattern());
  return solver;
}

// The scheme is stable at any step. Springs of loads act with what they are at the start of the sub-step.
bool ImplicitPoints::bound(double, const AddRowSums &outside, StepBound &out) {
  springs_.assign(p_.n, 0.0);
  dampers_.assign(p_.n, 0.0);
  outside(springs_.data(), dampers_.data());
  out.step = stable_step(p_, springs_.data(), dampers_.data(), &out.point);
  return true;
}

// The model's forces at the end that the velocities v [npoint,4] lead to, into f. commits: with its next
// state.
bool ImplicitPoints::ask(const SubStep &now, const double *v, bool commits) {
  for (size_t j = 0; j < x_.size(); ++j) {
    v_[j] = v[j];
    x_[j] = p_.x[j] + now.h * v[j];
  }
  std::copy(p_.load.begin(), p_.load.end(), p_.f.begin());
  dfm_kin k = kin(now.time + now.h, now.h, commits);
  k.x = x_.data();
  k.v = v_.data();
  return model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, p_.f.data()); }) ==
         DFM_OK;
}

// r(v) - push.
bool ImplicitPoints::residual_at(const SubStep &now, const double *v, const double *push) {
  if (!ask(now, v, false)) return false;
  double poison = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c, own = size_t{3} * i + c;
      const double force = p_.f[at] + p_.mass[i] * now.gravity[int(c)];
      const double given = push ? push[own] : 0;
      residual_[own] = p_.moves(at) ? inertia(i, now.h) * (v[at] - p_.v[at]) - now.h * force - given : 0;
      poison += 0.0 * residual_[own];
    }
  return poison == 0;
}

// The rest state's factor in place of A, turned to where forces were asked last. False: there is none.
bool ImplicitPoints::take_rest(const SubStep &now) {
  by_rest_ = rest_ && rest_->prepare(now.h);
  if (!by_rest_) return false;
  rest_->turn(x_.data());
  slow_ = 0;
  weight_ = rest_->diagonal();
  for (size_t k = 0; k < scale_.size(); ++k) scale_[k] = weight_[k] > 0 ? 1 / weight_[k] : 0;
  return true;
}

// A at the state where forces were asked last.
bool ImplicitPoints::linearize(const SubStep &now) {
  const bool known = stiffness_.constant() && factor_h_ == now.h && held_ == p_.held;
  if (known) return true;
  factor_h_ = 0;
  by_rest_ = false;
  if (!exact_) exact_ = new_solver();
  dfm_kin k = kin(now.time + now.h, now.h);
  k.x = x_.data();
  k.v = v_.data();
  if (!stiffness_.evaluate(model_, k, -now.h * now.h, -now.h)) return false;
  stiffness_.each_own([&](uint32_t i, double *block) {
    for (size_t c = 0; c < 3; ++c) {
      double &diagonal = block[4 * c];
      diagonal += inertia(i, now.h);
      const bool held = p_.held[i] & (1 << c);
      scale_[3 * size_t{i} + c] = held ? 0 : 1 / diagonal;
      weight_[3 * size_t{i} + c] = held ? 0 : diagonal;
    }
  });
  Array<double> &blocks = stiffness_.blocks();
  hold_components(stiffness_.pattern(), p_.held.data(), blocks.data());
  exact_->place(x_.data(), kStride);
  if (!exact_->factor(blocks.data())) return false;
  factor_h_ = now.h;
  held_ = p_.held;
  return true;
}

bool ImplicitPoints::solve(const Array<double> &b, Array<double> &x) {
  if (by_rest_) return rest_->solve(b.data(), x.data());
  SolveInfo info;
  std::fill(x.begin(), x.end(), 0.0);
  return exact_->solve(1, b.data(), x.data(), options_.tolerance, info);
}

// What A^-1 says between points; held components answer nothing.
bool ImplicitPoints::restricted(uint32_t count, const uint32_t *points, double *w) {
  SolveInfo info;
  if (by_rest_ ? !rest_->restricted(count, points, w)
               : !exact_->restricted(count, points, options_.tolerance, w, info))
    return false;
  const size_t wide = size_t{3} * count;
  for (uint32_t k = 0; k < count; ++k)
    for (size_t c = 0; c < 3; ++c) {
      if (p_.moves(size_t{kStride} * points[k] + c)) continue;
      const size_t at = size_t{3} * k + c;
      for (size_t other = 0; other < wide; ++other) w[at * wide + other] = w[other * wide + at] = 0;
    }
  return true;
}

// Whether the rest state's factor serves on, where it left that share of what there was.
bool ImplicitPoints::patient(double left) { return by_rest_ && (left <= kContracts || ++slow_ <= kPatience); }

double ImplicitPoints::allowed_error(const Array<double> &v) const {
  double most = 0;
  for (size_t j = 0; j < v.size(); ++j) most = std::max(most, std::fabs(v[j] - p_.v[j]));
  return options_.rest + kShare * most;
}

// From v, whose residual is known, along the way in change_. The residual is then that of the new v.
bool ImplicitPoints::search(const SubStep &now, Array<double> &v) {
  return search_line(
      -product(residual_, change_), kCuts, [&](double share) { add(v, share); },
      [&](double &slope) {
        const bool known = residual_at(now, v.data(), nullptr);
        slope = -product(residual_, change_);
        return known;
      });
}

// From the velocities at the start of the sub-step.
bool ImplicitPoints::start(const SubStep &now) {
  p_.v_free = p_.v;
  error_ = 0;
  least_error_ = HUGE_VAL;
  revisions_ = 0;
  ended_ = false;
  return residual_at(now, p_.v_free.data(), nullptr);
}

double ImplicitPoints::largest_diagonal() const { return largest(weight_); }

bool ImplicitPoints::take_first_way(const SubStep &now) {
  if (!start(now) || !linearize(now) || !solve_way(residual_)) return false;
  add(p_.v_free, 1);
  return true;
}

// Newton's method. A factorization costs many solves, so that of the rest state serves while the residual
// falls well, then one of A itself; the combination of the ways it leads to makes good what the matrix is
// not.
bool ImplicitPoints::free_motion(const SubStep &now, double &kinetic) {
  if (!start(now)) return false;
  Array<double> &v = p_.v_free;
  ways_.start(change_.size());
  bool fresh = !take_rest(now);
  for (uint32_t k = 0; k < options_.newton; ++k) {
    if (fresh) {
      if (!linearize(now)) return false;
      ways_.start(change_.size());
    }
    if (!solve_way(residual_)) return false;
    const double step = largest(change_), before = scaled_square(residual_);
    accelerate(v);
    if (!search(now, v)) return false;
    if (stiffness_.constant()) break;
    const double left = before > 0 ? std::sqrt(scaled_square(residual_) / before) : 0;
    if (step * std::min(1.0, left) <= allowed_error(v)) break;
    fresh = by_rest_ ? !patient(left) : !exact_->direct() || left > kContracts;
  }
  kinetic = 0;
  bool good = true;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const Vec3 u = load3(&v[size_t{kStride} * i]);
    kinetic += 0.5 * p_.mass[i] * norm2(u);
    for (int c = 0; c < 3; ++c) good = good && std::fabs(u[c]) <= now.fastest;
  }
  return good;
}

// change_ = -A^-1 r
bool ImplicitPoints::solve_way(const Array<double> &r) {
  if (!solve(r, change_)) return false;
  for (double &d : change_) d = -d;
  return true;
}

// The way in change_ by what the ways before it have taught, where that still leads down.
void ImplicitPoints::accelerate(const Array<double> &v) {
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) push_[size_t{3} * i + c] = v[size_t{kStride} * i + c];
  ways_.next(push_.data(), change_.data(), weight_.data(), push_.data());
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

// W = N_c A^-1 N_c^T of the touched surfels.
bool ImplicitPoints::response(const SubStep &, uint32_t n, const uint32_t *surfel, double *matrix) {
  column_.assign(p_.n, kNone);
  points_.clear();
  for (uint32_t s = 0; s < n; ++s)
    surface_.each_phyxel(surfel[s], [&](uint32_t p, double) {
      if (column_[p] != kNone) return;
      column_[p] = static_cast<uint32_t>(points_.size());
      points_.push_back(p);
    });
  const uint32_t m = static_cast<uint32_t>(points_.size());
  if (surface_.identity()) return restricted(m, points_.data(), matrix);
  between_.resize(size_t{9} * m * m);
  if (!restricted(m, points_.data(), between_.data())) return false;
  std::fill_n(matrix, size_t{9} * n * n, 0.0);
  for (uint32_t s = 0; s < n; ++s)
    for (uint32_t t = 0; t < n; ++t)
      surface_.each_phyxel(surfel[s], [&](uint32_t p, double ws) {
        surface_.each_phyxel(surfel[t], [&](uint32_t q, double wt) {
          for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b)
              matrix[(3 * size_t{s} + a) * 3 * n + 3 * size_t{t} + b] +=
                  ws * wt * between_[(3 * size_t{column_[p]} + a) * 3 * m + 3 * size_t{column_[q]} + b];
        });
      });
  return true;
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

// v_end = v_free + A^-1 push.
bool ImplicitPoints::linear_end(const double *surfel_impulse) {
  std::fill(change_.begin(), change_.end(), 0.0);
  if (surfel_impulse) spread_impulses(surfel_impulse, 1, change_);
  if (ended_ && change_ == push_) return true;
  push_.swap(change_);
  p_.v_end = p_.v_free;
  if (surfel_impulse) {
    if (!solve(push_, change_)) return false;
    add(p_.v_end, 1);
  }
  return ended_ = true;
}

Revision ImplicitPoints::revise(const SubStep &now, const double *surfel_impulse) {
  if (!abilities().revises) return Revision::none;
  const double before = error_;
  before_.swap(p_.v_end);
  ended_ = false;
  if (!linear_end(surfel_impulse)) return Revision::failed;
  const bool known = residual_at(now, p_.v_end.data(), push_.data());
  if (known && !solve_way(residual_)) return Revision::failed;
  error_ = known ? largest(change_) : HUGE_VAL;
  const double allowed = allowed_error(p_.v_end);
  if (error_ <= allowed || (revisions_ >= kRevisions && error_ <= kTolerated * allowed)) {
    revisions_ = 0;
    return Revision::none;
  }
  if (++revisions_ > kRevisions || !(error_ <= kDiverges * least_error_)) return Revision::diverged;
  least_error_ = std::min(least_error_, error_);
  // The first correction is tried with the matrix at hand, and so is each that halves the one before.
  Array<double> &v = p_.v_free;
  ended_ = false;
  if (before == 0 || error_ <= kContracts * before ||
      (error_ <= kDiverges * before && patient(error_ / before))) {
    if (before == 0) ways_.start(change_.size());
    accelerate(v);
    add(v, 1);
    return Revision::velocity;
  }
  // What leads away from the solution is taken half way.
  const double share = error_ <= before ? 1 : 0.5;
  for (size_t j = 0; j < v.size(); ++j) v[j] = before_[j] + share * (p_.v_end[j] - before_[j]);
  if (!residual_at(now, v.data(), nullptr) || !linearize(now) || !solve_way(residual_))
    return Revision::failed;
  add(v, 1);
  ways_.start(change_.size());
  return Revision::response;
}

// Forces are asked once more where the model has a state, whose next value they write.
bool ImplicitPoints::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  if (!linear_end(touched ? surfel_impulse : nullptr)) return false;
  const Array<double> &v = p_.v_end;
  if (!model_.state.empty() && !ask(now, v.data(), true)) return false;
  double poison = 0;
  for (size_t j = 0; j < v.size(); ++j) {
    poison += 0.0 * v[j];
    p_.x_end[j] = p_.x[j] + now.h * v[j];
  }
  return poison == 0;
}

// An impulse moves all points, touched or not.
void ImplicitPoints::bound_ends(double &speed, double &change) const {
  bound_surfel_ends(p_.v_end.data(), speed, change);
}

// Backward Euler errs by h^2 a / 2 in the position, a the acceleration; what all points have in common bends
// nothing.
double ImplicitPoints::accurate_step(const SubStep &now) const {
  const auto gained = [&](uint32_t i) {
    return load3(&p_.v_end[size_t{kStride} * i]) - load3(&p_.v[size_t{kStride} * i]);
  };
  Vec3 mean;
  double mass = 0, most = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    mean += p_.mass[i] * gained(i);
    mass += p_.mass[i];
  }
  mean = (1 / mass) * mean;
  for (uint32_t i = 0; i < p_.n; ++i) most = std::max(most, norm2(gained(i) - mean));
  const double error = 0.5 * now.h * std::sqrt(most);
  return now.h * std::min(kGrows, std::sqrt(kErrs * surface_.median_edge / error));
}

void ImplicitPoints::commit(const SubStep &now, double fraction) {
  if (fraction < 1) shorten(p_, fraction * now.h);
  p_.x.swap(p_.x_end);
  p_.v.swap(p_.v_end);
  model_.commit_state();
}

}  // namespace dfm
