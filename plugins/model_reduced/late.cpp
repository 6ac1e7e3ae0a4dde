// A held body whose state determines its points: q, q' and what follows at rest. A step then needs and moves
// the points that a surfel depends on or that are held, O(surface x modes), and with contact one column of
// C_rest at those points for each component that is pushed. All other points are computed on demand: the same
// sums over the whole matrix of modes, and over all columns that have not decayed.
//
// This applies while held points do not move and forces are a uniform acceleration; otherwise all points are
// moved, as in step.cpp.
#include <algorithm>
#include <cmath>
#include <vector>

#include "body.h"
#include "small.h"

namespace reduced {
namespace {

// Far below what any sum that they are part of can show; smaller numbers would become denormal as they decay.
constexpr double kNothing = 1e-60, kNothingAtRest = 1e-30;
constexpr size_t kWidest = 4096;                // numbers of a slot of state
constexpr size_t kSweep = 16, kMinEdges = 256;  // steps that look at all edges; edges in each at least
constexpr double kEdgesSeeAtLeast = 0.25;       // of the gradient of a cell, as they lie
constexpr double kAnotherLook = 1.25;           // times what the edges said at the last look

double kept(double a, double nothing) { return std::fabs(a) > nothing ? a : 0; }

}  // namespace

void Body::look(double *state) { state[kLead] = double(Lead::points_for_now); }

// Order of the points: the near ones first. And the shape of the modes at these.
void Body::take_near(const dfm_mesh &m) {
  std::vector<uint8_t> near(elastic_.npoint), leads(elastic_.npoint);
  for (uint32_t i = 0; i < elastic_.npoint; ++i) {
    leads[i] = elastic_.leads(i);
    near[i] = elastic_.floating && leads[i];
  }
  for (uint32_t e = 0; e < (nsurfel_ ? row_[nsurfel_] : 0); ++e) near[col_[e]] = 1;
  for (uint32_t i = 0; i < elastic_.npoint; ++i) near[i] = near[i] || elastic_.held[i];
  place_.create(host, elastic_.npoint);
  point_.create(host, elastic_.npoint);
  uint32_t next = 0;
  const auto take = [&](const std::vector<uint8_t> &these, bool whole) {
    for (uint32_t i = 0; i < elastic_.npoint; ++i)
      if (place_[i] == UINT32_MAX && these[i] && (elastic_.held[i] == 7) == whole) {
        point_[next] = i;
        place_[i] = next++;
      }
    return next;
  };
  std::fill(place_.data(), place_.data() + elastic_.npoint, UINT32_MAX);
  nfree_ = take(near, false);
  nnear_ = take(near, true);
  nlead_ = take(leads, false);
  near.assign(near.size(), 1);
  take(near, false);
  if (!can_be_late()) return;
  nstate_ = condensed_ ? at_impulse() + 3 * size_t(nsurfel_) : at_pull();
  const size_t nslot = (nstate_ + kWidest - 1) / kWidest;
  slot_.create(host, nslot);
  for (size_t n = 0; n < nslot; ++n)
    slot_[n] = {DFM_PER_INSTANCE, uint32_t(std::min(kWidest, nstate_ - kWidest * n)), DFM_SLOT_SCALAR, 0};
  slots_ = {sizeof(dfm_slots), uint32_t(nslot), slot_.data(), sizeof(dfm_slot), 0};
  const size_t rows = 3 * size_t(nnear_), padded = Basis::padded(rows);
  near_shape_.create(host, elastic_.kernels, rows, modes_.count);
  std::vector<double> w(padded, 0.0);
  for (uint32_t k = 0; k < modes_.count; ++k) {
    for (size_t j = 0; j < rows; ++j) w[j] = modes_.shape.at(3 * size_t(point_[j / 3]) + j % 3, k);
    near_shape_.set(k, w.data());
  }
  for (Buffer<double> *b : {&near_x_, &near_v_, &near_change_, &near_rest_, &near_given_, &end_x_, &end_v_})
    b->create(host, padded);
  holders_.create(host, 3 * elastic_.holders.size());
  for (size_t j = 0; j < size(); ++j) rest_moment_[j % 3] += elastic_.mass[j / 3] * elastic_.rest[j];
  near_force_.create(host, 3 * size_t(nfree_));
  near_edge_.create(host, 2 * size_t(m.nedge));
  for (size_t e = 0; e < m.nedge; ++e) {
    const uint32_t i = place_[m.edges[2 * e]], j = place_[m.edges[2 * e + 1]];
    if (i >= nnear_ || j >= nnear_) continue;
    near_edge_[2 * near_edges_] = i;
    near_edge_[2 * near_edges_++ + 1] = j;
  }
}

bool Body::stays_near(const dfm_kin &k, const double *f) {
  bool same = holders_known_;
  for (size_t n = 0; n < elastic_.holders.size(); ++n) {
    const size_t i = elastic_.holders[n], at = i * k.stride;
    for (size_t a = 0; a < 3; ++a) {
      if (elastic_.held[i] >> a & 1 && k.v[at + a] != 0) return false;
      same = same && holders_[3 * n + a] == k.x[at + a];
    }
  }
  if (!same) {
    holders_frame_ = frame_of(k.x, k.stride, nullptr, 0);
    holders_known_ = !held_displacement(k, holders_frame_, 0, mu_.data());
    if (!holders_known_) return false;
    for (size_t n = 0; n < elastic_.holders.size(); ++n)
      for (size_t a = 0; a < 3; ++a) holders_[3 * n + a] = k.x[size_t(elastic_.holders[n]) * k.stride + a];
  }
  double pull[3];
  even_ = uniform(k, f, pull);
  if (!even_) return false;
  to_ = at_ = holders_frame_;
  transposed_product(at_.r, pull, pull_of_);
  return true;
}

dfm_status Body::predict_near(const dfm_kin &k, double *u_s) {
  const size_t count = modes_.count, rows = 3 * size_t(nnear_);
  const double *const q = k.state + kCoordinates;
  std::copy(q, q + count, q_.data());
  std::copy(q + count, q + 2 * count, qd_.data());
  for (size_t n = 0; n < count; ++n) {
    const double *const p = pull_.data() + 3 * n;
    load_[n] = (p[0] * pull_of_[0] + p[1] * pull_of_[1]) + p[2] * pull_of_[2];
  }
  moving_ = led_ = false;
  rest_is_known_ = true;
  advance_coordinates();
  const double *const in[] = {q_to_.data(), qd_to_.data()};
  double *const out[] = {near_x_.data(), near_v_.data()};
  near_shape_.expand(2, in, out);
  if (condensed_) {
    const double *const before = k.state + at_near();
    for (size_t j = 0; j < rows; ++j) {
      const double *const w = weight_at_rest_.data() + 3 * size_t(point_[j / 3]) + j % 3;
      const double led = (pull_of_[0] * w[0] + pull_of_[1] * w[size()]) + pull_of_[2] * w[2 * size()];
      near_rest_[j] = left_ * before[j] + (1 - left_) * led;
      near_x_[j] += near_rest_[j];
    }
  }
  double nan_flag = 0;
  for (size_t n = 0; n < nnear_; ++n) {
    const size_t i = point_[n];
    double r[3];
    for (size_t a = 0; a < 3; ++a) r[a] = elastic_.rest[3 * i + a] + near_x_[3 * n + a];
    product(to_.r, r, end_x_.data() + 3 * n);
    product(to_.r, near_v_.data() + 3 * n, end_v_.data() + 3 * n);
    for (size_t a = 0; a < 3; ++a) {
      end_x_[3 * n + a] += to_.c[a];
      if (!(elastic_.held[i] >> a & 1)) continue;
      end_v_[3 * n + a] = 0;
      end_x_[3 * n + a] = k.x[i * k.stride + a];
    }
  }
  for (uint32_t s = 0; s < nsurfel_; ++s)
    for (size_t a = 0; a < 3; ++a) {
      double way = 0;
      for (uint32_t e = row_[s]; e < row_[s + 1]; ++e)
        way += weight_[e] * (end_x_[3 * size_t(place_[col_[e]]) + a] - k.x[size_t(col_[e]) * k.stride + a]);
      u_s[3 * size_t(s) + a] = way / h_;
      nan_flag += 0 * way;
    }
  return nan_flag == 0 ? DFM_OK : DFM_DISCARD;
}

void Body::commit_near(const dfm_kin &k, const double *p_s, double *x, double *v) {
  if (!near_only_) {
    const bool touched = commit_all(k, p_s, x, v);
    if (touched && condensed_)
      for (size_t j = 0; j < 3 * size_t(nnear_); ++j)
        near_given_[j] = rest_[3 * size_t(point_[j / 3]) + j % 3];
    return end_state(k, p_s, touched, rest_is_known_ ? Lead::state : Lead::points_for_now);
  }
  const bool touched = std::any_of(p_s, p_s + 3 * size_t(nsurfel_), [](double p) { return p != 0; });
  const size_t rows = 3 * size_t(nnear_);
  if (touched) {
    double sum[3] = {}, moment[3] = {};
    take_impulses(k, p_s, sum, moment);
    const double *const in[] = {modal_.data()};
    double *const out[] = {near_change_.data()};
    near_shape_.expand(1, in, out);
    std::fill(near_given_.data(), near_given_.data() + rows, 0.0);
    if (condensed_) add_near_response(p_s);
  }
  for (size_t n = 0; n < nnear_; ++n) {
    const size_t i = point_[n];
    double change[3] = {}, at_rest[3] = {};
    double *const xi = x + i * k.stride, *const vi = v + i * k.stride;
    if (touched) {
      product(at_.r, near_change_.data() + 3 * n, change);
      if (condensed_) product(at_.r, near_given_.data() + 3 * n, at_rest);
    }
    for (size_t a = 0; a < 3; ++a) {
      xi[a] = end_x_[3 * n + a] + h_ * (change[a] + at_rest[a]);
      vi[a] = end_v_[3 * n + a] + change[a];
    }
    for (size_t a = 3; a < k.stride; ++a) xi[a] = vi[a] = 0;
  }
  end_state(k, p_s, touched, Lead::state);
  watch_near(k, touched);
}

void Body::end_state(const dfm_kin &k, const double *p_s, bool touched, Lead lead) {
  double *const out = k.state_out;
  if (!out) return;
  out[kTouched] = touched;
  if (elastic_.floating) return;
  out[kLead] = double(lead);
  if (lead == Lead::points) return std::fill(out + kCoordinates, out + nstate_, 0.0);
  const size_t count = modes_.count;
  for (size_t n = 0; n < count; ++n) {
    const double change = touched ? modal_[n] : 0;
    out[kCoordinates + n] = kept(q_to_[n] + h_ * change, kNothing);
    out[kCoordinates + count + n] = kept(qd_to_[n] + change, kNothing);
  }
  if (!condensed_) return;
  for (size_t a = 0; a < 3; ++a)
    out[at_pull() + a] = left_ * k.state[at_pull() + a] + (even_ ? (1 - left_) * pull_of_[a] : 0);
  const double *const before = k.state + at_near();
  for (size_t j = 0; j < 3 * size_t(nnear_); ++j) {
    double now = near_rest_[j];
    if (!near_only_) {
      const double *const w = weight_at_rest_.data() + 3 * size_t(point_[j / 3]) + j % 3;
      now = left_ * before[j];
      if (even_)
        now += (1 - left_) * ((pull_of_[0] * w[0] + pull_of_[1] * w[size()]) + pull_of_[2] * w[2 * size()]);
    }
    out[at_near() + j] = kept(touched ? now + h_ * near_given_[j] : now, kNothingAtRest);
  }
  const double *const decayed = k.state + at_impulse();
  double *const force = out + at_impulse();
  for (size_t j = 0; j < 3 * size_t(nsurfel_); ++j)
    force[j] = decayed[j] == 0 ? 0 : kept(left_ * decayed[j], kNothingAtRest);
  for (uint32_t s = 0; touched && s < nsurfel_; ++s) {
    double local[3];
    transposed_product(at_.r, p_s + 3 * size_t(s), local);
    for (size_t a = 0; a < 3; ++a) force[3 * size_t(s) + a] += (1 - left_) / h_ * local[a];
  }
}

// u, w [padded 3 npoint] of the state, in the frame; w may be null.
void Body::displacement_of(const double *state, double *u, double *w) {
  const double *const in[] = {state + kCoordinates, state + kCoordinates + modes_.count};
  double *const out[] = {u, w};
  modes_.shape.expand(w ? 2 : 1, in, out);
  if (condensed_) add_rest_of(state, u);
}

// Adds what the modes leave out of what the forces of the state call for at rest: one sparse solve.
void Body::add_rest_of(const double *state, double *u) {
  double *const f = f_.data();
  const double *const force = state + at_impulse();
  const bool pushed = std::any_of(force, force + 3 * size_t(nsurfel_), [](double a) { return a != 0; });
  std::fill(f, f + size(), 0.0);
  for (uint32_t s = 0; pushed && s < nsurfel_; ++s)
    for (uint32_t e = row_[s]; e < row_[s + 1]; ++e)
      for (size_t a = 0; a < 3; ++a) f[3 * size_t(col_[e]) + a] += weight_[e] * force[3 * size_t(s) + a];
  const double *const in[] = {f};
  double *const out[] = {modal_.data()};
  if (pushed) {
    modes_.shape.project(1, in, out);
    rest_under(f, modal_.data(), mu_.data());
  }
  for (size_t j = 0; j < size(); ++j) {
    if (pushed) u[j] += mu_[j];
    for (size_t a = 0; a < 3; ++a) u[j] += state[at_pull() + a] * weight_at_rest_[a * size() + j];
  }
}

void Body::points(const dfm_kin &k, double *x, double *v) {
  if (k.state[kLead] != double(Lead::state)) return;
  displacement_of(k.state, u_.data(), w_.data());
  look_at_cells();
  const Frame at = frame_of(k.x, k.stride, nullptr, 0);
  for (size_t n = nnear_; n < elastic_.npoint; ++n) {
    const size_t i = point_[n];
    double r[3];
    for (size_t a = 0; a < 3; ++a) r[a] = elastic_.rest[3 * i + a] + u_[3 * i + a];
    product(at.r, r, x + i * k.stride);
    product(at.r, w_.data() + 3 * i, v + i * k.stride);
    for (size_t a = 0; a < 3; ++a) x[i * k.stride + a] += at.c[a];
    for (size_t a = 3; a < k.stride; ++a) x[i * k.stride + a] = v[i * k.stride + a] = 0;
  }
}

// Energies by coordinates: modes are orthonormal by mass, and what they leave out, r = C_rest g of the forces
// and weights g, is orthogonal to them by K, and C_rest K C_rest = C_rest: its elastic energy is g.r / 2. It
// has no velocity.
bool Body::sums(const dfm_kin &k, double *out) const {
  if (k.state[kLead] != double(Lead::state)) return false;
  const size_t count = modes_.count;
  const double *const q = k.state + kCoordinates, *const rate = q + count;
  double kinetic = 0, elastic = 0, first[3] = {}, beside[3] = {}, turned[3];
  for (size_t n = 0; n < count; ++n) {
    kinetic += rate[n] * rate[n];
    elastic += modes_.lambda[n] * q[n] * q[n];
    for (size_t a = 0; a < 3; ++a) first[a] += pull_[3 * n + a] * q[n];
  }
  if (condensed_) {
    const double *const pull = k.state + at_pull();
    for (size_t s = 0; s < nsurfel_; ++s) {
      const double *const f = k.state + at_impulse() + 3 * s;
      if (f[0] == 0 && f[1] == 0 && f[2] == 0) continue;
      for (uint32_t e = row_[s]; e < row_[s + 1]; ++e)
        for (size_t a = 0; a < 3; ++a) {
          const size_t j = 3 * size_t(col_[e]) + a;
          elastic += weight_[e] * f[a] * k.state[at_near() + 3 * size_t(place_[col_[e]]) + a];
          for (size_t b = 0; b < 3; ++b) beside[b] += weight_[e] * f[a] * weight_at_rest_[b * size() + j];
        }
    }
    for (size_t b = 0; b < 3; ++b) {
      for (size_t c = 0; c < 3; ++c) beside[b] += weight_of_weight_[3 * b + c] * pull[c];
      elastic += pull[b] * beside[b];
      first[b] += beside[b];
    }
  }
  out[0] = 0.5 * kinetic;
  out[1] = 0.5 * elastic;
  const Frame at = frame_of(k.x, k.stride, nullptr, 0);
  for (size_t a = 0; a < 3; ++a) first[a] += rest_moment_[a];
  product(at.r, first, turned);
  for (size_t a = 0; a < 3; ++a) out[2 + a] = elastic_.total * at.c[a] + turned[a];
  return true;
}

// The step needs all points, and k has the near ones alone.
void Body::all_points(const dfm_kin &k, dfm_kin &all) {
  const size_t numbers = size_t(k.stride) * elastic_.npoint;
  if (now_stride_ != k.stride) {
    now_x_.create(host, numbers);
    now_v_.create(host, numbers);
    now_stride_ = k.stride;
  }
  std::copy(k.x, k.x + numbers, now_x_.data());
  std::copy(k.v, k.v + numbers, now_v_.data());
  points(k, now_x_.data(), now_v_.data());
  all = k;
  all.x = now_x_.data();
  all.v = now_v_.data();
}

// Is what the modes leave out of the displacements what the state says? After keep_rest().
bool Body::holds_rest(const double *state) {
  if (!condensed_) return !beside_;
  std::fill(u_to_.data(), u_to_.data() + size(), 0.0);
  add_rest_of(state, u_to_.data());
  double square = 0;
  for (size_t j = 0; j < size(); ++j) {
    const double other = rest_[j] - u_to_[j];
    square += elastic_.mass[j / 3] * (other * other);
  }
  const double small = 1e-12 * elastic_.extent;
  return square <= elastic_.total * small * small;
}

// What an edge of the surface stretches and turns is at most the displacement gradient of the cells that
// it belongs to. Some edges are checked in each step, all of them in kSweep steps, and all cells when
// points are requested.
void Body::watch_near(const dfm_kin &k, bool touched) {
  near_time_ = k.t;
  if (k.t - outside_ > kForgotten + kSweep * k.dt) reported_ = looked_ = 0;
  const size_t many = std::min(near_edges_, near_edges_ / kSweep + kMinEdges);
  const auto end = [&](uint32_t place, size_t a) {
    const size_t j = 3 * size_t(place) + a;
    if (!touched) return near_x_[j];
    return near_x_[j] + h_ * (condensed_ ? near_change_[j] + near_given_[j] : near_change_[j]);
  };
  double most = 0;
  uint32_t which = 0;
  for (size_t n = 0; n < many; ++n) {
    const uint32_t *const edge = near_edge_.data() + 2 * next_edge_;
    const uint32_t i = point_[edge[0]], j = point_[edge[1]];
    double along = 0, length = 0;
    for (size_t a = 0; a < 3; ++a) {
      const double u = end(edge[1], a) - end(edge[0], a);
      const double x = elastic_.rest[3 * size_t(j) + a] - elastic_.rest[3 * size_t(i) + a];
      along += u * u;
      length += x * x;
    }
    if (along > most * length) {
      most = along / length;
      which = i;
    }
    if (++next_edge_ < near_edges_) continue;
    next_edge_ = 0;
    near_most_ = std::max(sweep_most_, std::sqrt(most));
    sweep_most_ = 0;
  }
  most = std::sqrt(most);
  sweep_most_ = std::max(sweep_most_, most);
  warn_gradient(k.t, most, "along an edge of point", which);
}

// Looks at the cells of the displacement u_, where the edges say that it may be worth it.
void Body::look_at_cells() {
  const double most_of_edges = std::max(near_most_, sweep_most_);
  if (kEdgesSeeAtLeast * kLargestGradient > most_of_edges || most_of_edges <= kAnotherLook * looked_) return;
  looked_ = most_of_edges;
  uint32_t cell = 0;
  const double most = elastic_.largest_gradient(u_.data(), &cell);
  warn_gradient(near_time_, most, "in cell", cell);
}

}  // namespace reduced
