#include "dynamics/explicit_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dynamics/mass_scaling.h"
#include "dynamics/symplectic_euler.h"
#include "math/lanczos.h"

namespace dfm {
namespace {
constexpr uint32_t kAhead = 48;   // points: as long as memory takes to answer
constexpr double kNotGiven = -1;  // J, of a part: no kinetic energy is that
constexpr double kMoved = 1e-4;   // of the shortest edge: a difference of forces is that of their derivatives
// Strain of an edge from which on nothing of the spectrum at rest counts.
constexpr double kUnlikeRest = 0.5;
constexpr double kNoDrag = 1e-6;  // of row sums of damping: rounding

FreeMotion free_motion_of(Phyxels &p, const double *gravity, double h) {
  return {h,          gravity,         p.mass.data(),  p.v.data(), p.inv_mass.data(),
          p.x.data(), p.v_free.data(), p.x_end.data(), p.n};
}

// v_free for free components, and x_end where it leads; held components keep the velocity they carry. Returns
// its kinetic energy, J, which is not finite where a component is not.
double predict(const PointsKernels &loops, Phyxels &p, const SubStep &now) {
  const double g[kStride] = {now.gravity.x, now.gravity.y, now.gravity.z, 0};
  return loops.predict(free_motion_of(p, g, now.h), p.n, p.f.data());
}
}  // namespace

ExplicitPoints::ExplicitPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const Array<uint32_t> &edges)
    : Dynamics(points, surface, model),
      edges_(edges),
      loops_(points_kernels()),
      stiffness_(points.n, 0.0, memory),
      damping_(points.n, 0.0, memory) {
  abilities_ = {.forces = true, .springs = true, .placed = true, .energy = true};
  use_memory(memory, part_kinetic_, reached_, before_, lagged_, drag_, load_);
  if (model.part_forces)  // after a failure: none, and forces come for all points at once
    part_kinetic_.resize(model.ask("parts", [&] { return model.part_forces->parts(model.self); }));
}

bool ExplicitPoints::row_sums(const dfm_kin &k, double &cell) {
  std::fill(stiffness_.begin(), stiffness_.end(), 0.0);
  std::fill(damping_.begin(), damping_.end(), 0.0);
  const auto query = [&] {
    return model_.ops->bound(model_.self, &k, stiffness_.data(), damping_.data(), &cell);
  };
  return model_.call("bound", query) == DFM_OK;
}

// The points at rest, displaced and moving, for forces that are measured there.
struct ExplicitPoints::Trial {
  std::vector<double> x, v, f;  // [npoint,4]
  dfm_kin kin;
  explicit Trial(const ExplicitPoints &of, const Pose &placed = {})
      : x(of.p_.x.size()), v(x), f(x), kin(of.kin(0, 0)) {
    for (uint32_t i = 0; i < of.p_.n; ++i)
      store3(&x[size_t{kStride} * i], place(placed, load3(&of.p_.rest[size_t{3} * i])));
    kin.x = x.data();
    kin.v = v.data();
  }
  bool forces(const ModelInstance &model) {
    std::fill(f.begin(), f.end(), 0.0);
    return model.add_forces(kin, f.data()) == DFM_OK;
  }
};

// Drag is what dampers give to a uniform velocity: it sees no lag. It follows from the parameters.
bool ExplicitPoints::find_drag() {
  if (drag_of_ == model_.params) return true;
  Trial rest(*this);
  double cell = 0;
  if (!row_sums(rest.kin, cell) || !rest.forces(model_)) return false;
  const std::vector<double> still = rest.f;
  for (size_t at = 0; at < rest.v.size(); at += kStride) rest.v[at] = 1;
  if (!rest.forces(model_)) return false;
  drag_.resize(p_.n);
  bool any = false;
  for (uint32_t i = 0; i < p_.n; ++i) {
    drag_[i] = std::max(0.0, still[size_t{kStride} * i] - rest.f[size_t{kStride} * i]);
    any |= drag_[i] > kNoDrag * damping_[i];
  }
  if (!any) drag_.clear();
  drag_of_ = model_.params;
  return true;
}

// Dampers c with a lag count as springs c / lag.
void ExplicitPoints::lag_rows(double lag) {
  lagged_.resize(p_.n);
  for (uint32_t i = 0; i < p_.n; ++i) {
    lagged_[i] = std::max(0.0, damping_[i] - drag(i)) / lag;
    damping_[i] = drag(i);
  }
}

// 1/s: the slowest motion in which the body strains the same everywhere, by Rayleigh's quotient of forces.
// Its slowest modes are as slow or slower. < 0: the model fails.
double ExplicitPoints::own_frequency(Trial &rest, double edge) {
  if (!rest.forces(model_)) return -1;
  const std::vector<double> at_rest = rest.f, x = rest.x;
  Vec3 center;
  double mass = 0, slowest = std::numeric_limits<double>::infinity(), widest = 0;
  for (uint32_t i = 0; i < p_.n; ++i) {
    mass += p_.mass[i];
    center += p_.mass[i] * load3(&x[size_t{kStride} * i]);
  }
  center = (1 / mass) * center;
  const double middle[3] = {center.x, center.y, center.z};
  for (uint32_t i = 0; i < p_.n; ++i)
    widest = std::max(widest, norm2(load3(&x[size_t{kStride} * i]) - center));
  const double size = kMoved * edge / std::sqrt(widest);
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col <= row; ++col) {
      double work = 0, moved = 0;
      const auto way = [&](uint32_t i) {
        const double *const from = &x[size_t{kStride} * i];
        double u[3] = {};
        u[row] += size * (from[col] - middle[col]);
        if (col != row) u[col] += size * (from[row] - middle[row]);
        return load3(u);
      };
      for (uint32_t i = 0; i < p_.n; ++i)
        store3(&rest.x[size_t{kStride} * i], load3(&x[size_t{kStride} * i]) + way(i));
      if (!rest.forces(model_)) return -1;
      for (uint32_t i = 0; i < p_.n; ++i) {
        const size_t at = size_t{kStride} * i;
        work += dot(way(i), load3(&at_rest[at]) - load3(&rest.f[at]));
        moved += p_.mass[i] * norm2(way(i));
      }
      if (work > 0) slowest = std::min(slowest, work / moved);
    }
  rest.x = x;
  return std::sqrt(slowest);
}

// The longest lag with which the slowest strain is damped as without one; 0: dampers strain nothing.
double ExplicitPoints::find_lag(Trial &rest, double edge) {
  double cell = 0, ratio = 0;  // s, of damping to stiffness
  if (!row_sums(rest.kin, cell) || *std::max_element(damping_.begin(), damping_.end()) <= 0) return 0;
  const double frequency = find_drag() ? own_frequency(rest, edge) : -1;
  if (!(frequency >= 0) || !row_sums(rest.kin, cell)) return 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    if (stiffness_[i] > 0) ratio = std::max(ratio, (damping_[i] - drag(i)) / stiffness_[i]);
  return ratio > 0 ? damper_lag(ratio, frequency) : 0;
}

// s, stable sub-step at rest; 0: the model fails.
double ExplicitPoints::step_at_rest(Trial &rest, const ExplicitTime &with) {
  double cell = 0;
  if (!row_sums(rest.kin, cell)) return 0;
  if (with.lag > 0) lag_rows(with.lag);
  for (uint32_t i = 0; i < p_.n; ++i)
    stiffness_[i] = with.share * (stiffness_[i] + (with.lag > 0 ? lagged_[i] : 0));
  uint32_t point = 0;
  return stable_step(p_, stiffness_.data(), damping_.data(), &point);
}

// Row sums of a mesh are up to twice the largest eigenvalue of its stiffness, which is found by products:
// differences of the forces, those of dampers with a lag included. What a state adds to them is not in them.
double ExplicitPoints::find_share(Trial &rest, double lag, double edge) {
  const size_t n = size_t{3} * p_.n;
  double most = 0, cell = 0;
  if (!row_sums(rest.kin, cell) || !rest.forces(model_)) return 1;
  if (lag > 0) lag_rows(lag);
  for (uint32_t i = 0; i < p_.n; ++i)
    most = std::max(most, (stiffness_[i] + (lag > 0 ? lagged_[i] : 0)) / p_.mass[i]);
  const std::vector<double> at_rest = rest.f, x = rest.x;
  const double found = largest_eigenvalue(n, [&](const std::vector<double> &u, std::vector<double> &out) {
    double widest = 0;
    for (size_t i = 0; i < n; ++i) widest = std::max(widest, std::fabs(u[i] / std::sqrt(p_.mass[i / 3])));
    const double size = kMoved * edge / widest;
    const auto each = [&](auto &&act) {
      for (size_t i = 0; i < n; ++i) act(i, kStride * (i / 3) + i % 3, std::sqrt(p_.mass[i / 3]));
    };
    each([&](size_t i, size_t at, double root) {
      rest.x[at] = x[at] + size * u[i] / root;
      if (lag > 0) rest.v[at] = size * u[i] / root / lag;
    });
    if (!rest.forces(model_)) return false;
    each([&](size_t i, size_t at, double root) {
      const double dragged = lag > 0 ? drag(uint32_t(i / 3)) * rest.v[at] : 0;
      out[i] = (at_rest[at] - rest.f[at] - dragged) / (size * root);
    });
    return true;
  });
  rest.x = x;
  std::fill(rest.v.begin(), rest.v.end(), 0.0);
  return found > 0 && found < most ? found / most : 1;
}

ExplicitTime ExplicitPoints::measure(const Pose &placed, bool spectrum) {
  ExplicitTime out;
  if (!model_.ops->bound || edges_.empty()) return out;
  double edge = std::numeric_limits<double>::infinity();  // m, the shortest
  for (size_t e = 0; e < edges_.size(); e += 2) {
    const double *const a = &p_.rest[size_t{3} * edges_[e]], *const b = &p_.rest[size_t{3} * edges_[e + 1]];
    edge = std::min(edge, norm(load3(a) - load3(b)));
  }
  Trial rest(*this, placed);
  ExplicitTime lagged;
  lagged.lag = find_lag(rest, edge);
  for (ExplicitTime *with : {&out, &lagged})
    if (spectrum && model_.state.empty() && (with == &out || with->lag > 0))
      with->share = find_share(rest, with->lag, edge);
  // a lag pays where dampers alone bound the sub-step more than what it makes of them
  return lagged.lag > 0 && step_at_rest(rest, lagged) > step_at_rest(rest, out) ? lagged : out;
}

bool ExplicitPoints::rest_rows(const Pose &placed, double share, RestRows &out) {
  const Trial rest(*this, placed);
  const bool lagged = p_.dampers.lag > 0;
  double cell = 0;
  if (!model_.ops->bound || (lagged && !find_drag()) || !row_sums(rest.kin, cell)) return false;
  if (lagged) lag_rows(p_.dampers.lag);
  out.stiffness.assign(p_.n, 0.0);
  out.damping.assign(p_.n, 0.0);
  for (uint32_t i = 0; i < p_.n; ++i) {
    if ((p_.held[i] & 7) == 7) continue;
    out.stiffness[i] = share * (stiffness_[i] + (lagged ? lagged_[i] : 0));
    out.damping[i] = damping_[i];
  }
  return true;
}

dfm_kin ExplicitPoints::seen(double time, double h, bool trial) const {
  dfm_kin k = kin(time, h, trial);
  if (!p_.dampers.v.empty()) k.v = p_.dampers.v.data();
  return k;
}

// The largest strain of the edges, against their lengths at rest.
double ExplicitPoints::largest_strain() const {
  double most = 0;
  for (size_t e = 0; e < edges_.size(); e += 2) {
    const uint32_t i = edges_[e], j = edges_[e + 1];
    const double rest = norm2(load3(&p_.rest[size_t{3} * i]) - load3(&p_.rest[size_t{3} * j]));
    const double now = norm2(load3(&p_.x[size_t{kStride} * i]) - load3(&p_.x[size_t{kStride} * j]));
    most = std::max(most, std::fabs(std::sqrt(now / rest) - 1));
  }
  return most;
}

// The share that was measured at rest is less and less true as the shape leaves it. Damping without a lag
// stays by row sums: near its own bound a mode changes its sign in each sub-step, and contact keeps it going.
bool ExplicitPoints::bound(double time, double share, const AddRowSums &outside, StepBound &out) {
  if (!model_.ops->bound) return true;
  double cell = std::numeric_limits<double>::infinity();
  out.lagged = p_.dampers.lag > 0;
  if ((out.lagged && !find_drag()) || !row_sums(seen(time, 0), cell)) return false;
  const double now = share < 1 ? share + (1 - share) * std::min(1.0, largest_strain() / kUnlikeRest) : 1;
  if (out.lagged) lag_rows(p_.dampers.lag);
  for (double &sum : stiffness_) sum *= now;
  outside(stiffness_.data(), damping_.data());
  for (uint32_t i = 0; out.lagged && i < p_.n; ++i) stiffness_[i] += now * lagged_[i];
  out.step = std::min(cell, stable_step(p_, stiffness_.data(), damping_.data(), &out.point));
  // Limits of 4 m / (c + sqrt(c^2 + 4 m k)): without damping, without stiffness.
  if (out.point < p_.n) {
    const double m = p_.mass[out.point];
    const double dampers = out.lagged ? now * lagged_[out.point] : 0;
    out.by_stiffness = 2 * std::sqrt(m / (stiffness_[out.point] - dampers));
    out.by_damping = 2 * m / damping_[out.point];
  }
  return true;
}

bool ExplicitPoints::add_forces(const SubStep &now, bool keep) {
  moved_ = !keep && !part_kinetic_.empty();
  return moved_ ? move_parts(now) : find_forces(now);
}

// Drag sees the velocity itself: what it lacks in the forces of the model is a load.
// Null: the model fails.
const double *ExplicitPoints::loads() {
  if (p_.dampers.v.empty()) return p_.load.data();
  if (!find_drag()) return nullptr;
  if (drag_.empty()) return p_.load.data();
  load_.resize(p_.load.size());
  for (size_t at = 0; at < load_.size(); ++at)
    load_[at] = p_.load[at] - drag_[at / kStride] * (p_.v[at] - p_.dampers.v[at]);
  return load_.data();
}

bool ExplicitPoints::find_forces(const SubStep &now) {
  const double *const load = loads();
  if (!load) return false;
  std::copy_n(load, p_.f.size(), p_.f.begin());
  const dfm_kin k = seen(now.time, now.h, true);
  return model_.add_forces(k, p_.f.data()) == DFM_OK;
}

bool ExplicitPoints::move_parts(const SubStep &now) {
  const double gravity[kStride] = {now.gravity.x, now.gravity.y, now.gravity.z, 0};
  FreeMotion motion = free_motion_of(p_, gravity, now.h);
  if (part_kinetic_.size() > 1) motion.ahead = kAhead;  // one part lies in the cache
  std::fill(part_kinetic_.begin(), part_kinetic_.end(), kNotGiven);
  const double *const load = loads();
  if (!load) return false;
  const auto move = [&](uint32_t part, uint32_t n, const uint32_t *point, const double *f) {
    if (part >= part_kinetic_.size()) return;
    part_kinetic_[part] = loops_.predict_part(motion, n, point, load, f);
  };
  // A model that leaves out a part has failed.
  return model_.add_part_forces(seen(now.time, now.h, true), move) == DFM_OK &&
         std::find(part_kinetic_.begin(), part_kinetic_.end(), kNotGiven) == part_kinetic_.end();
}

bool ExplicitPoints::free_motion(const SubStep &now, double &kinetic) {
  kinetic =
      moved_ ? std::accumulate(part_kinetic_.begin(), part_kinetic_.end(), 0.0) : predict(loops_, p_, now);
  in_place_ = false;
  reached_.clear();
  // A lightest point at the limit has so much alone; who has less need not be looked at point by point.
  if (kinetic < 0.5 * p_.least_mass * (now.fastest * now.fastest)) return true;
  if (!std::isfinite(kinetic)) return false;
  return std::all_of(p_.v_free.begin(), p_.v_free.end(),
                     [&](double v) { return std::fabs(v) <= now.fastest; });
}

// Contact reaches few points, where surfels are points: only those move otherwise than freely.
bool ExplicitPoints::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  free_again(now);
  in_place_ = !touched || surface_.identity();
  end_.v = end_.mean = (in_place_ ? p_.v_free : p_.v_end).data();
  if (!in_place_) {
    loops_.end(p_.n, now.h, p_.x.data(), p_.v_free.data(), p_.inv_mass.data(),
               touched ? p_.impulse.data() : nullptr, p_.x_end.data(), p_.v_end.data());
    return true;
  }
  if (!touched) return true;
  reached_.reserve(surface_.nsurfel);
  before_.resize(size_t{3} * surface_.nsurfel);
  for (uint32_t s = 0; s < surface_.nsurfel; ++s) {
    const double *const q = surfel_impulse + 3 * size_t(s);
    if (q[0] == 0 && q[1] == 0 && q[2] == 0) continue;
    const size_t first = size_t(surface_.point[s]) * kStride;
    std::copy_n(&p_.v_free[first], 3, &before_[3 * reached_.size()]);
    reached_.push_back(first);
    for (size_t k = 0, at = first; k < 3; ++k, ++at) {
      p_.v_free[at] += p_.inv_mass[at] * q[k];
      p_.x_end[at] = p_.x[at] + now.h * p_.v_free[at];
    }
  }
  return true;
}

void ExplicitPoints::free_again(const SubStep &now) {
  for (size_t m = 0; m < reached_.size(); ++m)
    for (size_t k = 0, at = reached_[m]; k < 3; ++k, ++at) {
      p_.v_free[at] = before_[3 * m + k];
      p_.x_end[at] = p_.x[at] + now.h * p_.v_free[at];
    }
  reached_.clear();
}

void ExplicitPoints::take_part(double share, bool in_full, const double *surfel_impulse) {
  Dynamics::take_part(share, in_full, surfel_impulse);
  if (in_full) return;
  for (size_t m = 0; m < reached_.size(); ++m) std::copy_n(&before_[3 * m], 3, &p_.v_free[reached_[m]]);
  for (size_t at = 0; at < p_.v.size(); ++at) {
    p_.v_free[at] = p_.v[at] + share * (p_.v_free[at] - p_.v[at]);
    if (!in_place_) p_.v_end[at] = p_.v_free[at] + (surfel_impulse ? p_.inv_mass[at] * p_.impulse[at] : 0);
  }
  if (!in_place_ || !surfel_impulse) return;
  for (uint32_t s = 0; s < surface_.nsurfel; ++s)
    for (size_t k = 0, at = size_t{kStride} * surface_.point[s]; k < 3; ++k, ++at)
      p_.v_free[at] += p_.inv_mass[at] * surfel_impulse[3 * size_t{s} + k];
}

void ExplicitPoints::commit(const SubStep &now) {
  p_.x.swap(p_.x_end);
  p_.v.swap(in_place_ ? p_.v_free : p_.v_end);
  model_.commit_state();
  // lag u' = v - (u + w) / 2, 2 lag w' = u - w by the trapezoid: the dampers keep the energy lag / 2 (u.C u +
  // w.C w) exactly, less h / 2 (u.C u + w.C w) of the means, which is what they take from v.
  const double k = 0.25 * now.h / p_.dampers.lag;
  for (size_t at = 0; at < p_.dampers.v.size(); ++at) {
    double &u = p_.dampers.v[at], &w = p_.dampers.slow[at];
    const double mean = ((1 + k) * (2 * k * p_.v[at] + u) - k * w) / ((1 + k) * (1 + k) + k * k);
    w += 2 * k * (mean - w) / (1 + k);
    u = 2 * mean - u;
  }
}

// From the forces at u and at -u. v_end is free until the end of the sub-step is known.
double ExplicitPoints::damper_energy(double time) {
  if (p_.dampers.v.empty() || !find_drag()) return 0;
  Array<double> &f = p_.v_end;
  const auto turn = [](Array<double> &a) {
    for (double &x : a) x = -x;
  };
  double sum = 0;
  for (Array<double> *u : {&p_.dampers.v, &p_.dampers.slow}) {
    dfm_kin k = kin(time, 0);
    k.v = u->data();
    std::fill(f.begin(), f.end(), 0.0);
    bool known = model_.add_forces(k, f.data()) == DFM_OK;
    turn(f);
    turn(*u);
    known = known && model_.add_forces(k, f.data()) == DFM_OK;
    turn(*u);
    for (size_t at = 0; known && at < f.size(); ++at)
      sum += (*u)[at] * (0.5 * f[at] - drag(uint32_t(at / kStride)) * (*u)[at]);
  }
  return 0.5 * p_.dampers.lag * sum;
}

}  // namespace dfm
