#include "world/own_weight.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "plugin/context.h"
#include "state/world.h"

namespace dfm {
namespace {

// Pa, of all cells; 0: the model has no such parameter.
double largest_young(const Body &b) {
  for (const CellField &f : b.fields)
    if (f.key == "young") return *std::max_element(f.values.begin(), f.values.end());
  size_t at = 0;
  for (uint32_t i = 0; i < b.model.type->nparam; at += b.model.type->params[i++].width)
    if (!std::strcmp(b.model.type->params[i].key, "young")) return b.model.params[at];
  return 0;
}

// Of Young's modulus. Cubes of 400 cells that are put on a floor (msm, corotational_fem, Poisson's ratio 0.3)
// lose up to a third of their height at 0.4 and half of it at 0.7, where cells turn inside out.
constexpr double kCollapses = 0.5;

}  // namespace

void warn_of_own_weight(const World &w, const Body &b) {
  const Vec3 down = w.gravity.now;
  const double g = norm(down), young = largest_young(b);
  if (!(g > 0) || !w.gravity.keys.empty() || !(young > 0)) return;
  double lo = INFINITY, hi = -INFINITY;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const double depth = dot(load3(&b.p.x[size_t{kStride} * i]), down) / g;
    lo = std::min(lo, depth);
    hi = std::max(hi, depth);
  }
  const double weight = b.mass / b.rest_volume * g * (hi - lo);
  if (weight > kCollapses * young)
    w.context->logf(
        DFM_LOG_WARNING,
        "body '%s' is %.3g m high, and the pressure of its own weight (density x gravity x height = %.3g Pa) "
        "is above half its Young's modulus of %.3g Pa, so it collapses; if its mesh is in millimeters, "
        "multiply the points by 0.001 (in a scene: \"scale\": 0.001 in its \"pose\"); if it is not, give "
        "it a stiffer material",
        b.name.c_str(), hi - lo, weight, young);
}

}  // namespace dfm
