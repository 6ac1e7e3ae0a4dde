// Undamped bodies at steps that the library chooses: how well their energy keeps. For the test of the step's
// sizes and the study of it.
#pragma once
#include <algorithm>
#include <cstdlib>

#include "world.h"

namespace test::step_energy {

// spin: turns freely, the fastest point at a fifth of the speed of waves. whirl: at a third.
// ring: let go 1 % longer and 0.6 % thinner, turning slowly. wrung: 5 % and 3 %.
// hung: held at one end and let go under gravity; as stiff as bends a solid bar of this length and thickness
// by a twentieth of its length.
struct Case {
  std::string name, mesh, motion;
  double volume;
};

struct Result {
  uint64_t steps = 0, substeps = 0, changes = 0, inverted = 0;  // changes: of the sub-step's size
  // J; least, most: mean of a block over `first`; trend: per 1e6 steps, over first
  double first = 0, least = 0, most = 0, trend = 0;
  double lowest = 0, highest = 0;  // of single samples, over `first`
  double scale = 0;                // J, what the energy is compared with
  bool stopped = false;
};

// The energy that symplectic Euler keeps where forces are linear: U(x_n) + v_n.M v_(n+1) / 2
// (doc/concepts/step.md).
class Sampler {
 public:
  Sampler(dfm_world world, dfm_body body, const double *gravity, const std::vector<double> &share)
      : world_(world), body_(body), gravity_(gravity, gravity + 3) {
    uint32_t n = 0;
    ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
    x_.resize(3 * size_t(n));
    v_.resize(x_.size());
    after_.resize(x_.size());
    mass_.assign(n, 0.0);
    const dfm_body_measure m = measure(body);
    dfm_body_info info{};
    info.size = sizeof info;
    ok(dfm_body_get_info(body, &info));
    std::vector<uint32_t> tets(4 * size_t(info.ntet));
    ok(dfm_body_get_rest(body, n, x_.data(), info.ntet, tets.data()));
    for (size_t t = 0; t < tets.size(); t += 4) {
      double e[3][3];
      for (int k = 0; k < 9; ++k)
        e[k / 3][k % 3] = x_[3 * size_t(tets[t + 1 + size_t(k) / 3]) + size_t(k % 3)] -
                          x_[3 * size_t(tets[t]) + size_t(k % 3)];
      const double v = std::fabs(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                                 e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                                 e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
                       6;
      for (int k = 0; k < 4; ++k) mass_[tets[t + size_t(k)]] += v * (share.empty() ? 1 : share[t / 4]);
    }
    double sum = 0;
    for (double x : mass_) sum += x;
    for (double &x : mass_) x *= m.mass / sum;
  }
  // Takes a step; the energy on its way, J.
  double step(double dt, dfm_status *status) {
    const dfm_body_measure m = measure(body_);
    uint32_t n = 0;
    ok(dfm_body_get_state(body_, uint32_t(mass_.size()), x_.data(), v_.data(), &n));
    *status = dfm_world_step(world_, dt, nullptr);
    ok(dfm_body_get_state(body_, uint32_t(mass_.size()), nullptr, after_.data(), &n));
    double sum = m.elastic;
    for (size_t i = 0; i < mass_.size(); ++i)
      for (size_t k = 0; k < 3; ++k)
        sum += mass_[i] * (0.5 * v_[3 * i + k] * after_[3 * i + k] - gravity_[k] * x_[3 * i + k]);
    return sum;
  }

 private:
  dfm_world world_;
  dfm_body body_;
  std::vector<double> gravity_, x_, v_, after_, mass_;
};

struct Setting {
  dfm_world world = 0;
  dfm_body body = 0;
  double scale = 0, gravity[3] = {0, 0, 0};  // J, m/s2
  std::vector<double> share;                 // of each cell
};

// The file's cells; "beam", "cylinder", "ball": the generator's; a surface: filled.
inline dfm_mesh_handle load(dfm_context *context, const std::string &mesh) {
  dfm_mesh_handle cells = 0;
  const double size[3] = {mesh == "beam"       ? 0.4
                          : mesh == "cylinder" ? 0.05
                                               : 0.1,
                          mesh == "cylinder" ? 0.3 : 0.1, 0.08};
  if (mesh.find('.') == std::string::npos) {
    ok(dfm_mesh_make(context, mesh.c_str(), size, DFM_MESH_CELLS, 600, &cells));
  } else if (mesh.find(".obj") != std::string::npos) {
    dfm_mesh_handle surface = 0;
    ok(dfm_mesh_load(context, mesh.c_str(), DFM_MESH_SURFACE, &surface));
    ok(dfm_mesh_fill(surface, 1000, &cells));
    ok(dfm_mesh_destroy(surface));
  } else {
    ok(dfm_mesh_load(context, mesh.c_str(), DFM_MESH_CELLS, &cells));
  }
  return cells;
}

inline Setting make(dfm_context *context, const Case &c) {
  Setting s;
  const bool hung = c.motion == "hung";
  s.gravity[2] = hung ? -9.81 : 0;
  s.world = make_world(context, {0, 0, s.gravity[2]});
  const dfm_mesh_handle mesh = load(context, c.mesh);
  BodyOptions o;
  o.volume = c.volume;
  dfm_body_def d = dfm_body_def_default();
  if (const double *const share = lend(mesh, d).share) {
    s.share.assign(share, share + d.ntet);
    d.cell_share = s.share.data();
  }
  const dfm_param_value volume{"volume", &o.volume, 1};
  if (c.volume >= 0) d.model_params = {sizeof(dfm_params), 1, &volume};
  double lo[3], hi[3];
  for (int k = 0; k < 3; ++k) lo[k] = hi[k] = d.points[k];
  for (uint32_t i = 0; i < 3 * d.npoint; ++i) {
    lo[i % 3] = std::min(lo[i % 3], d.points[i]);
    hi[i % 3] = std::max(hi[i % 3], d.points[i]);
  }
  double size[3];
  for (int k = 0; k < 3; ++k) size[k] = hi[k] - lo[k];
  const int longest = int(std::max_element(size, size + 3) - size);
  const double thick = *std::min_element(size, size + 3), length = size[longest];
  if (hung) o.young = 30 * o.density * 9.81 * length * (length / thick) * (length / thick);
  d.material = make_material(s.world, o);
  // Waves run at about 10 m/s in the other material.
  const double reach = 0.5 * std::hypot(size[0], size[1]);
  d.spin[2] = c.motion == "spin" ? 2 / reach : c.motion == "whirl" ? 3.3 / reach : hung ? 0 : 0.2 / reach;
  std::vector<uint8_t> fixed(d.npoint, 0);
  for (uint32_t i = 0; hung && i < d.npoint; ++i)
    fixed[i] = d.points[3 * i + size_t(longest)] < lo[longest] + 0.05 * size[longest] ? 7 : 0;
  if (hung) d.fixed = fixed.data();
  ok(dfm_body_create(s.world, &d, &s.body));
  ok(dfm_mesh_destroy(mesh));
  std::vector<double> x = State(s.body).x;
  const uint32_t n = uint32_t(x.size() / 3);
  const dfm_body_measure m = measure(s.body);
  const double strain = c.motion == "ring" ? 0.01 : c.motion == "wrung" ? 0.05 : 0;
  for (size_t i = 0; i < x.size(); ++i)
    x[i] += (int(i % 3) == longest ? strain : -0.6 * strain) * (x[i] - m.com[i % 3]);
  if (strain > 0) ok(dfm_body_set_state(s.body, n, x.data(), nullptr));
  const dfm_body_measure now = measure(s.body);
  s.scale = now.kinetic + now.elastic + now.mass * 9.81 * (hung ? 0.01 * size[longest] : 0);
  return s;
}

// Up to `steps` steps of a share of dfm_world_stable_step, asked anew before each; blocks: means
// that are compared.
inline Result run_case(dfm_context *context, const Case &c, uint64_t steps, uint64_t blocks,
                       double share = 1) {
  Setting s = make(context, c);
  Sampler sampler(s.world, s.body, s.gravity, s.share);
  Result r;
  const uint64_t block = std::max<uint64_t>(1, steps / blocks), every = std::max<uint64_t>(1, block / 100);
  double last = 0, swing = s.scale, start = NAN;
  std::vector<double> means;
  double sum = 0, lowest = HUGE_VAL, highest = -HUGE_VAL;
  uint64_t samples = 0;
  for (uint64_t i = 0; i < steps && !r.stopped; ++i) {
    double dt = 0;
    ok(dfm_world_stable_step(s.world, &dt, nullptr, nullptr));
    dt *= share;
    dfm_status status = DFM_OK;
    if (i % every == 0) {
      const double e = sampler.step(dt, &status);
      if (i == 0) start = e;
      sum += e;
      ++samples;
      lowest = std::min(lowest, e);
      highest = std::max(highest, e);
      if (c.motion == "hung") swing = std::max(swing, measure(s.body).elastic);
      if (!std::isfinite(e) || std::fabs(e - start) > 1e3 * swing) r.stopped = true;
    } else {
      status = dfm_world_step(s.world, dt, nullptr);
    }
    if (status != DFM_OK) r.stopped = true;
    const double size = dt / stats(s.world).last_substeps;
    if (i > 0 && size != last) ++r.changes;
    last = size;
    r.steps = i + 1;
    if ((i + 1) % block == 0 && samples > 0) {
      means.push_back(sum / double(samples));
      sum = 0;
      samples = 0;
    }
  }
  r.substeps = stats(s.world).substeps;
  r.inverted = stats(s.world).inverted_max;
  r.scale = swing;
  if (means.empty()) means.push_back(samples ? sum / double(samples) : NAN);
  r.first = means[0];
  r.least = *std::min_element(means.begin(), means.end()) - r.first;
  r.most = *std::max_element(means.begin(), means.end()) - r.first;
  r.least /= swing;
  r.most /= swing;
  r.lowest = (lowest - r.first) / swing;
  r.highest = (highest - r.first) / swing;
  // slope of the line through the blocks' means, least squares
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (size_t i = 0; i < means.size(); ++i) {
    mx += double(i) / double(means.size());
    my += means[i] / double(means.size());
  }
  for (size_t i = 0; i < means.size(); ++i) {
    xy += (double(i) - mx) * (means[i] - my);
    xx += (double(i) - mx) * (double(i) - mx);
  }
  r.trend = xx > 0 ? xy / xx * (1e6 / double(block)) / swing : 0;
  ok(dfm_world_destroy(s.world));
  return r;
}

}  // namespace test::step_energy
