#include "dynamics/explicit_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "body/rigid_motion.h"
#include "dynamics/symplectic_euler.h"
#include "math/lanczos.h"

namespace dfm {
namespace {
constexpr uint32_t kAhead = 48;   // points: as long as memory takes to answer
constexpr double kNotGiven = -1;  // J, of a part: no kinetic energy is that
constexpr double kMoved = 1e-4;   // of the shortest edge: a difference of forces is that of their derivatives
// Strain of an edge from which on nothing of the spectrum at rest counts.
constexpr double kUnlikeRest = 0.5;
}  // namespace

ExplicitPoints::ExplicitPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const Array<uint32_t> &edges)
    : Dynamics(points, surface, model),
      edges_(edges),
      loops_(points_kernels()),
      stiffness_(points.n, 0.0, HookAllocator<double>(memory)),
      damping_(points.n, 0.0, HookAllocator<double>(memory)) {
  use_memory(memory, part_kinetic_, reached_, before_);
  uint32_t parts = 0;  // after a failure: none, and forces come for all points at once
  if (model.part_forces)
    model.call("parts", [&] {
      parts = model.part_forces->parts(model.self);
      return DFM_OK;
    });
  part_kinetic_.resize(parts);
}

bool ExplicitPoints::row_sums(const dfm_kin &k, double &cell) {
  std::fill(stiffness_.begin(), stiffness_.end(), 0.0);
  std::fill(damping_.begin(), damping_.end(), 0.0);
  const auto ask = [&] {
    return model_.ops->bound(model_.self, &k, stiffness_.data(), damping_.data(), &cell);
  };
  return model_.call("bound", ask) == DFM_OK;
}

// Row sums of a mesh are up to twice the largest eigenvalue of its stiffness, which is found by products:
// differences of the forces. What a state adds to the forces is not in them.
double ExplicitPoints::spectral_share() {
  if (!model_.ops->bound || !model_.state.empty() || edges_.empty()) return 1;
  const size_t n = size_t{3} * p_.n;
  double shortest = std::numeric_limits<double>::infinity();
  for (size_t e = 0; e < edges_.size(); e += 2) {
    const double *const a = &p_.rest[size_t{3} * edges_[e]], *const b = &p_.rest[size_t{3} * edges_[e + 1]];
    shortest = std::min(shortest, norm(load3(a) - load3(b)));
  }
  std::vector<double> x(p_.x.size()), still(p_.x.size()), f(p_.x.size()), moved(n), at_rest(n);
  dfm_kin k = kin(0, 0);
  k.x = x.data();
  k.v = still.data();
  const auto forces = [&](double size, double *out) {
    for (size_t i = 0; i < n; ++i) x[kStride * (i / 3) + i % 3] = p_.rest[i] + size * moved[i];
    std::fill(f.begin(), f.end(), 0.0);
    if (model_.add_forces(k, f.data()) != DFM_OK) return false;
    for (size_t i = 0; i < n; ++i) out[i] = f[kStride * (i / 3) + i % 3];
    return true;
  };
  double cell = 0, most = 0;
  if (!forces(0, at_rest.data()) || !row_sums(k, cell)) return 1;
  for (uint32_t i = 0; i < p_.n; ++i) most = std::max(most, stiffness_[i] / p_.mass[i]);
  const double found = largest_eigenvalue(n, [&](const std::vector<double> &u, std::vector<double> &out) {
    double widest = 0;
    for (size_t i = 0; i < n; ++i) {
      moved[i] = u[i] / std::sqrt(p_.mass[i / 3]);
      widest = std::max(widest, std::fabs(moved[i]));
    }
    const double size = kMoved * shortest / widest;
    if (!forces(size, out.data())) return false;
    for (size_t i = 0; i < n; ++i) out[i] = (at_rest[i] - out[i]) / (size * std::sqrt(p_.mass[i / 3]));
    return true;
  });
  return found > 0 && found < most ? found / most : 1;
}

// Of the edges, against their lengths at rest.
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

// The share that was measured at rest is less and less true as the shape leaves it. Damping stays by row
// sums: near its own bound a mode changes its sign in each sub-step, and contact keeps it going.
bool ExplicitPoints::bound(double time, double share, const AddRowSums &outside, StepBound &out) {
  if (!model_.ops->bound) return true;
  double cell = std::numeric_limits<double>::infinity();
  if (!row_sums(kin(time, 0), cell)) return false;
  if (share < 1) {
    const double now = share + (1 - share) * std::min(1.0, largest_strain() / kUnlikeRest);
    for (double &sum : stiffness_) sum *= now;
  }
  outside(stiffness_.data(), damping_.data());
  out.step = std::min(cell, stable_step(p_, stiffness_.data(), damping_.data(), &out.point));
  // Limits of 4 m / (c + sqrt(c^2 + 4 m k)): without damping, without stiffness.
  if (out.point < p_.n) {
    const double m = p_.mass[out.point];
    out.by_stiffness = 2 * std::sqrt(m / stiffness_[out.point]);
    out.by_damping = 2 * m / damping_[out.point];
  }
  return true;
}

// Turning gives none.
double ExplicitPoints::strain_rate() const {
  if (!model_.ops->bound) return 0;
  return loops_.strain_rate(uint32_t(edges_.size() / 2), edges_.data(), p_.x.data(), p_.v.data());
}

bool ExplicitPoints::add_forces(const SubStep &now, bool keep) {
  moved_ = !keep && !part_kinetic_.empty();
  return moved_ ? move_parts(now) : find_forces(now);
}

bool ExplicitPoints::find_forces(const SubStep &now) {
  std::copy(p_.load.begin(), p_.load.end(), p_.f.begin());
  const dfm_kin k = kin(now.time, now.h, true);
  return model_.add_forces(k, p_.f.data()) == DFM_OK;
}

bool ExplicitPoints::move_parts(const SubStep &now) {
  const double gravity[kStride] = {now.gravity.x, now.gravity.y, now.gravity.z, 0};
  FreeMotion motion = free_motion_of(p_, gravity, now.h);
  if (part_kinetic_.size() > 1) motion.ahead = kAhead;  // one part lies in the cache
  std::fill(part_kinetic_.begin(), part_kinetic_.end(), kNotGiven);
  const auto move = [&](uint32_t part, uint32_t n, const uint32_t *point, const double *f) {
    if (part >= part_kinetic_.size()) return;
    part_kinetic_[part] = loops_.predict_part(motion, n, point, p_.load.data(), f);
  };
  // A model that leaves out a part has failed.
  return model_.add_part_forces(kin(now.time, now.h, true), move) == DFM_OK &&
         std::find(part_kinetic_.begin(), part_kinetic_.end(), kNotGiven) == part_kinetic_.end();
}

// A motion of parts has left its forces in what it has changed of the velocities: the model need not compute
// them again. Held components have none.
bool ExplicitPoints::see_forces(const SubStep &now) {
  if (!moved_) return true;
  if (!ways_known_) return find_forces(now);  // other code has changed the free motion
  for (uint32_t i = 0; i < p_.n; ++i)
    for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at)
      p_.f[at] = p_.moves(at) ? force_of(at, p_.v_free[at], now) : 0;
  // contact moves these
  for (size_t m = 0; m < reached_.size(); ++m)
    for (size_t k = 0, at = reached_[m]; k < 3; ++k, ++at)
      if (p_.moves(at)) p_.f[at] = force_of(at, before_[3 * m + k], now);
  return true;
}

double ExplicitPoints::force_of(size_t at, double free, const SubStep &now) const {
  const double m = p_.mass[at / kStride];
  return (free - p_.v[at]) * (m / now.h) - m * now.gravity[int(at % kStride)];
}

bool ExplicitPoints::free_motion(const SubStep &now, double &kinetic) {
  kinetic = moved_ ? std::accumulate(part_kinetic_.begin(), part_kinetic_.end(), 0.0)
                   : predict(loops_, p_, now.gravity, now.h);
  ways_known_ = true;
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
  in_place_ = ways_known_ && (!touched || surface_.identity());
  if (!in_place_) {
    find_end(loops_, p_, touched, now.h);
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

void ExplicitPoints::commit(const SubStep &now, double fraction) {
  if (fraction < 1) shorten(p_, end().mean, now.h * fraction);
  p_.x.swap(p_.x_end);
  p_.v.swap(in_place_ ? p_.v_free : p_.v_end);
  model_.commit_state();
}

// K v = (f(x - e v) - f(x + e v)) / 2 e, v the velocity less the rigid motion: that strains nothing, but in a
// strained body it would seem to. f, x_end and v_end are free until the next sub-step.
void ExplicitPoints::damp(double time, double c, double ahead) {
  const auto place = [&](uint32_t i) { return load3(&p_.x[size_t(i) * kStride]); };
  const bool held = std::any_of(p_.held.begin(), p_.held.end(), [](uint8_t bits) { return bits != 0; });
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
    store3(&p_.v[at], load3(&p_.v[at]) + (load3(&change[at]) - turn.at(place(i))));
  }
}

}  // namespace dfm
