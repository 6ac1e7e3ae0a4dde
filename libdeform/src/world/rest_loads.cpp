#include "world/rest_loads.h"

#include <algorithm>
#include <cmath>

#include "plugin/context.h"
#include "state/spring.h"
#include "state/world.h"

namespace dfm {
namespace {

// Of Young's modulus. Cubes of 400 cells that are put on a floor (msm, corotational_fem, Poisson's ratio 0.3)
// lose up to a third of their height at 0.4 and half of it at 0.7, where cells turn inside out.
constexpr double kCollapses = 0.5;
// A column loses the share p/(2 E) of its height under its own weight, p the pressure at its foot: a
// twentieth at this modulus over p.
constexpr double kHolds = 10;

Vec3 mean_of(const Body &b, const Spring &s) {
  Vec3 x;
  for (size_t i = 0; i < s.points.size(); ++i) x += s.weights[i] * b.p.x_at(s.points[i]);
  return x;
}

}  // namespace

void loads_at_rest(const World &w, const Body &b, double *f) {
  const Phyxels &p = b.p;
  for (size_t i = 0; i < p.n; ++i)
    for (size_t k = 0; k < 3; ++k)
      f[i * kStride + k] = p.load[i * kStride + k] + p.mass[i] * w.gravity.now[int(k)];
  for (const Spring &s : b.springs) {
    const Vec3 pull = s.stiffness * (spring_end(s, w.time) - mean_of(b, s));
    for (size_t i = 0; i < s.points.size(); ++i) add3(f + size_t(s.points[i]) * kStride, s.weights[i] * pull);
  }
}

std::vector<double> softness_of(const Body &b) {
  std::vector<double> softness(b.p.n), damping(b.p.n);
  for (const Spring &s : b.springs) add_spring_bound(s, softness.data(), damping.data());
  return softness;
}

void warn_of_own_weight(const World &w, Body &b) {
  const Vec3 down = w.gravity.now;
  const double g = norm(down), young = b.young();
  if (!(g > 0) || !w.gravity.keys.empty() || !(young > 0)) return;
  double lo = INFINITY, hi = -INFINITY;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const double depth = dot(b.p.x_at(i), down) / g;
    lo = std::min(lo, depth);
    hi = std::max(hi, depth);
  }
  const double weight = b.mass / b.rest_volume * g * (hi - lo);
  if (!(weight > kCollapses * young)) return;
  b.squeezed.weight = weight;
  w.context->warn(b,
                  " is %.3g m high, and the pressure of its own weight (density x gravity x height = %.3g "
                  "Pa) is above half its Young's modulus of %.3g Pa, so it collapses; if its mesh is in "
                  "millimeters, multiply the points by 0.001 (in a scene: \"scale\": 0.001 in its \"pose\"); "
                  "if it is not, give it a stiffer material (\"young\": %.2g loses about 5 %% of its height)",
                  hi - lo, weight, young, kHolds * weight);
}

}  // namespace dfm
