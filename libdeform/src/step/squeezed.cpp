#include "step/squeezed.h"

#include <algorithm>
#include <utility>

#include "math/elementary.h"
#include "plugin/context.h"
#include "state/world.h"

namespace dfm {
namespace {

// Of Young's modulus: where a body loses half of its height (world/rest_loads.cpp).
constexpr double kFlat = 0.5;
// A body under a uniform pressure p loses the share p/E of its height: a tenth at this modulus over p.
constexpr double kHolds = 10;
// s, of the running mean: in an impact a body may be pressed flat and come back. A look counts for no more
// than this share.
constexpr double kLasts = 0.3, kMostShare = 0.25;

// Pa: what touches a body presses from two sides, each with half of the forces, on a cube of its volume.
// Forces that point away from its middle pull.
double mean_pressure(const Body &b) {
  const double h = b.impulse_time();
  if (!(h > 0 && b.rest_volume > 0)) return 0;
  Vec3 middle;
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) middle += load3(&b.surface.x[size_t{kStride} * s]);
  middle = (1.0 / b.surface.nsurfel) * middle;
  double sum = 0;
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
    const Vec3 q = load3(&b.surfel_impulse[3 * size_t{s}]);
    if (dot(q, middle - load3(&b.surface.x[size_t{kStride} * s])) > 0) sum += norm(q);
  }
  const double side = dfm_pow(b.rest_volume, 1.0 / 3);
  return 0.5 * sum / h / (side * side);
}

}  // namespace

void tell_squeezed(World &w) {
  for (auto &one : w.bodies) {
    Body &b = *one;
    if (b.squeezed.told || b.slumber.asleep || b.surfel_impulse.empty()) continue;
    // The sides of a cut, and pieces, press on each other in ways that this sum says nothing of.
    if (b.shape != 0 || b.piece_of != 0) continue;
    const double young = b.young();
    if (!(young > 0)) continue;
    Squeezed &s = b.squeezed;
    const double gone = w.time - std::exchange(s.at, w.time),
                 share = std::clamp(gone / kLasts, 0.0, kMostShare);
    s.pressure += share * ((w.report.n > 0 ? mean_pressure(b) : 0) - s.pressure);
    if (!(s.pressure > std::max(kFlat * young, s.weight))) s.since = w.time;
    if (w.time - s.since < kLasts) continue;
    s.told = true;
    w.context->logf(
        DFM_LOG_WARNING,
        "body '%s' is pressed flat: the things that touch it press with %.3g Pa on average (half of "
        "its contact forces over volume^(2/3)), above half its Young's modulus of %.3g Pa; give it a "
        "stiffer material (\"young\": %.2g loses about 10 %% of its height), or let lighter things "
        "press on it",
        b.name.c_str(), s.pressure, young, kHolds * s.pressure);
  }
}

}  // namespace dfm
