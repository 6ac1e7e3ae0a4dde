#include "step/impact.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "math/vec3.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/sides.h"
#include "step/solve/restitution.h"
#include "step/stages.h"

namespace dfm {
namespace {

// A body in contact has an impact if its mean velocity changes by more than so many times what gravity makes
// in the sub-step, if that is more than this share of an edge in way (ten times the error that the steps of
// implicit bodies are allowed), and if the points lose more than this share of what a perfectly inelastic
// impact takes. At rest the mean velocity stays, and friction on a slope or in a slide changes it by about
// gravity's part.
constexpr double kWeights = 2, kWay = 0.05, kLost = 0.5;
// How long an impact may last, in the explicit steps of the body for each edge along it. A sphere is in
// contact for 2.3 (c/v)^(1/5) times the time that a wave takes through it (Hertz), at most 9 times for speeds
// v above a thousandth of the wave speed c, and an edge takes a wave up to four stable steps.
constexpr double kEdges = 36;
constexpr double kSame = 1e-6;  // relative: a step of the announced length

bool is_implicit(const Body &b) { return b.integrator.chosen == Chosen::implicit && !b.sleep_state.asleep; }

bool touched(const Body &b) {
  return std::ranges::any_of(b.surfel_impulse, [](double p) { return p != 0; });
}

// speed: m/s, out, at which it comes: of its mean velocity, or the change of that, if it is hit.
bool in_impact(const World &w, const StepContext &step, const Body &b, double &speed) {
  const double *const end = b.dynamics->end().v;
  Vec3 gained, came;
  double mass = 0, lost = 0;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const Vec3 from = load3(&b.p.v[size_t{kStride} * i]), to = load3(&end[size_t{kStride} * i]);
    came += b.p.mass[i] * from;
    gained += b.p.mass[i] * (to - from);
    lost += 0.5 * b.p.mass[i] * (norm2(from) - norm2(to));
    mass += b.p.mass[i];
  }
  const double change = norm((1 / mass) * gained);
  speed = std::max(change, norm((1 / mass) * came));
  return change > kWeights * step.h * norm(w.gravity.now) && step.h * change > kWay * b.surface.median_edge &&
         lost > kLost * 0.5 * mass * (change * change);
}

bool damps(const Body &b) {
  return !b.model.stepper && !b.sleep_state.asleep && b.integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER;
}

// Once per world: the body keeps nothing of the speed at which it came.
void warn_impact(World &w, const StepContext &step, const Body &b, double speed) {
  const ContactPoint *at = nullptr;  // where it presses most
  double most = 0;
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    const double normal = step.rows.impulse[size_t(3) * i];
    if (!is_side(c, b.slot) || !(normal > most)) continue;
    most = normal;
    at = &c;
  }
  if (!at) return;
  w.integrator_times.reported_impact = true;
  const uint64_t a = w.bodies[at->slot_a]->id;
  const std::string &other = name_of(w, a == b.id ? id_of_b(w, *at) : a);
  w.context->warn(
      b,
      " falls on '%s' at %.3g m/s (t = %.4g s) and will not rebound: %s; give the pair a restitution, move "
      "the body by symplectic_euler, or take steps much shorter than the impact",
      other.c_str(), speed, w.time, why_no_rebound(b.integrator.used));
}

// Changes the integrator of all bodies of this choice, or of none. Returns how many.
size_t turn(World &w, Chosen from, Chosen to) {
  std::vector<std::pair<Body *, std::unique_ptr<Dynamics>>> made;
  for (const auto &b : w.bodies) {
    if (b->integrator.chosen != from) continue;
    const ImplicitOptions implicit = implicit_choice(w, *b);
    made.emplace_back(b.get(), make_dynamics(w.meters.dynamics.memory(), b->p, b->surface, b->model, b->edges,
                                             to == Chosen::implicit ? &implicit : nullptr));
  }
  if (made.empty()) return 0;
  save_start(w, *w.steps);  // dampers
  for (auto &[b, dynamics] : made) {
    b->dynamics.swap(dynamics);
    b->integrator.chosen = to;
    b->integrator.used =
        to == Chosen::in_impact ? uint32_t{DFM_INTEGRATOR_SYMPLECTIC_EULER} : implicit_integrator(w, *b);
    b->bound.known = false;
    b->relax_dampers();
  }
  ++w.integrator_times.changes;
  w.changed = true;
  w.sizes = {};  // another bound, and other errors
  return made.size();
}

}  // namespace

const char *why_no_rebound(uint32_t integrator) {
  return integrator == DFM_INTEGRATOR_TR_BDF2
             ? "tr_bdf2, which is backward Euler in contact, damps an impact that its step does not resolve"
             : "implicit_euler damps an impact that its step does not resolve";
}

bool chosen_by_library(const World &w, double dt) {
  return !(std::fabs(dt - w.def.step) <= kSame * w.def.step) && dt <= accurate_step(w.sizes);
}

bool has_impact(World &w, const StepContext &step) {
  if (!w.plan.touches() || step.rows.soft() == 0 || w.prescribed.is_static()) return false;
  for (const uint32_t i : step.active) {
    const Body &b = *w.bodies[i];
    const bool repeats =
        step.offered > 0 && is_implicit(b) && step.offered / b.integrator.step <= w.def.max_substeps;
    if (!repeats && (!damps(b) || w.integrator_times.reported_impact)) continue;
    double speed = 0;
    if (!touched(b) || !in_impact(w, step, b, speed) || has_restitution(w, step, b)) continue;
    if (repeats) return true;
    warn_impact(w, step, b, speed);
  }
  return false;
}

void begin_impact(World &w) {
  double lasts = 0;
  for (const auto &b : w.bodies)
    if (is_implicit(*b))
      lasts = std::max(lasts, kEdges * extent_of(b->p.x.data(), b->p.n, kStride).diagonal() /
                                  b->surface.median_edge * b->integrator.step);
  turn(w, Chosen::implicit, Chosen::in_impact);
  w.impact_until = w.time + lasts;
  w.context->logf(DFM_LOG_INFO, "impact of a body: explicit steps until %g s", w.impact_until);
}

bool end_impact(World &w) {
  w.impact_until = 0;
  for (const auto &b : w.bodies)  // parameters may have changed
    if (b->integrator.chosen == Chosen::in_impact && !b->model.can(DFM_CAP_STIFFNESS))
      b->integrator.chosen = Chosen::explicitly;
  return turn(w, Chosen::in_impact, Chosen::implicit) > 0;
}

void undo_impact(World &w, double until) {
  if (w.impact_until > 0 && until == 0) end_impact(w);
  if (w.impact_until == 0 && until > 0) turn(w, Chosen::implicit, Chosen::in_impact);
  w.impact_until = until;
}

void follow_impact(World &w, double dt) {
  if (w.prescribed.is_static()) return;  // no time passes, and the search has its own dynamics
  const auto any = [&](Chosen what) {
    return std::ranges::any_of(w.bodies, [&](const auto &b) { return b->integrator.chosen == what; });
  };
  const bool implicit = any(Chosen::implicit);
  if (implicit || any(Chosen::in_impact)) w.integrator_times.all += dt;
  if (implicit) w.integrator_times.implicit += dt;
  if (w.impact_until > 0 && !(w.time < w.impact_until)) end_impact(w);
}

}  // namespace dfm
