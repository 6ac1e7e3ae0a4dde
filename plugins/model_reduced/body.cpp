// Set-up: modes, their integrals, memory. Also output for pictures.
#include "body.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "../model_common/entry.h"
#include "small.h"

namespace reduced {

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  if (!model::in_range(h, id_, kParams, kParamCount, m.params)) throw model::Refused{};
  if (condensed_) check_size(m.nsurfel, by_surface_ ? m.nsurfel : m.npoint);
  elastic_.create(h, id_, m, by_surface_);
  modes_.create(h, id_, m, elastic_, m.params);
  take_surface(m);
  take_near(m);
  take_integrals();
  reserve();
  if (condensed_ && can_be_late()) {
    find_weight_at_rest();
    find_near_response();
  }
  apply_params(m.params);
  describe();
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params_);
  step_h_ = -1;
  const char **effect = active_effects;
  if (elastic_.floating) *effect++ = "large_rotation";
  if (params_[kDampingStiffness] > 0 || params_[kDampingMass] > 0) *effect++ = "damping";
  *effect = nullptr;
}

void Body::take_surface(const dfm_mesh &m) {
  nsurfel_ = m.nsurfel;
  const uint32_t entries = nsurfel_ ? m.row[nsurfel_] : 0;
  row_.create_copy(host, m.row, nsurfel_ ? size_t(nsurfel_) + 1 : 0);
  col_.create_copy(host, m.col, entries);
  weight_.create_copy(host, m.weight, entries);
  surface_.create(host, 3 * size_t(nsurfel_) * modes_.count);
  if (!nsurfel_) return;
  for (size_t s = 0; s < nsurfel_; ++s)
    own_points_ = own_points_ && row_[s + 1] == row_[s] + 1 && weight_[row_[s]] == 1;
  for (size_t s = 0; s < nsurfel_; ++s)
    for (size_t a = 0; a < 3; ++a)
      for (uint32_t e = row_[s]; e < row_[s + 1]; ++e)
        for (uint32_t k = 0; k < modes_.count; ++k)
          surface_[(3 * s + a) * modes_.count + k] +=
              weight_[e] * modes_.shape.at(3 * size_t(col_[e]) + a, k);
}

void Body::take_integrals() {
  const uint32_t count = modes_.count;
  pull_.create(host, 3 * size_t(count));
  swing_.create(host, 9 * size_t(count));
  gradient_.create(host, count);
  if (elastic_.floating) twist_.create(host, 3 * size_t(count) * count);
  std::vector<double> shapes(size() * count);
  for (uint32_t k = 0; k < count; ++k) {
    double *const w = &shapes[size() * k];
    for (size_t j = 0; j < size(); ++j) w[j] = modes_.shape.at(j, k);
    gradient_[k] = elastic_.largest_gradient(w, nullptr);
    for (size_t i = 0; i < elastic_.npoint; ++i)
      for (size_t a = 0; a < 3; ++a) {
        const double mass = elastic_.mass[i] * w[3 * i + a];
        pull_[3 * size_t(k) + a] += mass;
        for (size_t b = 0; b < 3; ++b) swing_[9 * size_t(k) + 3 * a + b] += mass * elastic_.rest[3 * i + b];
      }
  }
  for (uint32_t k = 0; elastic_.floating && k < count; ++k)
    for (uint32_t l = 0; l < k; ++l) {
      double sum[3] = {};
      for (size_t i = 0; i < elastic_.npoint; ++i)
        cross_add(&shapes[size() * k + 3 * i], &shapes[size() * l + 3 * i], elastic_.mass[i], sum);
      for (size_t a = 0; a < 3; ++a) {
        twist_[(a * count + k) * count + l] = sum[a];
        twist_[(a * count + l) * count + k] = -sum[a];
      }
    }
}

// Room for the columns of C_rest.
void Body::check_size(uint32_t nsurfel, uint32_t npoint) const {
  const double bytes = 8.0 * 9 * double(nsurfel) * npoint;
  constexpr double kMax = 2147483648.0;
  if (bytes <= kMax) return;
  model::refuse(
      host, id_,
      "the response at rest of %u surfels and %u points may take %.1f GB, more than 2; use the model modal, "
      "or a coarser mesh",
      nsurfel, npoint, bytes / 1e9);
}

void Body::reserve() {
  const size_t padded = Basis::padded(size());
  for (Buffer<double> *b : {&u_, &w_, &f_, &mu_, &mw_, &rest_, &u_to_, &w_to_, &x_to_, &v_to_, &follow_,
                            &follow_to_, &given_[0], &given_[1]})
    b->create(host, padded);
  for (Buffer<double> *b : {&q_, &qd_, &load_, &q_to_, &qd_to_, &modal_, &softened_})
    b->create(host, modes_.count);
  coupling_.create(host, 3 * size_t(modes_.count));
  step_.create(host, modes_.count);
  rows_.create(host, 3 * size_t(nsurfel_) * row_width());
  lanes_.create(host, kLanes * row_width());
  responses_.create(host, kLanes * 3 * size_t(nsurfel_));
  if (!condensed_) return;
  columns_.create_raw(host, 9 * size_t(nsurfel_) * nlead_);  // memory that is not written costs nothing
  known_.create(host, 3 * size_t(nsurfel_));
  eight_.create(host, kLanes * size());
  between_.create(host, 12 * (size_t(nsurfel_) + kLanes));
  under_.create(host, size());
  under_of_.create(host, size());
}

void Body::describe() {
  if (params_[kModes] > modes_.count)
    std::snprintf(note_, sizeof note_, "%u modes are used; the mesh has %u, and at most %u are taken",
                  modes_.count, modes_.available, kMaxModes);
  constexpr double kTurn = 6.283185307179586;
  const double lowest = std::sqrt(modes_.lambda[0]) / kTurn,
               highest = std::sqrt(modes_.lambda[modes_.count - 1]) / kTurn;
  facts_[0] = {"modes", "modes that the body has", "1", double(modes_.count)};
  facts_[1] = {"lowest", "frequency of the lowest mode", "Hz", lowest};
  facts_[2] = {"highest", "frequency of the highest mode", "Hz", highest};
  facts_[3] = {"share", "share of the static response at the surface that its modes hold", "1", modes_.share};
  model::say(host, 1, id_, "%u modes, %.4g to %.4g Hz, %.0f %% of the static response at the surface",
             modes_.count, lowest, highest, 100 * modes_.share);
}

bool Body::lacks_state(const dfm_kin &k) const {
  if (k.state) return false;
  model::complain(host, id_, "the host gives no state, though the model has some");
  return true;
}

// u_ = the displacement in the present frame.
void Body::whole_displacement(const dfm_kin &k, Frame &f) {
  f = frame_of(k.x, k.stride, nullptr, 0);
  displacement(k, f, u_.data());
}

double Body::energy(const dfm_kin &k) {
  Frame f;
  whole_displacement(k, f);
  return elastic_.energy(u_.data());
}

void Body::cell_energy(const dfm_kin &k, double *density) {
  Frame f;
  whole_displacement(k, f);
  double sum = 0;
  for (uint32_t c = 0; c < elastic_.ncell; ++c) {
    density[c] = elastic_.density(c, u_.data());
    sum += elastic_.volume(c) * density[c];
  }
  // the surface has the energy; cells share it as their strains have it
  const double scale = by_surface_ && sum > 0 ? elastic_.energy(u_.data()) / sum : 1;
  for (uint32_t c = 0; by_surface_ && c < elastic_.ncell; ++c) density[c] *= scale;
}

void Body::cell_stress(const dfm_kin &k, double *stress) {
  Frame f;
  whole_displacement(k, f);
  for (uint32_t c = 0; c < elastic_.ncell; ++c) {
    double s[9], turned[9], world[9], transposed[9];
    elastic_.stress(c, u_.data(), s);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) transposed[3 * i + j] = f.r[3 * j + i];
    matrix_product(f.r, s, turned);
    matrix_product(turned, transposed, world);
    const double voigt[6] = {world[0], world[4], world[8], world[1], world[5], world[2]};
    std::copy(voigt, voigt + 6, stress + 6 * size_t(c));
  }
}

}  // namespace reduced
