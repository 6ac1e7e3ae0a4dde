#include "step/step_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "dynamics/symplectic_euler.h"
#include "math/elementary.h"
#include "math/turn.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/spring.h"
#include "state/world.h"
#include "step/by_body.h"
#include "step/rigid/rigid.h"
#include "step/sides.h"
#include "step/stages.h"

namespace dfm {

uint32_t inverted_cells(const Body &b) {
  const double *const x = b.p.x.data();
  if (b.cells.empty()) return points_kernels().inverted(b.ncell(), b.tets.data(), x);
  const CellKind &kind = cell_kind(b.cell_type);
  uint32_t n = 0;
  for (size_t c = 0; c < b.cells.size() / kind.nodes; ++c) {
    const uint32_t *const cell = &b.cells[kind.nodes * c];
    n += b.inside.empty() ? inverted_cell(kind, x, kStride, cell)
                          : inverted_inside(x, kStride, cell, &b.inside[kInsidePoints * c]);
  }
  return n * kind.tets;
}

namespace {

// Of Young's modulus: where a body loses half of its height (world/rest_loads.cpp).
constexpr double kFlat = 0.5;
// A body under a uniform pressure p loses the share p/E of its height: a tenth at this modulus over p.
constexpr double kHolds = 10;
// s, of the running mean: in an impact a body may be pressed flat and come back. A look counts for no more
// than this share.
constexpr double kLasts = 0.3, kMaxShare = 0.25;

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

// Warns of bodies that what touches them presses flat: a heavy body on a soft one. Own weight alone is
// reported when a body is made (world/rest_loads.h).
void warn_squeezed(World &w) {
  for (auto &one : w.bodies) {
    Body &b = *one;
    if (b.squeezed.reported || b.sleep_state.asleep || b.surfel_impulse.empty()) continue;
    // The sides of a cut, and pieces, press on each other in ways that this sum says nothing of.
    if (b.cut.whole || b.piece_of != 0) continue;
    const double young = b.young();
    if (!(young > 0)) continue;
    Squeezed &s = b.squeezed;
    const double gone = w.time - std::exchange(s.at, w.time),
                 share = std::clamp(gone / kLasts, 0.0, kMaxShare);
    s.pressure += share * (mean_pressure(b) - s.pressure);
    if (!(s.pressure > std::max(kFlat * young, s.weight))) s.since = w.time;
    if (w.time - s.since < kLasts) continue;
    s.reported = true;
    w.context->warn(
        b,
        " is pressed flat: the things that touch it press with %.3g Pa on average (half of its contact "
        "forces over volume^(2/3)), above half its Young's modulus of %.3g Pa; give it a stiffer material "
        "(\"young\": %.2g loses about 10 %% of its height), or let lighter things press on it",
        s.pressure, young, kHolds * s.pressure);
  }
}

// The bound depends on the state (volume terms stiffen as cells grow, tilted springs as they stretch). 0.9 of
// it is used, which pays for what a shape changes by about a twentieth of its lengths. So after 16 sub-steps,
// sooner where the edges stretch faster, a check of the rates shows how much of that may be used; where it is
// not, the bound holds on. A look sees rates at one instant, so it counts them for the time before and for
// that to the next look, and every eighth look evaluates the bound again.
constexpr uint32_t kBoundEvery = 16;
constexpr double kMinStrain = kBoundStrain / 8;
constexpr uint32_t kMaxEstimated = 4;  // sub-steps at an estimated bound

void check_shape(Body &b) {
  // points that are updated late are unknown until they are requested
  b.bound.inverted = b.dynamics->abilities().late ? 0 : inverted_cells(b);
  // a rigid turn stretches no edge
  const bool follows = !b.sleep_state.asleep && b.dynamics->unknowns().diagonal && b.model.ops->bound;
  b.bound.strain_rate = follows ? points_kernels().strain_rate(uint32_t(b.edges.size() / 2), b.edges.data(),
                                                               b.p.x.data(), b.p.v.data())
                                : 0;
}

// False: its model gives none.
bool query_bound(const World &w, Body &b) {
  b.bound.known = true;
  b.bound.found = {};
  const auto springs = [&b](double *stiffness, double *damping) {
    for (const Spring &spring : b.springs) add_spring_bound(spring, stiffness, damping);
  };
  if (!b.dynamics->bound(w.time, b.integrator.share, springs, b.bound.found)) return false;
  if (b.model.stepper && !b.bound.near) b.bound.found = {};  // alone it takes any step
  return true;
}

void find_near(World &w) {
  if (!any_bounds_contact(w)) return;
  for (auto &b : w.bodies) b->bound.near = false;
  each_body_held(w, [&](uint32_t i) { w.bodies[i]->bound.near = true; });
}

// Who sleeps keeps what it had.
bool keeps(const Body &b) { return b.sleep_state.asleep && b.bound.known; }

// act(body) -> did it answer? Each body that does not keep what it had by itself; no worker is woken for a
// world that sleeps. Throws Error for the first body, in id order, that did not.
template <class Act>
void update_each(World &w, const Act &act) {
  if (std::ranges::all_of(w.bodies, [](const auto &b) { return keeps(*b); })) return;
  each_on(&w.context->tasks, w.bodies.size(), 1, [&](size_t i) {
    Body &b = *w.bodies[i];
    if (keeps(b)) return;
    const OnBehalf prefix(b.name);
    if (!act(b))
      fail(DFM_E_FATAL, "model '%s' of body '%s' gives no step bound", b.model.type->id, b.name.c_str());
  });
}

// Strain of the edge that stretches fastest until the next look. Who sleeps has a step too, which must not
// change when it wakes, and stretches no edge.
double strain_of_16(const World &w) {
  double fastest = 0;
  for (const auto &b : w.bodies)
    if (!b->sleep_state.asleep) fastest = std::max(fastest, b->bound.strain_rate);
  return fastest > 0 ? std::min(1.0, fastest * w.bound.step * kBoundEvery) : 0;
}

uint32_t count_inverted(const World &w) {
  uint32_t sum = 0;
  for (const auto &b : w.bodies) sum += b->bound.inverted;
  return sum;
}

// Does the bound hold on? What a model keeps as state may change its stiffness in the same shape.
bool holds(World &w) {
  if (w.bound.age == kNone || !std::isfinite(w.bound.step)) return false;
  if (std::ranges::any_of(w.bodies,
                          [](const auto &b) { return !b->sleep_state.asleep && !b->model.state.empty(); }))
    return false;
  const double strain = w.bound.strain + std::max(2 * strain_of_16(w), kMinStrain);
  if (!(strain <= kBoundStrain) || count_inverted(w) != w.bound.inverted) return false;
  w.bound.strain = strain;
  w.bound.age = 0;
  return true;
}

// Sub-steps that count as past where the strain until the next look is more than the bound pays for.
uint32_t age_at_first(double strain) {
  const double checks = kBoundStrain / strain;  // until it is spent
  return checks >= 1 || !(strain > 0)
             ? 0
             : kBoundEvery - static_cast<uint32_t>(std::max(1.0, kBoundEvery * checks));
}

// Strain of an edge of which one end falls freely for n sub-steps of h while the other is held: the speed
// after k sub-steps is g h k, the displacement after n of them g h^2 n (n + 1) / 2.
double strain_of_fall(const World &w, const Body &b, double n) {
  const double h = w.bound.step;
  return norm(w.gravity.now) * h * h / b.surface.median_edge * (0.5 * n * (n + 1));
}

}  // namespace

bool any_bounds_contact(const World &w) {
  return std::ranges::any_of(w.bodies, [](const auto &b) { return b->model.stepper && b->model.ops->bound; });
}

bool gravity_exceeds_bound(const World &w, const Body &b) {
  return w.bound.age + 1 < kBoundEvery && b.dynamics->unknowns().diagonal && std::isfinite(w.bound.step) &&
         strain_of_fall(w, b, kBoundEvery - w.bound.age) > kBoundStrain;
}

void bring_check_forward(World &w, const Body &b) {
  uint32_t n = 1;
  while (strain_of_fall(w, b, n + 1) <= kBoundStrain) ++n;
  w.bound.age = std::max(w.bound.age, kBoundEvery - n);
}

bool bound_expired(const World &w) { return w.bound.age >= kBoundEvery; }

bool bound_is_new(const World &w) { return w.bound.age == age_at_first(w.bound.strain); }

void expire_bound(World &w) { w.bound.age = std::max(w.bound.age, kBoundEvery); }

void update_bound(World &w) {
  update_each(w, [](Body &b) {
    check_shape(b);
    return true;
  });
  warn_squeezed(w);
  if (holds(w)) return;
  w.bound.step = std::numeric_limits<double>::infinity();
  w.bound.body = nullptr;
  w.bound.point = 0;
  uint32_t limited = 0;
  find_near(w);
  update_each(w, [&w](Body &b) { return query_bound(w, b); });
  for (auto &b : w.bodies) {
    limited += b->model.limited_cells();
    const StepBound &found = b->bound.found;
    if (found.step < w.bound.step) {
      w.bound.step = found.step;
      w.bound.body = b.get();
      w.bound.point = found.point;
    }
  }
  w.bound.inverted = count_inverted(w);
  w.bound.step *= kBoundShare;
  w.stats.stable_step = w.bound.step;
  w.stats.inverted_max = std::max(w.stats.inverted_max, w.bound.inverted);
  w.stats.limited_max = std::max(w.stats.limited_max, limited);
  w.bound.strain = strain_of_16(w);
  w.bound.age = age_at_first(w.bound.strain);
}

bool estimate_bound(World &w, const WorldBound &before, double share, double dt) {
  const double step = std::min(share, 1.0) * before.step, n = std::ceil(dt / step - 1e-9);
  if (before.age >= kBoundEvery || !std::isfinite(step) || !(step > 0)) return false;
  if (!(n <= kMaxEstimated)) return false;
  w.bound = before;
  w.bound.step = w.stats.stable_step = step;
  w.bound.strain = kBoundStrain;  // all that the bound allows for, so the next check evaluates it
  w.bound.age = std::max(before.age, kBoundEvery - static_cast<uint32_t>(n));
  return true;
}

}  // namespace dfm
