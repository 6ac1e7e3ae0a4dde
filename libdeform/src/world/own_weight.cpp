#include "world/own_weight.h"

#include <algorithm>
#include <cmath>

#include "plugin/context.h"
#include "state/world.h"

namespace dfm {
namespace {

// Of Young's modulus. Cubes of 400 cells that are put on a floor (msm, corotational_fem, Poisson's ratio 0.3)
// lose up to a third of their height at 0.4 and half of it at 0.7, where cells turn inside out.
constexpr double kCollapses = 0.5;
// A column loses the share p/(2 E) of its height under its own weight, p the pressure at its foot: a
// twentieth at this modulus over p.
constexpr double kHolds = 10;

}  // namespace

void warn_of_own_weight(const World &w, Body &b) {
  const Vec3 down = w.gravity.now;
  const double g = norm(down), young = b.young();
  if (!(g > 0) || !w.gravity.keys.empty() || !(young > 0)) return;
  double lo = INFINITY, hi = -INFINITY;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const double depth = dot(load3(&b.p.x[size_t{kStride} * i]), down) / g;
    lo = std::min(lo, depth);
    hi = std::max(hi, depth);
  }
  const double weight = b.mass / b.rest_volume * g * (hi - lo);
  if (!(weight > kCollapses * young)) return;
  b.squeezed.weight = weight;
  w.context->logf(
      DFM_LOG_WARNING,
      "body '%s' is %.3g m high, and the pressure of its own weight (density x gravity x height = %.3g Pa) "
      "is above half its Young's modulus of %.3g Pa, so it collapses; if its mesh is in millimeters, "
      "multiply the points by 0.001 (in a scene: \"scale\": 0.001 in its \"pose\"); if it is not, give "
      "it a stiffer material (\"young\": %.2g loses about 5 %% of its height)",
      b.name.c_str(), hi - lo, weight, young, kHolds * weight);
}

}  // namespace dfm
