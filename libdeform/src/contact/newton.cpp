// The method of contact/newton.h: outer passes, Newton steps, line search.
#include "contact/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "body/phyxels.h"
#include "contact/bonds.h"
#include "contact/row_law.h"
#include "contact/solve_settings.h"

namespace dfm {

using Set = SolveSettings;

namespace {

// rho w, at most: half of the digits are left to A in A + J'GJ.
constexpr double kStiffest = 0x1p26;

}  // namespace

// m/s: what g would change of the velocities of points by themselves, of bodies as a whole, and, through the
// motions of blocks, of contacts.
double ContactNewton::error() const {
  double most = 0;
  for (size_t k = 0; k < size_t{3} * first_motion_; ++k)
    most = std::max(most, std::fabs(inverse_[k] * g_[k]));
  for (uint32_t k = 0; k < row_.size() && first_motion_ < nodes_; ++k) {
    Vec3 u;
    for (uint32_t e = entry_[k]; e < entry_[k + 1]; ++e)
      if (node_[e] >= first_motion_) u += entry_times(e, &g_[3 * size_t{node_[e]}]);
    most = std::max(most, norm(u));
  }
  for (const Body &b : bodies_) {
    Vec3 sum;
    for (uint32_t k = b.first; k < b.first + b.count; ++k)
      for (int c = 0; c < 3; ++c)
        if (inverse_[3 * size_t{k} + size_t(c)] > 0) sum[c] += g_[3 * size_t{k} + size_t(c)];
    most = std::max(most, norm(sum) / b.system->mass());
  }
  return most;
}

double ContactNewton::scaled_norm() const {
  double sum = 0;
  for (size_t k = 0; k < g_.size(); ++k) sum += inverse_[k] * (g_[k] * g_[k]);
  return std::sqrt(sum);
}

// v = base + share direction
void ContactNewton::move(double share) {
  for (uint32_t k = 0; k < nodes_; ++k)
    for (size_t c = 0; c < 3; ++c)
      v_[size_t{kStride} * k + c] = base_[size_t{kStride} * k + c] + share * direction_[3 * size_t{k} + c];
}

// out = A in, of the points of bodies.
void ContactNewton::multiply_bodies(const double *in, double *out) const {
  std::fill_n(out, size_t{3} * nodes_, 0.0);
  for (const uint32_t b : body_blocks_) {
    const uint32_t i = pattern_.ij[2 * size_t{b}], j = pattern_.ij[2 * size_t{b} + 1];
    const double *const a = &matrix_[9 * size_t{b}];
    add3(out + 3 * size_t{i}, in_frame(a, load3(in + 3 * size_t{j})));
    if (i != j) add3(out + 3 * size_t{j}, from_frame(a, load3(in + 3 * size_t{i})));
  }
}

// out = (A + J' G J) in
void ContactNewton::multiply(const double *in, double *out, bool symmetric) const {
  multiply_bodies(in, out);
  for (uint32_t k = first_single_; k < nodes_; ++k)
    for (size_t c = 0; c < 3; ++c)
      out[3 * size_t{k} + c] = matrix_[9 * size_t{diagonal_[k]} + 4 * c] * in[3 * size_t{k} + c];
  for (uint32_t k = 0; k < row_.size(); ++k) {
    if (is_open(k)) continue;  // most rows are
    const double *G = &slope_[9 * size_t{k}];
    double s[9];
    if (symmetric) {
      symmetric_part(G, s);
      G = s;
    }
    const Vec3 u = times(k, in, 3);
    add_transposed(k, in_frame(G, u), out);
  }
}

// direction = -(A + J'GJ)^-1 g to this relative residual, with the last factor while it is good enough. What
// conjugate gradients need of a matrix costs as much as some of their iterations, and is new each time.
bool ContactNewton::find_direction(bool symmetric, double tolerance) {
  find_slopes(symmetric);
  if (!(current_ || set_matrix())) return false;
  current_ = true;
  for (size_t k = 0; k < g_.size(); ++k) rhs_[k] = inverse_[k] > 0 ? -g_[k] : 0;
  const auto by = [&](const double *in, double *out) { multiply(in, out, symmetric); };
  bool definite = true;
  const auto precondition = [&](const double *in, double *out) {
    SolveInfo info;
    std::fill_n(out, g_.size(), 0.0);
    solver_->solve(1, in, out, Set::accuracy, info);
    definite = definite && !info.indefinite;
    products_ += info.iterations;  // each costs as much as one of those outside
  };
  for (bool fresh : {false, true}) {
    if (!fresh && (!factored_ || !solver_->direct() || factor_products_ >= Set::inner)) continue;
    if (fresh && !refactor()) return false;
    const Gmres::Result found = gmres_.run(g_.size(), rhs_.data(), direction_.data(), tolerance, Set::inner,
                                           solver_->direct(), by, precondition);
    products_ += found.iterations;
    factor_products_ = fresh ? 0 : factor_products_ + found.iterations;
    if (fresh || found.left <= tolerance) break;
  }
  return definite;
}

// A step begins at v.
void ContactNewton::begin_step() {
  base_.assign(v_.begin(), v_.end());
  base_r_.assign(r_.begin(), r_.end());
}

// Whether r has changed from base to v as A says, to the accuracy of a step's system. A new A would then give
// no better step, and models take longer for it than the other parts of a step together.
bool ContactNewton::is_linear() {
  const size_t n = size_t{3} * first_single_;
  for (size_t k = 0; k < n; ++k) {
    const size_t at = kStride * (k / 3) + k % 3;
    direction_[k] = v_[at] - base_[at];
  }
  multiply_bodies(direction_.data(), rhs_.data());
  double off = 0, all = 0;
  for (size_t k = 0; k < n; ++k) {
    const double e = r_[k] - base_r_[k] - rhs_[k];
    off += inverse_[k] * (e * e);
    all += inverse_[k] * (rhs_[k] * rhs_[k]);
  }
  return off <= Set::of_start * Set::of_start * all;
}

// A step with the coupled derivative. False: it does not lower g enough; v is where it was.
bool ContactNewton::coupled_step(double tolerance, double left, bool &failed) {
  const double before = scaled_norm();
  const bool kept = current_;
  failed = !find_direction(false, std::min(Set::accuracy * tolerance / left, Set::of_start));
  if (failed) return false;
  begin_step();
  ++steps_;
  for (const double share : {1.0, 0.5}) {
    move(share);
    if (!evaluate(false) || !(scaled_norm() <= (1 - Set::accuracy * share) * before)) continue;
    current_ = is_linear();
    return true;
  }
  v_.swap(base_);
  current_ = !kept;
  failed = !evaluate(false);
  return false;
}

// Steps on the convex function with frozen limits of friction, until its gradient has fallen to 0.3 of the
// first.
bool ContactNewton::frozen_steps() {
  freeze();
  if (!evaluate(true)) return false;
  const double start = scaled_norm();
  while (steps_ < limit_) {
    const auto slope = [&] {
      double sum = 0;
      for (size_t k = 0; k < g_.size(); ++k) sum += g_[k] * direction_[k];
      return sum;
    };
    const bool kept = current_;
    if (!find_direction(true, Set::of_start)) return false;
    const double first = slope();
    begin_step();
    ++steps_;
    if (!(first < 0)) {
      current_ = !kept;
      return evaluate(false);
    }
    // the share of the direction at which the slope has nearly vanished, between one where it is negative and
    // one where it is not, or where the function is not known
    double low = 0, high = 0, at_low = first, at_high = 0, share = 1;
    bool found = false;
    for (uint32_t trial = 0; trial < Set::inner; ++trial) {
      move(share);
      const bool known = evaluate(true);
      const double now = known ? slope() : std::numeric_limits<double>::infinity();
      found = known && now <= -Set::accuracy * first && (share == 1 || now >= Set::accuracy * first);
      if (found) break;
      if (now > 0) {
        high = share;
        at_high = now;
      } else {
        low = share;
        at_low = now;
      }
      const double ratio = std::isfinite(at_high) ? at_low / (at_low - at_high) : 0.5;
      share =
          low + std::clamp(trial % Set::rounds == Set::rounds - 1 ? 0.5 : ratio, 0.05, 0.95) * (high - low);
    }
    current_ = r_known_ && is_linear();
    // no such place: there is a jump in a law, at which steps would stay
    if (!found || !(scaled_norm() > Set::accuracy * start)) break;
  }
  return evaluate(false);
}

void ContactNewton::report() {
  host_->spend(uint64_t{products_ - std::exchange(reported_, products_)} * part_.all());
}

// v with g = 0 for the present multipliers, up to a tolerance in m/s; left: the error. cycles: coupled and
// frozen steps undo each other. With strong friction g may have no zero that they reach; it has one where rho
// is small, since A then outweighs what is not symmetric.
bool ContactNewton::newton(double tolerance, double &left, bool &cycles) {
  cycles = false;
  goal_ = tolerance;
  if (!evaluate(false)) return false;
  uint32_t phases = 0;
  while ((left = error()) > tolerance && steps_ < limit_) {
    report();
    bool failed = false;
    if (coupled_step(tolerance, left, failed)) continue;
    if (!failed && phases++ == Set::rounds) return cycles = true;
    if (failed || !frozen_steps()) return false;
  }
  return true;
}

// The rows get the present impulses and velocities.
void ContactNewton::put_rows() {
  ContactRows &rows = *rows_;
  for (size_t k = 0; k < row_.size(); ++k) std::copy_n(&l_[3 * k], 3, &rows.impulse[size_t{3} * row_[k].row]);
  rows.restore(part_);
  each_row(part_, [&](uint32_t i) {
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      const uint32_t d = rows.dof[j], node = node_of_dof_[d];
      if (node != kNone) std::copy_n(&v_[size_t{kStride} * node], 3, &rows.y[size_t{kStride} * d]);
    }
  });
}

void ContactNewton::scale_penalties(double by) {
  by = std::min(by, kStiffest / stiff_);
  stiff_ *= by;
  for (double &rho : rho_) rho *= by;
  for (double &response : response_) response /= by;
}

bool ContactNewton::solve(double tolerance, double normal, uint32_t steps) {
  converged_ = r_known_ = current_ = false;
  limit_ = steps_ + steps;
  set_penalties(Set::penalty);
  goal_ = Set::accuracy * tolerance;
  lh_.assign(l_.begin(), l_.end());
  if (!host_->judge(residual_) || !evaluate(false)) return false;
  double left = std::max(residual_.speed, error()), reference = left;  // m/s
  double best = std::numeric_limits<double>::infinity();
  bool spent = false;
  uint32_t slow = 0, passes_at_rest = 0;
  for (passes_ = 0; passes_ < steps;) {
    ++passes_;
    before_.assign(v_.begin(), v_.end());
    const double goal = Set::accuracy * std::max(reference, tolerance);
    double off;
    bool cycles;
    if (!newton(goal, off, cycles)) return false;
    if (cycles && steps_ < limit_ && host_->goes_on()) {
      scale_penalties(1 / Set::penalty);
      slow = 0;
      v_.assign(before_.begin(), before_.end());
      current_ = false;
      continue;
    }
    put_rows();
    find_slides();
    for (const Row &r : row_)
      if (r.kind == Kind::drag) limit_drag(*rows_, r.row);
    if (!host_->judge(residual_)) return false;
    const double required = std::max(residual_.relative, off / tolerance);
    converged_ = required <= Set::accuracy;
    const double now = std::max(residual_.speed, off);
    if (now < best) {
      best = now;
      best_v_.assign(v_.begin(), v_.end());
      best_g_.assign(g_.begin(), g_.end());
      best_l_.assign(l_.begin(), l_.end());
      best_slides_.clear();
      for (const Row &r : row_) best_slides_.push_back(r.kind == Kind::contact && state_->slides[r.row]);
    }
    report();
    if (converged_ || steps_ >= limit_ || (spent = !host_->goes_on())) break;
    lh_.assign(l_.begin(), l_.end());
    double moved = 0;
    for (size_t k = 0; k < v_.size(); ++k) moved = std::max(moved, std::fabs(v_[k] - before_[k]));
    // Rows that contradict each other: multipliers change without end, velocities do not, however large the
    // penalties are. Those of nearly parallel rows change slowly, too.
    const bool at_rest = passes_ > Set::rounds && moved <= Set::accuracy * tolerance;
    const bool stalled = at_rest && residual_.speed <= Set::contradiction * normal;
    if (at_rest && off <= tolerance) {
      const bool stiffest = stiff_ >= kStiffest, repeated = passes_at_rest++ >= Set::rounds;
      converged_ = stalled && (repeated || stiffest);
      if (converged_ || stiffest) break;
      scale_penalties(Set::penalty);
    }
    reference = stalled ? off : now;
    slow = now > 0.5 * left ? slow + 1 : 0;
    left = now;
    if (slow < Set::rounds) continue;
    slow = 0;
    scale_penalties(Set::penalty);
  }
  if (!converged_ && std::max(residual_.speed, error()) > best) {
    v_.swap(best_v_);
    g_.swap(best_g_);
    l_.swap(best_l_);
    put_rows();
    for (size_t k = 0; k < row_.size(); ++k)
      if (row_[k].kind == Kind::contact) state_->slides[row_[k].row] = best_slides_[k];
    if (!host_->judge(residual_)) return false;
  }
  if (converged_ && residual_.required > 1) residual_.required = residual_.relative = 1;
  // what is left of g moves implicit bodies without a cause; single points have what their impulses give
  const bool makes_energy = spent ? !bodies_.empty() : adds_energy(normal);
  return converged_ || residual_.required <= 1 || !makes_energy || penalties_alone(tolerance, steps);
}

// Whether normal impulses do more work than residuals of this size explain.
bool ContactNewton::adds_energy(double normal) const {
  double work = 0, all = 0;
  for (uint32_t k = 0; k < row_.size(); ++k) {
    if (row_[k].kind != Kind::contact) continue;
    const uint32_t i = row_[k].row;
    const double l = l_[3 * size_t{k}];
    all += l;
    const Vec3 u = times(k, v_.data(), kStride) + load3(&bias_[3 * size_t{k}]);
    work += l * (u.x + rows_->rate[i] + yield_speed(l, &rows_->compliance[3 * size_t{i}]));
  }
  return work > normal * all;
}

// Where rows ask for what cannot be, multipliers grow without end, and where the budget has ended the solve,
// they need not be in balance. Impulses of the penalties alone resist motion in proportion to it, so no
// contact does work that its law does not allow; bodies give way a little. With implicit bodies at rest the
// function that steps lower has their energy at the start of the sub-step as its first value.
bool ContactNewton::penalties_alone(double tolerance, uint32_t steps) {
  std::fill(lh_.begin(), lh_.end(), 0.0);
  for (size_t k = 0; k < size_t{3} * first_single_; ++k)
    if (inverse_[k] > 0) v_[kStride * (k / 3) + k % 3] = 0;
  current_ = false;
  limit_ = steps_ + steps;
  double left;
  for (bool cycles = true; cycles && steps_ < limit_;) {
    if (!newton(tolerance, left, cycles)) return false;
    if (cycles) scale_penalties(1 / Set::penalty);
  }
  put_rows();
  find_slides();
  return host_->judge(residual_);
}

// What is left of g moves each body as a whole, so that its momentum is that of the impulses.
void ContactNewton::take() {
  for (const Body &b : bodies_) {
    Vec3 sum, free;
    for (uint32_t k = b.first; k < b.first + b.count; ++k)
      for (int c = 0; c < 3; ++c) {
        free[c] += inverse_[3 * size_t{k} + size_t(c)] > 0;
        sum[c] += g_[3 * size_t{k} + size_t(c)];
      }
    for (int c = 0; c < 3; ++c)
      if (free[c] == b.count)
        for (uint32_t k = b.first; k < b.first + b.count; ++k)
          v_[size_t{kStride} * k + size_t(c)] -= sum[c] / b.system->mass();
    b.system->take(&v_[size_t{kStride} * b.first]);
  }
}

}  // namespace dfm
