#include "step/step_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "dynamics/symplectic_euler.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/spring.h"
#include "state/world.h"
#include "step/first_failure.h"

namespace dfm {
namespace {

// The bound depends on the state (volume terms stiffen as cells grow, tilted springs as they stretch). 0.9 of
// it is used, which pays for what a shape changes by about a twentieth of its lengths; so it is asked for
// again after 16 sub-steps, sooner where the edges stretch faster.
constexpr uint32_t kBoundEvery = 16;
constexpr double kBoundStrain = 0.05;

uint32_t inverted_cells(const Body &b) {
  return points_kernels().inverted(uint32_t(b.tets.size() / 4), b.tets.data(), b.p.x.data());
}

// False: its model gives none.
bool ask_bound(const World &w, Body &b) {
  // of points that are late nobody knows until they are asked for
  b.bound = {true, {}, b.dynamics->late() ? 0 : inverted_cells(b)};
  const auto springs = [&b](double *stiffness, double *damping) {
    for (const Spring &spring : b.springs) add_spring_bound(spring, stiffness, damping);
  };
  return b.dynamics->bound(w.time, springs, b.bound.found);
}

// Who sleeps keeps what it had.
bool keeps(const Body &b) { return b.slumber.asleep && b.bound.known; }

// Each body by itself; no worker is woken for a world that sleeps.
void ask_bounds(World &w) {
  if (std::ranges::all_of(w.bodies, [](const auto &b) { return keeps(*b); })) return;
  FirstFailure failed;
  w.context->tasks.parallel_for(static_cast<uint32_t>(w.bodies.size()), 1, [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      Body &b = *w.bodies[i];
      if (keeps(b)) continue;
      const OnBehalf speaks(b.name);
      if (!ask_bound(w, b)) failed.note(i);
    }
  });
  if (failed.body == kNone) return;
  const Body &b = *w.bodies[failed.body];
  fail(DFM_E_FATAL, "model '%s' of body '%s' gives no step bound", b.model.type->id, b.name.c_str());
}

}  // namespace

bool bound_due(const World &w) { return w.bound.age >= kBoundEvery; }

void update_bound(World &w) {
  w.bound.step = std::numeric_limits<double>::infinity();
  w.bound.body = nullptr;
  w.bound.point = 0;
  w.bound.inverted = 0;
  uint32_t limited = 0;
  double fastest = 0;
  ask_bounds(w);
  for (auto &b : w.bodies) {
    // who sleeps has a step too, which must not change when it wakes, and stretches no edge
    if (!b->slumber.asleep) fastest = std::max(fastest, b->bound.found.strain_rate);
    w.bound.inverted += b->bound.inverted;
    limited += b->model.limited_cells();
    const StepBound &found = b->bound.found;
    if (found.step < w.bound.step) {
      w.bound.step = found.step;
      w.bound.body = b.get();
      w.bound.point = found.point;
    }
  }
  w.bound.step *= kBoundShare;
  w.stats.stable_step = w.bound.step;
  w.stats.inverted_max = std::max(w.stats.inverted_max, w.bound.inverted);
  w.stats.limited_max = std::max(w.stats.limited_max, limited);
  const double keeps = kBoundStrain / (fastest * w.bound.step);  // sub-steps
  w.bound.age =
      keeps >= kBoundEvery || !(fastest > 0) ? 0 : kBoundEvery - static_cast<uint32_t>(std::max(1.0, keeps));
}

}  // namespace dfm
