// What holds: soft things that friction alone keeps in place, and how much they creep. One law, one step, one
// mesh to a case.
//
//   pinch      a rigid capsule between two soft pads that press with `level` times the least force that holds
//              its weight, m g / (2 mu)
//   slope      a soft block on a plane under gravity tilted so that it pulls `level` of mu times its weight
//   pull       a wide pad, pressed on a plane by five times its weight, pulled by `level` of what that holds
//   soft       the same on a soft bed
//   vibration  the first pad pad pulled by 0 to 1/2 of it, up and down at 50 Hz
//   stack      `level` soft cubes on each other, each turned by 7 degrees and shifted by 3 mm against the one
//              below; as they come, with little damping
//   grip       the pinch with a soft block for the capsule
//   vee        a soft block, turned by `level` degrees about the vertical, in a right-angled groove
//   taper      a soft block pushed into a groove of 2 x 15 degrees, which holds it by friction alone
//              once it is let go
//   wedges     a soft block that narrows downwards, turned by `level` degrees, between two soft wedges
#pragma once
#include <ctime>

#include "cells.h"
#include "rigid.h"

namespace test::hold {

constexpr double kG = 9.81, kMu = 0.5, kSigma0 = 1e8, kFrequency = 50;

// cycles: of the vibration; model: of the bodies, msm where it is empty
struct Case {
  std::string scene, law;
  double level, step;
  bool fine;
  double cycles = 0;
  std::string model = {};
  int32_t integrator = DFM_INTEGRATOR_AUTO;
};
struct Result {
  double creep = NAN;  // m/s, of what is held, over the time that was measured; NAN: the run was stopped
  double contact = 0;  // m/s, of the contact that crept most; NAN: none stuck all the time
  double drift = 0;    // m/s, what the law says that a rigid block of evenly pressed bristles drifts
  uint32_t stuck = 0;
  uint64_t substeps = 0, unconverged = 0;
  double simulated = 0;  // s, of which the last part was measured
  double seconds = 0;    // of the processor
};

inline bool promises_stiction(const std::string &law) { return law != "dahl" && law != "lugre"; }

inline LawValues values_of(const std::string &law, double mu) {
  LawValues v{{"mu_C", mu}};
  if (law != "dahl") v.push_back({"mu_S", mu});
  if (law == "dahl" || law == "lugre" || law == "elastoplastic") v.push_back({"sigma0", kSigma0});
  if (law == "lugre" || law == "elastoplastic") v.push_back({"sigma1", 1e3});
  return v;
}

inline void set_law(dfm_world w, const std::string &law) {
  ok(add_friction(w, law.c_str(), values_of(law, kMu)));
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
inline void pull(dfm_body b, Vec force, const std::vector<dfm_scale_key> &keys,
                 const dfm_sine *sine = nullptr, double below = 1e9) {
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
      for (int i = 0; i < 3; ++i)
        e[k][i] = x[3 * tets[t + size_t(k) + 1] + size_t(i)] - x[3 * tets[t] + size_t(i)];
    const double v = std::fabs(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                               e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                               e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]));
    for (size_t k = 0; k < 4; ++k)
      if (x[3 * tets[t + k] + 2] <= below) {
        share[tets[t + k]] += 0.25 * v;
        volume += 0.25 * v;
      }
  }
  for (uint32_t i = 0; i < info.npoint; ++i) {
    points.push_back(i);
    for (double c : force) f.push_back(c * share[i] / volume);
  }
  ok(dfm_body_add_load(b, info.npoint, points.data(), f.data(), uint32_t(keys.size()), keys.data(), sine,
                       nullptr));
}

inline double weight(dfm_body b) { return measure(b).mass * kG; }

struct Scene {
  Context context;
  dfm_world world = 0;
  dfm_body body = 0;  // what is held, or
  dfm_rigid rigid = 0;
  double settle = 1.6, measured = 0.5;  // s
  // what is held may creep in any direction; else along x, or down where a capsule falls
  bool any_way = false;

  explicit Scene(const Case &c) : model(c.model) {
    world = make_world(context, {0, 0, -kG}, c.integrator);
    if (c.scene == "pinch" || c.scene == "grip") pinch(c);
    else if (c.scene == "slope") slope(c);
    else if (c.scene == "stack") stack(c);
    else if (c.scene == "vee") vee(c);
    else if (c.scene == "taper") taper(c);
    else if (c.scene == "wedges") wedges(c);
    else pad(c);
  }
  // Where it is, m.
  Vec at() const {
    if (body) {
      const dfm_body_measure m = measure(body);
      return any_way ? Vec{m.com[0], m.com[1], m.com[2]} : Vec{m.com[0], 0, 0};
    }
    dfm_rigid_state s{};
    ok(dfm_rigid_get_state(rigid, &s));
    return {0, 0, s.position[2]};
  }

 private:
  std::string model;
  BodyOptions soft(double young) {
    BodyOptions o;
    o.model = model;
    o.young = young;
    o.damping_stiffness = 2e-3;
    o.damping_mass = 20;  // drag that lets bristles settle; it carries nothing at rest
    return o;
  }
  void slope(const Case &c) {
    add_plane(world, "floor");
    BodyOptions o = soft(2e5);
    o.name = "block";
    o.position = {-0.05, -0.05, 2e-5};
    body = make_body(context, world, "beam", {0.1, 0.1, 0.05}, c.fine ? 1500 : 100, o);
    set_law(world, c.law);
    const double slant = std::atan(kMu * c.level);
    std::vector<dfm_vector_key> keys;
    for (const dfm_scale_key &k : ramp(0.3, 0.8))
      keys.push_back({k.t, {kG * std::sin(k.value * slant), 0, -kG * std::cos(k.value * slant)}});
    ok(dfm_world_set_gravity_keys(world, uint32_t(keys.size()), keys.data()));
  }
  // A wide plate whose lower face is held: its mesh and the pad's have nothing in common.
  void bed(const Case &c) {
    BodyOptions o = soft(2e5);
    o.name = "bed";
    o.position = {-0.07, -0.065, -0.03};
    const dfm_body b = make_body(context, world, "beam", {0.14, 0.13, 0.03}, c.fine ? 1000 : 200, o);
    const std::vector<double> x = State(b).x;
    const uint32_t n = uint32_t(x.size() / 3);
    std::vector<uint32_t> low;
    for (uint32_t i = 0; i < n; ++i)
      if (x[3 * i + 2] < -0.03 + 1e-9) low.push_back(i);
    ok(dfm_body_hold(b, uint32_t(low.size()), low.data(), 7));
  }
  void pad(const Case &c) {
    if (c.scene == "soft") {
      bed(c);
      settle = 3;
    } else add_plane(world, "floor");
    BodyOptions o = soft(2e5);
    o.name = "pad";
    o.position = {-0.05, -0.05, 2e-5};
    body = make_body(context, world, "beam", {0.1, 0.1, 0.02}, c.fine ? 1500 : 100, o);
    set_law(world, c.law);
    const double press = 5 * weight(body), held = kMu * (press + weight(body));
    pull(body, {0, 0, -press}, ramp(0, 0.2));
    if (c.scene != "vibration") return pull(body, {c.level * held, 0, 0}, ramp(0.3, 0.8), nullptr, 1e-9);
    dfm_sine sine{};
    sine.amplitude[0] = 1;
    sine.frequency = kFrequency;
    pull(body, {0.25 * held, 0, 0}, ramp(0.3, 0.8), &sine, 1e-9);  // at the face, or the pressure would rock
    settle = 3;
    measured = c.cycles / kFrequency;  // an elastic zone needs some cycles to fit itself to the load
  }
  void pinch(const Case &c) {
    const bool soft_load = c.scene == "grip";
    if (soft_load) soft_block(c);
    else rigid_capsule();
    const double load = soft_load ? measure(body).mass : 0.01, grip = c.level * load * kG / (2 * kMu);
    for (const int side : {-1, 1}) {
      BodyOptions o = soft(1e5);
      o.name = side < 0 ? "left" : "right";
      o.position = {side < 0 ? -0.04 - kRadius - 2e-5 : kRadius + 2e-5, -0.02, -0.017};
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
  void soft_block(const Case &c) {
    BodyOptions o = soft(1e5);
    o.name = "block";
    o.position = {-kRadius, -0.013, -0.011};
    any_way = true;
    body = make_body(context, world, "beam", {2 * kRadius, 0.026, 0.022}, c.fine ? 400 : 60, o);
  }
  static std::array<double, 4> about_z(double angle) {
    return {0, 0, std::sin(angle / 2), std::cos(angle / 2)};
  }
  void stack(const Case &c) {
    constexpr double kSide = 0.1, kDegree = 0.017453292519943295;
    any_way = true;
    add_plane(world, "floor");
    for (int i = 0; i < int(c.level); ++i) {
      const double turn = 7 * kDegree * i, x = std::cos(turn), y = std::sin(turn);
      BodyOptions o;
      o.model = model;
      o.young = 1e5;
      o.damping_stiffness = 1e-3;
      o.damping_mass = 8;
      o.name = "cube " + std::to_string(i);
      o.rotation = about_z(turn);
      o.position = {0.003 * i - 0.5 * kSide * (x - y), -0.5 * kSide * (x + y), i * kSide + (i + 1) * 1e-4};
      body = make_body(context, world, "beam", {kSide, kSide, kSide}, c.fine ? 600 : 60, o);
    }
    set_law(world, c.law);
    settle = 5;
    measured = 1;
  }
  // A groove along y, its walls `slant` off the vertical.
  void groove(double slant) {
    for (const int side : {-1, 1}) {
      // the plane's normal, from z toward the middle
      const double half = 0.5 * side * (1.5707963267948966 - slant);
      add_plane(world, side < 0 ? "left" : "right", {}, {0, -std::sin(half), 0, std::cos(half)});
    }
  }
  void vee(const Case &c) {
    constexpr double kSide = 0.04, kQuarter = 0.78539816339744831;
    any_way = true;
    groove(kQuarter);
    BodyOptions o = soft(1e5);
    const double turn = c.level * 0.017453292519943295;
    const double s = std::sin(kQuarter / 2);
    const double q = std::cos(kQuarter / 2);
    o.name = "block";
    o.position = {0, -0.03, 0.004 + 0.06 * std::sin(turn)};
    // about y by 45 degrees, then about z
    o.rotation = {-std::sin(turn / 2) * s, std::cos(turn / 2) * s, std::sin(turn / 2) * q,
                  std::cos(turn / 2) * q};
    o.position[0] -= kSide * std::sqrt(0.5) * std::cos(turn) - 0.03 * std::sin(turn);
    o.position[2] += kSide * std::sqrt(0.5);
    body = make_body(context, world, "beam", {kSide, 0.06, kSide}, c.fine ? 600 : 80, o);
    set_law(world, c.law);
    settle = 1.5;
    measured = 0.5;
  }
  void taper(const Case &c) {
    constexpr double kWide = 0.04, kSlant = 0.2617993877991494;
    any_way = true;
    groove(kSlant);
    BodyOptions o = soft(1e5);
    o.name = "block";
    o.position = {-0.5 * kWide, -0.025, 0.5 * kWide / std::tan(kSlant) + 1e-4};
    body = make_body(context, world, "beam", {kWide, 0.05, 0.04}, c.fine ? 600 : 80, o);
    set_law(world, c.law);
    const double press = c.level * weight(body);
    auto keys = ramp(0, 0.3);
    for (const dfm_scale_key &k : ramp(0.5, 1.0, 1, 0)) keys.push_back(k);
    pull(body, {0, 0, -press}, keys);
    settle = 1.5;
    measured = 0.5;
  }
  static constexpr double kLean = 0.6;  // of the wedges' faces, way over height
  void wedge(const Case &c, int side) {
    constexpr double kLong = 0.06, kHigh = 0.05, kFoot = 0.06;
    Cells cells = make_cells(context, "beam", {kFoot, kLong, kHigh}, c.fine ? 500 : 120);
    std::vector<uint8_t> fixed(cells.npoint());
    for (uint32_t i = 0; i < cells.npoint(); ++i) {
      double *const p = &cells.points[3 * size_t(i)];
      p[0] *= 1 - kLean * p[2] / kFoot;
      if (side > 0) p[0] = kFoot - p[0];
      fixed[i] = p[2] < 1e-9 ? 7 : 0;
    }
    // mirrored
    for (uint32_t t = 0; side > 0 && t < cells.ntet(); ++t)
      std::swap(cells.tets[4 * size_t(t)], cells.tets[4 * size_t(t) + 1]);
    BodyOptions o = soft(2e5);
    o.name = side < 0 ? "left" : "right";
    o.position = {side < 0 ? -kFoot - 0.002 : 0.002, -0.5 * kLong, 0};
    make_body(world, cells, o, nullptr, fixed.data());
  }
  void wedges(const Case &c) {
    constexpr double kBelow = 0.02, kLong = 0.045, kHigh = 0.03;  // m wide at its lower face, and so on
    any_way = true;
    for (const int side : {-1, 1}) wedge(c, side);
    Cells cells = make_cells(context, "beam", {kBelow, kLong, kHigh}, c.fine ? 400 : 80);
    for (uint32_t i = 0; i < cells.npoint(); ++i) {
      double *const p = &cells.points[3 * size_t(i)];
      p[0] = (p[0] - 0.5 * kBelow) * (1 + kLean * p[2] / (0.5 * kBelow));
      p[1] -= 0.5 * kLong;
    }
    BodyOptions o = soft(1e5);
    o.name = "block";
    o.position = {0, 0.002, (0.5 * kBelow - 0.002) / kLean + 0.0015};
    o.rotation = about_z(c.level * 0.017453292519943295);
    body = make_body(world, cells, o);
    set_law(world, c.law);
    settle = 1.5;
    measured = 0.5;
  }
  static constexpr double kRadius = 0.01;
  void rigid_capsule() {
    dfm_rigid_def d = dfm_rigid_def_default();
    d.name = "capsule";
    d.shape = DFM_SHAPE_CAPSULE;
    d.mass = 0.01;
    d.radius = kRadius;
    d.half_length = 0.03;
    d.pose.rotation[0] = std::sqrt(0.5);
    d.pose.rotation[3] = std::sqrt(0.5);  // axis along y
    rigid = create(world, {d})[0];
  }
  // The far half of a pad slides along x as in a guide; its far face is pressed.
  static void press(dfm_body b, int side, double force) {
    std::vector<double> x = State(b).x, f;
    const uint32_t n = uint32_t(x.size() / 3);
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
    ok(dfm_body_add_load(b, uint32_t(back.size()), back.data(), f.data(), uint32_t(keys.size()), keys.data(),
                         nullptr, nullptr));
  }
};

// doc/laws/formulas.md (12): way per cycle of a load between F1 and F2, shares of F_C, dx = (F_C / sigma0) ln
// [(1 - F1^2) / (1 - F2^2)].
inline double drift_per_cycle(double pressure, double low, double high) {
  return kMu * pressure / kSigma0 * std::log((1 - low * low) / (1 - high * high));
}

inline Result run_case(const Case &c) {
  const std::clock_t start = std::clock();
  Scene s(c);
  Result r;
  const auto steps = [&](double seconds) {
    for (long i = 0, n = std::lround(seconds / c.step); i < n; ++i)
      if (dfm_world_step(s.world, c.step, nullptr) != DFM_OK) {
        ok(DFM_E_DIVERGED);
        return false;
      }
    return true;
  };
  if (!steps(s.settle)) return r;
  ok(dfm_world_hold_begin(s.world));
  const Vec before = s.at();
  if (!steps(s.measured)) return r;
  const Vec after = s.at();
  r.creep = std::hypot(after[0] - before[0], after[1] - before[1], after[2] - before[2]) / s.measured;
  ok(dfm_world_hold(s.world, &r.contact, &r.stuck));
  if (c.scene == "vibration" && !promises_stiction(c.law))
    r.drift = kFrequency * drift_per_cycle(6 * weight(s.body) / 0.01, 0, 0.5);
  const dfm_world_stats st = stats(s.world);
  r.substeps = st.substeps;
  r.unconverged = st.unconverged;
  r.simulated = s.settle + s.measured;
  r.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  return r;
}

}  // namespace test::hold
