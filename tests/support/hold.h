// What holds: soft things that friction alone keeps in place, and how much they creep. One law, one step, one mesh to a case.
//
//   pinch      a rigid capsule between two soft pads that press with `level` times the least force that holds its weight, m g / (2 mu)
//   slope      a soft block on a plane under gravity tilted so that it pulls `level` of mu times its weight
//   pull       a wide pad, pressed on a plane by five times its weight, pulled by `level` of what that holds
//   soft       the same on a soft bed
//   vibration  the first pad pad pulled by 0 to 1/2 of it, up and down at 50 Hz
#pragma once
#include <ctime>

#include "cells.h"
#include "rigid.h"

namespace test::hold {

constexpr double kG = 9.81, kMu = 0.5, kSigma0 = 1e8, kFrequency = 50;

struct Case { std::string scene, law; double level, step; bool fine; double cycles = 0; };   // cycles: of the vibration
struct Result {
  double creep = 0;          // m/s, of what is held, over the time that was measured
  double contact = 0;        // m/s, of the contact that crept most; NAN: none stuck all the time
  double drift = 0;          // m/s, what the law says that a rigid block of evenly pressed bristles drifts
  uint32_t stuck = 0;
  uint64_t substeps = 0, unconverged = 0;
  double simulated = 0;      // s, of which the last part was measured
  double seconds = 0;        // of the processor
};

inline bool promises_stiction(const std::string &law) { return law != "dahl" && law != "lugre"; }

inline void set_law(dfm_world w, const std::string &law) {
  const double mu = kMu, sigma0 = kSigma0, sigma1 = 1e3;
  std::vector<dfm_param_value> v{{"mu_C", &mu, 1}};
  if (law != "dahl") v.push_back({"mu_S", &mu, 1});
  if (law == "dahl" || law == "lugre" || law == "elastoplastic") v.push_back({"sigma0", &sigma0, 1});
  if (law == "lugre" || law == "elastoplastic") v.push_back({"sigma1", &sigma1, 1});
  dfm_friction_def f{};
  f.size = sizeof f, f.between[0] = f.between[1] = "*", f.law = law.c_str(), f.params = {sizeof(dfm_params), uint32_t(v.size()), v.data()};
  ok(dfm_world_add_friction(w, &f));
}

// Scale from `from` to `to` along a smooth step within [t0, t1].
inline std::vector<dfm_scale_key> ramp(double t0, double t1, double from = 0, double to = 1) {
  std::vector<dfm_scale_key> keys;
  for (int i = 0; i <= 50; ++i) {
    const double s = i / 50.0;
    keys.push_back({t0 + s * (t1 - t0), from + (to - from) * s * s * (3 - 2 * s)});
  }
  return keys;
}

// A force on a body, every point its share by mass; below: on points no higher than that alone.
inline void pull(dfm_body b, Vec force, const std::vector<dfm_scale_key> &keys, const dfm_sine *sine = nullptr, double below = 1e9) {
  dfm_body_info info{};
  info.size = sizeof info;
  ok(dfm_body_get_info(b, &info));
  std::vector<double> x(3 * size_t(info.npoint)), share(info.npoint), f;
  std::vector<uint32_t> tets(4 * size_t(info.ntet)), points;
  ok(dfm_body_get_rest(b, info.npoint, x.data(), info.ntet, tets.data()));
  double volume = 0;
  for (size_t t = 0; t < tets.size(); t += 4) {
    double e[3][3];
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) e[k][i] = x[3 * tets[t + size_t(k) + 1] + size_t(i)] - x[3 * tets[t] + size_t(i)];
    const double v = std::fabs(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                               e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]));
    for (size_t k = 0; k < 4; ++k)
      if (x[3 * tets[t + k] + 2] <= below) share[tets[t + k]] += 0.25 * v, volume += 0.25 * v;
  }
  for (uint32_t i = 0; i < info.npoint; ++i) {
    points.push_back(i);
    for (double c : force) f.push_back(c * share[i] / volume);
  }
  ok(dfm_body_add_load(b, info.npoint, points.data(), f.data(), uint32_t(keys.size()), keys.data(), sine, nullptr));
}

inline double weight(dfm_body b) { return measure(b).mass * kG; }

struct Scene {
  Context context;
  dfm_world world = 0;
  dfm_body body = 0;             // what is held, or
  dfm_rigid rigid = 0;
  double settle = 1.6, measured = 0.5, ahead = 1;   // s; along which what is measured counts: x, or z where a capsule falls

  explicit Scene(const Case &c) {
    if (c.scene == "pinch") pinch(c);
    else if (c.scene == "slope") slope(c);
    else pad(c);
  }
  // Where it is, m, along the way that it would slip.
  double at() const {
    if (body) return measure(body).com[0];
    dfm_rigid_state s{};
    ok(dfm_rigid_get_state(rigid, &s));
    return -s.position[2];
  }

 private:
  BodyOptions soft(double young) {
    BodyOptions o;
    o.young = young, o.damping_stiffness = 2e-3, o.damping_mass = 20;   // drag that lets bristles settle; it carries nothing at rest
    return o;
  }
  void slope(const Case &c) {
    world = make_world(context, {0, 0, -kG});
    add_plane(world, "floor");
    BodyOptions o = soft(2e5);
    o.name = "block", o.position = {-0.05, -0.05, 2e-5};
    body = make_body(context, world, "beam", {0.1, 0.1, 0.05}, c.fine ? 1500 : 100, o);
    set_law(world, c.law);
    const double slant = std::atan(kMu * c.level);
    std::vector<dfm_vector_key> keys;
    for (const dfm_scale_key &k : ramp(0.3, 0.8)) keys.push_back({k.t, {kG * std::sin(k.value * slant), 0, -kG * std::cos(k.value * slant)}});
    ok(dfm_world_set_gravity_keys(world, uint32_t(keys.size()), keys.data()));
  }
  // A wide plate whose lower face is held: its mesh and the pad's have nothing in common.
  void bed(const Case &c) {
    BodyOptions o = soft(2e5);
    o.name = "bed", o.position = {-0.07, -0.065, -0.03};
    const dfm_body b = make_body(context, world, "beam", {0.14, 0.13, 0.03}, c.fine ? 1000 : 200, o);
    uint32_t n = 0;
    ok(dfm_body_get_state(b, 0, nullptr, nullptr, &n));
    std::vector<double> x(3 * size_t(n));
    ok(dfm_body_get_state(b, n, x.data(), nullptr, &n));
    std::vector<uint32_t> low;
    for (uint32_t i = 0; i < n; ++i)
      if (x[3 * i + 2] < -0.03 + 1e-9) low.push_back(i);
    ok(dfm_body_hold(b, uint32_t(low.size()), low.data(), 7));
  }
  void pad(const Case &c) {
    world = make_world(context, {0, 0, -kG});
    if (c.scene == "soft") bed(c);
    else add_plane(world, "floor");
    BodyOptions o = soft(2e5);
    o.name = "pad", o.position = {-0.05, -0.05, 2e-5};
    body = make_body(context, world, "beam", {0.1, 0.1, 0.02}, c.fine ? 1500 : 100, o);
    set_law(world, c.law);
    const double press = 5 * weight(body), held = kMu * (press + weight(body));
    pull(body, {0, 0, -press}, ramp(0, 0.2));
    if (c.scene != "vibration") return pull(body, {c.level * held, 0, 0}, ramp(0.3, 0.8), nullptr, 1e-9);
    dfm_sine sine{};
    sine.amplitude[0] = 1, sine.frequency = kFrequency;
    pull(body, {0.25 * held, 0, 0}, ramp(0.3, 0.8), &sine, 1e-9);   // at the face, or the pressure would rock
    settle = 3, measured = c.cycles / kFrequency;   // an elastic zone needs some cycles to fit itself to the load
  }
  void pinch(const Case &c) {
    world = make_world(context, {0, 0, -kG});
    rigid_capsule();
    const double capsule = 0.01, grip = c.level * capsule * kG / (2 * kMu);
    for (const int side : {-1, 1}) {
      BodyOptions o = soft(1e5);
      o.name = side < 0 ? "left" : "right", o.position = {side < 0 ? -0.04 - kRadius - 2e-5 : kRadius + 2e-5, -0.02, -0.017};
      const dfm_body b = make_body(context, world, "beam", {0.04, 0.04, 0.04}, c.fine ? 1000 : 250, o);
      press(b, side, grip);
      pull(b, {0, 0, weight(b)}, ramp(0.4, 0.8));
    }
    set_law(world, c.law);
    // the pads close first; then the capsule's support goes
    std::vector<dfm_vector_key> keys;
    for (const dfm_scale_key &k : ramp(0.4, 0.8)) keys.push_back({k.t, {0, 0, -kG * k.value}});
    ok(dfm_world_set_gravity_keys(world, uint32_t(keys.size()), keys.data()));
  }
  static constexpr double kRadius = 0.01;
  void rigid_capsule() {
    dfm_rigid_def d = dfm_rigid_def_default();
    d.name = "capsule", d.shape = DFM_SHAPE_CAPSULE, d.mass = 0.01, d.radius = kRadius, d.half_length = 0.03;
    d.pose.rotation[0] = std::sqrt(0.5), d.pose.rotation[3] = std::sqrt(0.5);   // axis along y
    rigid = create(world, {d})[0];
  }
  // The far half of a pad slides along x as in a guide; its far face is pressed.
  static void press(dfm_body b, int side, double force) {
    uint32_t n = 0;
    ok(dfm_body_get_state(b, 0, nullptr, nullptr, &n));
    std::vector<double> x(3 * size_t(n)), f;
    ok(dfm_body_get_state(b, n, x.data(), nullptr, &n));
    double far = 0;
    for (uint32_t i = 0; i < n; ++i) far = std::max(far, side * x[3 * i]);
    std::vector<uint32_t> back, guided;
    for (uint32_t i = 0; i < n; ++i) {
      if (side * x[3 * i] > far - 1e-9) back.push_back(i);
      if (side * x[3 * i] > far - 0.021) guided.push_back(i);
    }
    ok(dfm_body_hold(b, uint32_t(guided.size()), guided.data(), 6));
    for (size_t i = 0; i < back.size(); ++i) f.insert(f.end(), {-side * force / double(back.size()), 0, 0});
    const auto keys = ramp(0, 0.4);
    ok(dfm_body_add_load(b, uint32_t(back.size()), back.data(), f.data(), uint32_t(keys.size()), keys.data(), nullptr, nullptr));
  }
};

// Friction page of the design, 2.4 and 2.5: way per cycle of a load between F1 and F2, shares of F_C, dx = (F_C / sigma0) ln [(1 - F1^2) / (1 - F2^2)].
inline double drift_per_cycle(double pressure, double low, double high) {
  return kMu * pressure / kSigma0 * std::log((1 - low * low) / (1 - high * high));
}

inline Result run_case(const Case &c) {
  const std::clock_t start = std::clock();
  Scene s(c);
  Result r;
  const auto steps = [&](double seconds) {
    for (long i = 0, n = std::lround(seconds / c.step); i < n; ++i)
      if (dfm_world_step(s.world, c.step, nullptr) != DFM_OK) return ok(DFM_E_DIVERGED), false;
    return true;
  };
  if (!steps(s.settle)) return r;
  ok(dfm_world_hold_begin(s.world));
  const double x0 = s.at();
  if (!steps(s.measured)) return r;
  r.creep = std::fabs(s.at() - x0) / s.measured;
  ok(dfm_world_hold(s.world, &r.contact, &r.stuck));
  if (c.scene == "vibration" && !promises_stiction(c.law)) r.drift = kFrequency * drift_per_cycle(6 * weight(s.body) / 0.01, 0, 0.5);
  const dfm_world_stats st = stats(s.world);
  r.substeps = st.substeps, r.unconverged = st.unconverged;
  r.simulated = s.settle + s.measured;
  r.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  return r;
}

}  // namespace test::hold
