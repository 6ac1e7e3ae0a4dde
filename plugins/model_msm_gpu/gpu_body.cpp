#include "gpu_body.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "../model_common/edges.h"
#include "../model_common/params.h"
#include "../model_common/spring_directions.h"

namespace msm_gpu {
namespace {

// Edges whose products of squares stay far inside the range of a float.
constexpr double kShortestEdge = 1e-6, kLongestEdge = 1e4;
constexpr int kWeightSteps = 20;  // of the power method, as those of msm
constexpr double kMostSteps = 1e6;
constexpr uint32_t kGrain = 4096;  // points, springs: waking a worker costs more than fewer save

double square_between(const double *x, const double *y) {
  const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
  return (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
}

double volume_of(const double *x0, const double *x1, const double *x2, const double *x3) {
  const auto from = [&](const double *x, double *d) {
    for (int a = 0; a < 3; ++a) d[a] = x[a] - x0[a];
  };
  double a[3], b[3], c[3];
  from(x1, a);
  from(x2, b);
  from(x3, c);
  const double normal[3] = {b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]};
  return std::fabs((a[0] * normal[0] + a[1] * normal[1]) + a[2] * normal[2]) / 6;
}

}  // namespace

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  if (!model::in_range(h, kId, kParams, kParamCount, m.params)) throw model::Refused{};
  npoint_ = m.npoint;
  nedge_ = m.nedge;
  take_springs(m);
  take_surface(m);
  row_.create(h, npoint_);
  stiffness_.create(h, nedge_);
  const Choice choice = Choice(uint32_t(m.params[kDevice]));
  if (choice == kReference) stepper_ = std::make_unique<Reference>(h, npoint_);
  else stepper_ = open_stepper(h, choice, npoint_);
  for (uint32_t i = 0; i < npoint_; ++i) {
    // neither is what a host gives, so the first step takes all of them
    stepper_->place[i] = {NAN, 0, 0, inverse_mass_[i]};
    stepper_->load[i].w = NAN;
    stepper_->speed[i].w = held_[i];
  }
  apply_params(m.params);
}

// The stiffness of an edge is that of model msm without its volume term.
void Body::take_springs(const dfm_mesh &m) {
  edges_.create_copy(host, m.edges, 2 * size_t(nedge_));
  inverse_mass_.create(host, npoint_);
  held_.create(host, npoint_);
  for (uint32_t i = 0; i < npoint_; ++i) {
    inverse_mass_[i] = 1 / m.mass[i];
    if (m.fixed) held_[i] = m.fixed[i];
  }
  Buffer<double> field[kParamCount], length, volume, modulus;
  model::take_fields(host, kId, kParams, kParamCount, m, field, [](uint32_t, double) { return true; });
  by_cell_ = !field[kYoung].empty();
  rest_square_.create(host, nedge_);
  share_.create(host, nedge_);
  for (Buffer<double> *each : {&length, &volume, &modulus}) each->create(host, nedge_);
  for (uint32_t e = 0; e < nedge_; ++e) {
    rest_square_[e] = square_between(m.rest + 3 * size_t(edges_[2 * size_t(e)]),
                                     m.rest + 3 * size_t(edges_[2 * size_t(e) + 1]));
    length[e] = std::sqrt(rest_square_[e]);
    if (!(length[e] >= kShortestEdge && length[e] <= kLongestEdge))
      throw "edges of 1e-6 m to 1e4 m are expected; scale the mesh, or take the model msm";
  }
  Buffer<uint32_t> rows;
  rows.create(host, size_t(npoint_) + 1);
  model::find_rows(edges_.data(), nedge_, npoint_, rows.data());
  for (uint32_t c = 0; c < m.ncell; ++c) {
    const uint32_t *const q = m.cells + 4 * size_t(c);
    const auto at = [&](int a) { return m.rest + 3 * size_t(q[a]); };
    const double own = volume_of(at(0), at(1), at(2), at(3));
    uint32_t of_cell[6];
    model::find_edges_by_rows(edges_.data(), rows.data(), q, of_cell);
    for (const uint32_t e : of_cell) {
      volume[e] += own;
      share_[e] += by_cell_ ? own * field[kYoung][c] : own;
    }
  }
  model::find_directions(nedge_, edges_.data(), m.rest, length.data(), volume.data(), modulus.data());
  for (uint32_t e = 0; e < nedge_; ++e) share_[e] *= modulus[e];
  block_energy_.create(host, nedge_ / kGrain + 1);
  springs_.lay_out(host, npoint_, nedge_, edges_.data());
}

void Body::take_surface(const dfm_mesh &m) {
  nsurfel_ = m.nsurfel;
  const uint32_t entries = nsurfel_ ? m.row[nsurfel_] : 0;
  surfel_row_.create_copy(host, m.row, nsurfel_ ? size_t(nsurfel_) + 1 : 0);
  surfel_point_.create_copy(host, m.col, entries);
  surfel_weight_.create_copy(host, m.weight, entries);
  impulse_.create(host, 3 * size_t(npoint_));
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params_);
  for (uint32_t e = 0; e < nedge_; ++e) stiffness_[e] = by_cell_ ? share_[e] : params_[kYoung] * share_[e];
  springs_.fill(stiffness_.data(), rest_square_.data());
  try {
    stepper_->take(springs_);
  } catch (const std::string &why) {
    model::complain(host, kId, why.c_str());
    throw model::Refused{};
  }
  find_rows();
  const char **effect = active_effects;
  *effect++ = "large_rotation";
  if (params_[kDampingStiffness] > 0 || params_[kDampingMass] > 0) *effect++ = "damping";
  *effect = nullptr;
  facts_[0] = {"longest_step", "sub-step that is stable in every shape", "s", longest_};
  facts_[1] = {"springs", "springs, each read from both ends in a sub-step", "1", double(nedge_)};
}

// Row sums that hold in every shape: the derivative of a spring, k [(1 - s) n n^T + s I] with s = 1 - L0/L,
// is at most k in norm for s <= 1. So D_i = sum_j k_ij (1 + w_j / w_i) for any weights w > 0, and the step is
// stable if h^2 D + 2 h F <= 4 m, F = damping_stiffness D + damping_mass m (doc/models/msm.md, step bound).
// The weights are those of the power method: of all they allow the longest step.
void Body::find_rows() {
  Buffer<double> weight, next;
  weight.create(host, npoint_);
  next.create(host, npoint_);
  std::fill(weight.data(), weight.data() + npoint_, 1.0);
  const auto add = [&](double *out) {
    std::fill(out, out + npoint_, 0.0);
    for (uint32_t e = 0; e < nedge_; ++e) {
      const uint32_t i = edges_[2 * size_t(e)], j = edges_[2 * size_t(e) + 1];
      out[i] += stiffness_[e] * (weight[i] + weight[j]);
      out[j] += stiffness_[e] * (weight[i] + weight[j]);
    }
  };
  for (int step = 0; step < kWeightSteps; ++step) {
    add(next.data());
    double most = 0;
    for (uint32_t i = 0; i < npoint_; ++i) {
      next[i] *= inverse_mass_[i];
      most = std::max(most, next[i]);
    }
    // a point without springs keeps a weight
    for (uint32_t i = 0; most > 0 && i < npoint_; ++i) weight[i] = std::max(next[i] / most, 1e-3);
  }
  add(row_.data());
  longest_ = HUGE_VAL;
  for (uint32_t i = 0; i < npoint_; ++i) {
    row_[i] /= weight[i];
    const double m = 1 / inverse_mass_[i], k = row_[i];
    const double c = params_[kDampingStiffness] * k + params_[kDampingMass] * m;
    const double most = c + std::sqrt(c * c + 4 * m * k);
    if (most > 0) longest_ = std::min(longest_, 4 * m / most);
  }
}

void Body::bound(const dfm_kin &, double *ksum, double *csum) const {
  for (uint32_t i = 0; i < npoint_; ++i) {
    ksum[i] += row_[i];
    csum[i] += params_[kDampingStiffness] * row_[i] + params_[kDampingMass] / inverse_mass_[i];
  }
}

template <class F>
void Body::each_point(const F &f) const {
  const auto some = [](void *user, uint32_t begin, uint32_t end) {
    const F &each = *static_cast<const F *>(user);
    for (size_t i = begin; i < end; ++i) each(i);
  };
  host->parallel_for(host->ctx, npoint_, kGrain, some, const_cast<F *>(&f));
}

bool Body::take_points(const dfm_kin &k) {
  std::atomic<bool> moved = false;
  each_point([&](size_t i) {
    bool differ = false;
    const auto put = [&](double &to, double from) {
      differ |= std::bit_cast<uint64_t>(to) != std::bit_cast<uint64_t>(from);
      to = from;
    };
    const double *const x = k.x + i * k.stride, *const v = k.v + i * k.stride;
    dvec4 &place = stepper_->place[i], &speed = stepper_->speed[i];
    put(place.x, x[0]);
    put(place.y, x[1]);
    put(place.z, x[2]);
    put(speed.x, v[0]);
    put(speed.y, v[1]);
    put(speed.z, v[2]);
    if (differ) moved.store(true, std::memory_order_relaxed);
  });
  return moved;
}

bool Body::take_loads(const double *f, uint32_t stride) {
  std::atomic<bool> changed = false;
  each_point([&](size_t i) {
    const double *const of = f + i * stride, per = inverse_mass_[i];
    const dvec4 now{of[0] * per, of[1] * per, of[2] * per, params_[kDampingMass]};
    dvec4 &load = stepper_->load[i];
    if (now.x == load.x && now.y == load.y && now.z == load.z && now.w == load.w) return;
    load = now;
    changed.store(true, std::memory_order_relaxed);
  });
  return changed;
}

dfm_status Body::predict(const dfm_kin &k, const double *f, double *u_s) {
  const double steps = std::max(1.0, std::ceil(k.dt / longest_ - 1e-9));
  if (!(steps <= kMostSteps)) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "a step of %g s needs %.3g sub-steps of %.3g s; soften or coarsen the body, lower its "
                  "damping, or take a shorter step",
                  k.dt, steps, longest_);
    model::complain(host, kId, text);
    return DFM_DISCARD;
  }
  const uint32_t n = uint32_t(steps);
  h_ = k.dt;
  const bool moved = take_points(k), loaded = take_loads(f, k.stride);
  if (const char *why = stepper_->run(n, k.dt / n, float(params_[kDampingStiffness]), moved, loaded)) {
    model::complain(host, kId, why);
    return DFM_E_FATAL;
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
void Body::respond(uint32_t n, const uint32_t *surfel, const double *p, double *du) {
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

void Body::diagonal(uint32_t n, const uint32_t *surfel, double *w) const {
  std::fill_n(w, 9 * size_t(n), 0.0);
  for (uint32_t k = 0; k < n; ++k)
    for (uint32_t e = surfel_row_[surfel[k]]; e < surfel_row_[surfel[k] + 1]; ++e)
      for (int a = 0; a < 3; ++a)
        w[9 * size_t(k) + 4 * size_t(a)] +=
            surfel_weight_[e] * (free_inverse_mass(surfel_point_[e], a) * surfel_weight_[e]);
}

void Body::commit(const dfm_kin &k, const double *p_s, double *x, double *v) {
  each_point([&](size_t i) {
    const dvec4 &place = stepper_->place[i], &speed = stepper_->speed[i];
    const double end[3] = {place.x, place.y, place.z}, fast[3] = {speed.x, speed.y, speed.z};
    for (size_t a = 0; a < k.stride; ++a) {
      x[i * k.stride + a] = a < 3 ? end[a] : 0;
      v[i * k.stride + a] = a < 3 ? fast[a] : 0;
    }
  });
  for (size_t s = 0; s < nsurfel_; ++s) {
    const double *const p = p_s + 3 * s;
    if (p[0] == 0 && p[1] == 0 && p[2] == 0) continue;
    for (uint32_t e = surfel_row_[s]; e < surfel_row_[s + 1]; ++e)
      for (size_t a = 0; a < 3; ++a) {
        const size_t at = size_t(surfel_point_[e]) * k.stride + a;
        const double change = free_inverse_mass(surfel_point_[e], int(a)) * (surfel_weight_[e] * p[a]);
        x[at] += h_ * change;
        v[at] += change;
      }
  }
}

// Sums of blocks of springs, in the order of the blocks.
double Body::energy(const dfm_kin &k) {
  struct Call {
    Body *body;
    const dfm_kin *k;
  } call{this, &k};
  const auto blocks = [](void *user, uint32_t begin, uint32_t end) {
    const Call &of = *static_cast<const Call *>(user);
    for (uint32_t at = begin; at < end; at += kGrain)
      of.body->block_energy_[at / kGrain] = of.body->energy_of(*of.k, at, std::min(at + kGrain, end));
  };
  host->parallel_for(host->ctx, nedge_, kGrain, blocks, &call);
  double sum = 0;
  for (uint32_t at = 0; at < nedge_; at += kGrain) sum += block_energy_[at / kGrain];
  return sum;
}

double Body::energy_of(const dfm_kin &k, uint32_t begin, uint32_t end) const {
  double sum = 0;
  for (size_t e = begin; e < end; ++e) {
    const double square =
        square_between(k.x + size_t(edges_[2 * e]) * k.stride, k.x + size_t(edges_[2 * e + 1]) * k.stride);
    const double stretch = std::sqrt(square) - std::sqrt(rest_square_[e]);
    sum += 0.5 * stiffness_[e] * (stretch * stretch);
  }
  return sum;
}

}  // namespace msm_gpu
