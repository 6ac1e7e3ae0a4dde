#include "gpu_body.h"

#include <atomic>
#include <cmath>
#include <string>

#include "cells.h"
#include "springs.h"

namespace gpu {
namespace {

constexpr double kMaxSteps = 1e6;
constexpr double kRounding = 1e-6;  // rates of the kernels are binary32
constexpr double kShare = 0.9;      // of a sub-step that is stable, where shapes change it on the way
constexpr double kStrain = 1e-5;    // whose energy is that of a small one
// Dampers with a lag are at most so stiff, relative to what is beside them; a mode at the own frequency
// loses so much of its damping, and is so much faster, at most.
constexpr double kStiffening = 3, kError = 0.02;

}  // namespace

template <class Of>
void Body<Of>::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  if (!Of::valid(h, m.params)) throw model::Refused{};
  npoint_ = m.npoint;
  inverse_mass_.create(h, npoint_);
  held_.create(h, npoint_);
  for (uint32_t i = 0; i < npoint_; ++i) {
    inverse_mass_[i] = 1 / m.mass[i];
    if (m.fixed) held_[i] = m.fixed[i];
  }
  parts_.create(h, m);
  rest_.create_copy(h, m.rest, 3 * size_t(npoint_));
  take_surface(m);
  const Choice choice = Choice(uint32_t(m.params[Of::kDevice]));
  if (choice == kReference) stepper_ = std::make_unique<Reference>(h, npoint_);
  else stepper_ = open_stepper(h, Of::kId, choice, npoint_);
  for (uint32_t i = 0; i < npoint_; ++i) {
    // neither is what a host gives, so the first step takes all of them
    stepper_->place[i] = {NAN, 0, 0, inverse_mass_[i]};
    stepper_->load[i].w = NAN;
    stepper_->speed[i].w = held_[i];
  }
  apply_params(m.params);
}

template <class Of>
void Body<Of>::take_surface(const dfm_mesh &m) {
  nsurfel_ = m.nsurfel;
  const uint32_t entries = nsurfel_ ? m.row[nsurfel_] : 0;
  surfel_row_.create_copy(host, m.row, nsurfel_ ? size_t(nsurfel_) + 1 : 0);
  surfel_point_.create_copy(host, m.col, entries);
  surfel_weight_.create_copy(host, m.weight, entries);
  impulse_.create(host, 3 * size_t(npoint_));
}

template <class Of>
void Body<Of>::apply_params(const double *values) {
  const auto take = [&] {
    parts_.fill(params_);
    block_energy_.create(host, parts_.energies() / kGrain + 1);
    stepper_->take(parts_.work());
    find_lag();
  };
  unlike_ = true;
  try {
    try {
      model::try_params(params_, values, take);
    } catch (...) {
      if (facts_[0].key) take();  // a body that is there keeps its old values
      throw;
    }
  } catch (const std::string &why) {
    model::refuse(host, Of::kId, "%s", why.c_str());
  } catch (const char *why) {
    model::refuse(host, Of::kId, "%s", why);
  }
  facts_[0] = {"longest_step",
               parts_.drawn ? "sub-step that is stable near rest; where cells are drawn far, shorter"
                            : "sub-step that is stable in every shape",
               "s", share() * parts_.longest};
  facts_[1] = Of::kCount;
  facts_[1].value = double(parts_.count());
  facts_[2] = {"on_processor", stepper_->device(), "1", stepper_->on_processor() ? 1.0 : 0.0};
}

template <class Of>
double Body<Of>::share() const {
  return parts_.drawn ? kShare : 1;
}

template <class Of>
double Body<Of>::longest() {
  double least = HUGE_VAL;
  for (uint32_t i = 0; i < npoint_; ++i) {
    if (held_[i] == 7) continue;
    const double m = parts_.mass[i], k = parts_.stiff(i), c = parts_.damper(i);
    const double most = c + std::sqrt(c * c + 4 * m * k);
    if (!(4 * m < most * least)) continue;
    least = 4 * m / most;
    parts_.worst = i;
  }
  return least;
}

// 1/s: the slowest motion in which the body strains the same everywhere, by Rayleigh's quotient.
template <class Of>
double Body<Of>::own_frequency() {
  Buffer<double> x;
  x.create(host, 3 * size_t(npoint_));
  double middle[3] = {}, mass = 0, slowest = HUGE_VAL;
  for (size_t i = 0; i < npoint_; ++i) {
    mass += parts_.mass[i];
    for (size_t a = 0; a < 3; ++a) middle[a] += parts_.mass[i] * rest_[3 * i + a];
  }
  for (double &of : middle) of /= mass;
  dfm_kin k{};
  k.size = sizeof k;
  k.stride = 3;
  k.x = x.data();
  for (size_t row = 0; row < 3; ++row)
    for (size_t col = 0; col <= row; ++col) {
      double moved = 0;
      for (size_t i = 0; i < npoint_; ++i) {
        double u[3] = {};
        u[row] += kStrain * (rest_[3 * i + col] - middle[col]);
        if (col != row) u[col] += kStrain * (rest_[3 * i + row] - middle[row]);
        for (size_t a = 0; a < 3; ++a) x[3 * i + a] = rest_[3 * i + a] + u[a];
        moved += parts_.mass[i] * ((u[0] * u[0] + u[1] * u[1]) + u[2] * u[2]);
      }
      const double work = 2 * energy(k);
      if (work > 0 && moved > 0) slowest = std::min(slowest, work / moved);
    }
  return std::sqrt(slowest);
}

// The estimate is of first order (doc/models/msm_gpu.md), where that of the library is of the second
// (doc/concepts/step.md).
template <class Of>
void Body<Of>::find_lag() {
  parts_.lag = 0;
  parts_.longest = longest();
  const double ratio = parts_.damping;
  if (ratio > 0) {
    const double w = own_frequency();
    parts_.lag = std::min({ratio / kStiffening, std::sqrt(kError) / w, 2 * kError / (ratio * w * w)});
    if (!(longest() > parts_.longest)) parts_.lag = 0;
    parts_.longest = longest();
  }
  dampers_ = {float(ratio), parts_.lag > 0 ? float(1 / parts_.lag) : 0, parts_.branches.part,
              parts_.branches.time};
}

template <class Of>
void Body<Of>::begin(double *state) const {
  std::fill(state, state + parts_.of_stretch(parts_.branches.n), 0.0);
  if (has_branch()) state[parts_.of_stretch(parts_.branches.n)] = 1;
}

// After a step the kernel has found the sub-step that no point asks to be shorter; as dampers, points ask for
// that and leave room to what else acts on them. The worst point at rest is named.
template <class Of>
void Body<Of>::bound(const dfm_kin &k, double *ksum, double *csum) {
  constexpr double kOthers = 1 - 1e-6;
  if (const double last = k.state[parts_.of_longest()]; parts_.drawn && last > 0) {
    const double stable = std::min(last, parts_.longest);  // parameters may have changed since
    for (uint32_t i = 0; i < npoint_; ++i)
      csum[i] += (i == parts_.worst ? 1 : kOthers) * (2 * parts_.mass[i] / stable);
    return;
  }
  for (uint32_t i = 0; i < npoint_; ++i) {
    ksum[i] += parts_.stiff(i);
    csum[i] += parts_.damper(i);
  }
  if (parts_.drawn) parts_.add_growth(k, ksum, csum);
}

template <class Of>
bool Body<Of>::take_points(const dfm_kin &k) {
  std::atomic<bool> moved = false;
  const bool lagged = dampers_.per_lag > 0, begun = k.state[parts_.of_longest()] > 0;
  const auto differ = [](double &to, double from) {
    const bool differs = std::bit_cast<uint64_t>(to) != std::bit_cast<uint64_t>(from);
    to = from;
    return differs;
  };
  each_point([&](size_t i) {
    bool changed = false;
    const auto put = [&](double &to, double from) { changed |= differ(to, from); };
    const double *const x = k.x + i * k.stride, *const v = k.v + i * k.stride;
    dvec4 &place = stepper_->place[i], &speed = stepper_->speed[i];
    put(place.x, x[0]);
    put(place.y, x[1]);
    put(place.z, x[2]);
    put(speed.x, v[0]);
    put(speed.y, v[1]);
    put(speed.z, v[2]);
    if (lagged) {
      const double *const u = begun ? k.state + 3 * i : v;
      put(stepper_->seen[i].x, u[0]);
      put(stepper_->seen[i].y, u[1]);
      put(stepper_->seen[i].z, u[2]);
    }
    if (changed) moved.store(true, std::memory_order_relaxed);
  });
  const Branches &of = parts_.branches;
  for (size_t s = 0; s < of.room; ++s)
    if (of.edge_of[s] != ~0u && differ(stepper_->stretch[s], k.state[parts_.of_stretch(of.edge_of[s])]))
      moved = true;
  return moved;
}

template <class Of>
bool Body<Of>::take_loads(const double *f, uint32_t stride) {
  std::atomic<bool> changed = false;
  each_point([&](size_t i) {
    const double *const of = f + i * stride, per = inverse_mass_[i];
    const dvec4 now{of[0] * per, of[1] * per, of[2] * per, parts_.drag_of(i)};
    dvec4 &load = stepper_->load[i];
    if (now.x == load.x && now.y == load.y && now.z == load.z && now.w == load.w) return;
    load = now;
    changed.store(true, std::memory_order_relaxed);
  });
  return changed;
}

template <class Of>
dfm_status Body<Of>::predict(const dfm_kin &k, const double *f, double *u_s) {
  double stable = parts_.longest;
  if (const double last = k.state[parts_.of_longest()]; last > 0) stable = std::min(stable, last);
  h_ = k.dt;
  if (has_branch()) dampers_.was = k.state[parts_.of_stretch(parts_.branches.n)];
  for (;;) {
    // a step that is stable as a whole, as those in contact are, is not divided
    const double all = k.dt / stable - kRounding,
                 steps = all <= 1 ? 1 : std::ceil(k.dt / (share() * stable) - kRounding);
    if (!(steps <= kMaxSteps)) {
      model::say(host, 3, Of::kId,
                 "a step of %g s needs %.3g sub-steps of %.3g s; soften or coarsen the body, lower its "
                 "damping, or take a shorter step",
                 k.dt, steps, k.dt / steps);
      return DFM_DISCARD;
    }
    const bool moved = take_points(k) || unlike_, loaded = take_loads(f, k.stride) || unlike_;
    unlike_ = true;
    const uint32_t n = uint32_t(steps);
    part_ = k.dt / n;
    if (const char *why = stepper_->run(n, part_, dampers_, moved, loaded)) {
      model::complain(host, Of::kId, why);
      return DFM_E_FATAL;
    }
    unlike_ = false;
    const double highest = double(stepper_->highest());
    shape_ = highest > 0 ? std::min(1 / highest, parts_.longest) : parts_.longest;
    if (!(highest * part_ > 1 + kRounding)) break;
    stable = shape_;
  }
  for (uint32_t s = 0; s < nsurfel_; ++s) {
    double way[3] = {};
    for (uint32_t e = surfel_row_[s]; e < surfel_row_[s + 1]; ++e) {
      const uint32_t i = surfel_point_[e];
      const dvec4 &end = stepper_->place[i];
      const double *const x = k.x + size_t(i) * k.stride, weight = surfel_weight_[e];
      way[0] += weight * (end.x - x[0]);
      way[1] += weight * (end.y - x[1]);
      way[2] += weight * (end.z - x[2]);
    }
    for (size_t a = 0; a < 3; ++a) u_s[3 * size_t(s) + a] = way[a] / k.dt;
  }
  return DFM_OK;
}

// An impulse changes the velocity of its points, and moves them by that over the step: the scheme of one
// sub-step.
template <class Of>
void Body<Of>::respond(const dfm_kin &, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                       double *du) {
  for (; nrhs > 0; --nrhs, p += 3 * size_t(n), du += 3 * size_t(n)) {
    for (uint32_t k = 0; k < n; ++k)
      for (uint32_t e = surfel_row_[surfel[k]]; e < surfel_row_[surfel[k] + 1]; ++e)
        for (size_t a = 0; a < 3; ++a)
          impulse_[3 * size_t(surfel_point_[e]) + a] += surfel_weight_[e] * p[3 * size_t(k) + a];
    for (uint32_t k = 0; k < n; ++k)
      for (int a = 0; a < 3; ++a) {
        double sum = 0;
        for (uint32_t e = surfel_row_[surfel[k]]; e < surfel_row_[surfel[k] + 1]; ++e) {
          const uint32_t i = surfel_point_[e];
          sum += surfel_weight_[e] * (free_inverse_mass(i, a) * impulse_[3 * size_t(i) + size_t(a)]);
        }
        du[3 * size_t(k) + size_t(a)] = sum;
      }
    for (uint32_t k = 0; k < n; ++k)
      for (uint32_t e = surfel_row_[surfel[k]]; e < surfel_row_[surfel[k] + 1]; ++e)
        std::fill_n(&impulse_[3 * size_t(surfel_point_[e])], 3, 0.0);
  }
}

template <class Of>
void Body<Of>::diagonal(const dfm_kin &, uint32_t n, const uint32_t *surfel, double *w) const {
  std::fill_n(w, 9 * size_t(n), 0.0);
  for (uint32_t k = 0; k < n; ++k)
    for (uint32_t e = surfel_row_[surfel[k]]; e < surfel_row_[surfel[k] + 1]; ++e)
      for (int a = 0; a < 3; ++a)
        w[9 * size_t(k) + 4 * size_t(a)] +=
            surfel_weight_[e] * (free_inverse_mass(surfel_point_[e], a) * surfel_weight_[e]);
}

template <class Of>
void Body<Of>::commit(const dfm_kin &k, const double *p_s, double *x, double *v) {
  const bool lagged = dampers_.per_lag > 0;
  k.state_out[parts_.of_longest()] = shape_;
  const Branches &of = parts_.branches;
  for (size_t e = 0; e < of.n; ++e) k.state_out[parts_.of_stretch(e)] = stepper_->stretch[of.end_of[e]];
  if (of.n) k.state_out[parts_.of_stretch(of.n)] = dampers_.after(part_).was;
  each_point([&](size_t i) {
    const dvec4 &place = stepper_->place[i], &speed = stepper_->speed[i],
                &seen = lagged ? stepper_->seen[i] : speed;
    const double end[3] = {place.x, place.y, place.z}, fast[3] = {speed.x, speed.y, speed.z};
    double *const u = k.state_out + 3 * i;
    u[0] = seen.x;
    u[1] = seen.y;
    u[2] = seen.z;
    for (size_t a = 0; a < k.stride; ++a) {
      x[i * k.stride + a] = a < 3 ? end[a] : 0;
      v[i * k.stride + a] = a < 3 ? fast[a] : 0;
    }
  });
  const double sees = 1 - dampers_.kept(part_);  // of a change
  for (size_t s = 0; s < nsurfel_; ++s) {
    const double *const p = p_s + 3 * s;
    if (p[0] == 0 && p[1] == 0 && p[2] == 0) continue;
    for (uint32_t e = surfel_row_[s]; e < surfel_row_[s + 1]; ++e)
      for (size_t a = 0; a < 3; ++a) {
        const size_t at = size_t(surfel_point_[e]) * k.stride + a;
        const double change = free_inverse_mass(surfel_point_[e], int(a)) * (surfel_weight_[e] * p[a]);
        x[at] += h_ * change;
        v[at] += change;
        k.state_out[3 * size_t(surfel_point_[e]) + a] += sees * change;
      }
  }
}

// Sums of blocks of springs or cells, in the order of the blocks.
template <class Of>
double Body<Of>::energy(const dfm_kin &k) {
  const uint32_t count = parts_.energies();
  model::in_pieces(host, true, count, kGrain, [&](uint32_t begin, uint32_t end) {
    for (uint32_t at = begin; at < end; at += kGrain)
      block_energy_[at / kGrain] = parts_.energy(k, at, std::min(at + kGrain, end));
  });
  double sum = 0;
  for (uint32_t at = 0; at < count; at += kGrain) sum += block_energy_[at / kGrain];
  return sum;
}

template class Body<Springs>;
template class Body<Cells>;

}  // namespace gpu
