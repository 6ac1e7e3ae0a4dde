#include "scene/long_step.h"

#include <algorithm>
#include <cmath>

#include "plugin/context.h"

namespace dfm::scene {
namespace {

// Of its size, that a body may fall in a step from rest. A ball of 3,000 cells of corotational_fem and 0.1 mm
// radius takes 3 s of processor time for 1/60 s at 3.9 sizes, and 0.4 s in steps of 0.014.
constexpr double kFall = 1;
// That it falls in the step that is proposed.
constexpr double kShort = 0.01;

// m, diagonal of the box around the points; 0 where some are held, so that it does not fall.
double size_of_free(const dfm::Body &b) {
  Vec3 lo = load3(b.p.x.data()), hi = lo;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    if (b.p.held[i]) return 0;
    const Vec3 x = load3(&b.p.x[size_t{kStride} * i]);
    lo = {std::min(lo.x, x.x), std::min(lo.y, x.y), std::min(lo.z, x.z)};
    hi = {std::max(hi.x, x.x), std::max(hi.y, x.y), std::max(hi.z, x.z)};
  }
  return norm(hi - lo);
}

}  // namespace

void tell_long_step(dfm_context *context, const World &world, double step) {
  const double g = norm(world.gravity.now), fall = 0.5 * g * step * step;
  if (!(fall > 0) || !world.plan.touches()) return;
  for (const auto &b : world.bodies) {
    if (!b || b->integrator.used == DFM_INTEGRATOR_SYMPLECTIC_EULER || b->model.stepper) continue;
    const double size = size_of_free(*b);
    if (!(size > 0) || fall <= kFall * size) continue;
    context->logf(DFM_LOG_WARNING,
                  "body '%s' is %.3g m in size and falls %.3g m in a step of %.3g s: landing takes many "
                  "sub-steps and most of the time; take a time.step of %.2g s, or \"auto\"",
                  b->name.c_str(), size, fall, step, std::sqrt(2 * kShort * size / g));
    return;  // one sentence for the scene
  }
}

}  // namespace dfm::scene
