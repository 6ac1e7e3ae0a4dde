// Random piles: 5 to 20 bodies of all kinds fall into a box, given by a seed alone. What is walked with them
// is whether a law's solve stays finite.
#pragma once
#include <random>

#include "world.h"

namespace test::pile {

struct Result {
  uint32_t bodies = 0;
  uint64_t steps = 0, substeps = 0, unconverged = 0, guard = 0;
  std::string failure;  // empty: all steps were made
};

class Random {
 public:
  explicit Random(uint64_t seed) : bits_(seed) {}
  double within(double a, double b) { return a + (b - a) * (double(bits_() >> 11) * 0x1p-53); }
  double scale(double a, double b) { return a * std::pow(b / a, within(0, 1)); }
  uint32_t below(uint32_t n) { return uint32_t(bits_() % n); }

 private:
  std::mt19937_64 bits_;
};

inline void box(dfm_world w) {
  constexpr double kHalf = 0.15, kS = 0.70710678118654752;
  add_plane(w, "floor");
  const double normal[4][2] = {{-1, 0}, {0, -1}, {1, 0}, {0, 1}};
  for (int k = 0; k < 4; ++k)
    add_plane(w, ("wall " + std::to_string(k)).c_str(), {-kHalf * normal[k][0], -kHalf * normal[k][1], 0},
              {-kS * normal[k][1], kS * normal[k][0], 0, kS});
}

// Friction up to mu 2, and bristles from soft to nearly rigid where the law has them.
inline void law(dfm_world w, const std::string &name, Random &r) {
  const double mu = r.within(0.1, 2), sigma0 = r.scale(1e6, 1e11);
  LawValues values;
  if (name != "none") values.push_back({"mu", mu});
  if (name == "dahl" || name == "lugre" || name == "elastoplastic") values.push_back({"sigma0", sigma0});
  ok(add_friction(w, name.c_str(), values));
}

inline void bodies(dfm_context *c, dfm_world w, uint32_t n, Random &r) {
  const double young = r.scale(1e4, 2e5), damping = r.scale(1e-4, 1e-2);
  for (uint32_t i = 0; i < n; ++i) {
    BodyOptions o;
    o.name = "body " + std::to_string(i);
    o.young = young * r.scale(0.5, 2);
    o.poisson = r.within(0.1, 0.4);
    o.volume = r.within(0.3, 1);
    o.damping_stiffness = damping;
    o.damping_mass = r.within(0, 5);
    double q[4], size = 0;
    for (double &x : q) {
      x = r.within(-1, 1);
      size += x * x;
    }
    for (int k = 0; k < 4; ++k) o.rotation[size_t(k)] = q[k] / std::sqrt(size);
    const double side = r.within(0.03, 0.07);
    o.position = {r.within(-0.06, 0.06), r.within(-0.06, 0.06), 0.06 + 0.1 * i};
    o.velocity = {r.within(-2, 2), r.within(-2, 2), r.within(-3, 0)};
    o.spin = {r.within(-5, 5), r.within(-5, 5), r.within(-5, 5)};
    const uint32_t kind = r.below(3), cells = 15 + r.below(30);
    if (kind == 0)
      make_body(c, w, "beam", {side, side * r.within(0.5, 1), side * r.within(0.5, 1)}, cells, o);
    else if (kind == 1) make_body(c, w, "ball", {0.5 * side, 0, 0}, cells, o);
    else make_body(c, w, "cylinder", {0.4 * side, side, 0}, cells, o);
  }
}

inline Result walk(const std::string &name, uint64_t seed, uint64_t steps, double h, uint32_t most = 20) {
  Random r(seed);
  Context context;
  const dfm_world w = make_world(context);
  Result out;
  out.bodies = 5 + r.below(most - 4);
  box(w);
  law(w, name, r);
  bodies(context, w, out.bodies, r);
  for (; out.steps < steps; ++out.steps)
    if (dfm_world_step(w, h, nullptr) != DFM_OK) {
      out.failure = dfm_last_error();
      break;
    }
  const dfm_world_stats s = stats(w);
  out.substeps = s.substeps;
  out.unconverged = s.unconverged;
  out.guard = s.guard_steps;
  return out;
}

}  // namespace test::pile
