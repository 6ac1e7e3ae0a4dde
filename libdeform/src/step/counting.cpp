#include "step/counting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "core/error.h"
#include "dynamics/relative_work.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/turn_integrators.h"

namespace dfm {
namespace {

constexpr double kTry = 1.0 / 30;    // s of explicit integration, whose work a trial may cost
constexpr double kPutBy = 0.25;      // share of explicit work that is saved for the next trial
constexpr double kMost = 4;          // largest credit, in trials
constexpr double kSafeShare = 0.25;  // of the limit on sub-steps
// A host that gives the length of its steps waits for each of them: an implicit step may not count more than
// so many times the explicit work of the same time, whatever was saved before.
constexpr double kMostOfAStep = 3;
constexpr double kFilled = 1e300;  // units, for a step without limit

bool is(const Body &b, Counted what) { return b.integrator.counted == what; }
bool any(const World &w, Counted what) {
  return std::ranges::any_of(w.bodies, [&](const auto &b) { return is(*b, what); });
}

// Units of one explicit sub-step of all awake bodies, or of those that are explicit now.
double units(const World &w, bool all) {
  double sum = 0;
  for (const auto &b : w.bodies)
    if (!b->slumber.asleep && (all || !is(*b, Counted::implicit))) sum += double(b->p.n) + double(b->ncell());
  return sum;
}

// s, the sub-step if all bodies were explicit.
double explicit_step(const World &w) {
  double least = w.bound.step;
  for (const auto &b : w.bodies)
    if (!is(*b, Counted::no) && !b->slumber.asleep) least = std::min(least, b->integrator.step);
  return least;
}

// Whether a step may be divided into explicit sub-steps of h. Their number grows while shapes change, and
// near the limit on sub-steps implicit integration would have to take over during the motion. So it may not
// be near the limit, unless the library chooses the steps, since the next one will be short.
bool chosen_here(const World &w, double dt) { return dt == accurate_step(w.sizes); }
bool may_be_cut(const World &w, double dt, double h) {
  const double n = dt / h;
  return n <= kSafeShare * w.def.max_substeps || (chosen_here(w, dt) && n <= w.def.max_substeps);
}

double effort(const World &w) {
  double sum = 0;
  for (const auto &b : w.bodies) sum += b->dynamics->effort();
  return sum;
}

// Changes the integrator of all these bodies, or of none.
void turn(World &w, Counted from, Counted to) {
  std::vector<std::pair<Body *, std::unique_ptr<Dynamics>>> made;
  for (const auto &b : w.bodies) {
    if (!is(*b, from)) continue;
    const ImplicitOptions chosen = implicit_choice(w, *b);
    made.emplace_back(b.get(), make_dynamics(w.meters.dynamics.memory(), b->p, b->surface, b->model, b->edges,
                                             to == Counted::implicit ? &chosen : nullptr));
  }
  for (auto &[b, dynamics] : made) {
    b->dynamics.swap(dynamics);
    b->integrator.counted = to;
    b->integrator.used = to == Counted::explicitly             ? DFM_INTEGRATOR_SYMPLECTIC_EULER
                         : implicit_choice(w, *b).second_order ? DFM_INTEGRATOR_TR_BDF2
                                                               : DFM_INTEGRATOR_IMPLICIT_EULER;
    b->bound.known = false;
  }
  if (made.empty()) return;
  ++w.integrator_times.changes;
  w.context->logf(DFM_LOG_INFO, "%s integrated by %s from %g s on, because counted work is less that way",
                  names_of(made[0].first->name, made.size()).c_str(),
                  to == Counted::explicitly ? "symplectic_euler" : "implicit steps", w.time);
  w.changed = true;
  w.sizes = {};  // another bound, and other errors
}

}  // namespace

std::string names_of(const std::string &first, size_t count) {
  if (count == 1) return format("body '%s' is", first.c_str());
  return format("body '%s' and %zu more are", first.c_str(), count - 1);
}

ImplicitOptions implicit_choice(const World &w, const Body &b) {
  ImplicitOptions out = w.implicit;
  out.second_order = out.newton != 1 || b.model.can(DFM_CAP_CONSTANT_STIFFNESS);
  return out;
}

void begin_count(World &w, StepContext &step, double dt) {
  Counting &c = step.counting = {};
  if (w.prescribed.stands() || !(any(w, Counted::implicit) || any(w, Counted::explicitly))) return;
  const double h = explicit_step(w);
  if (!(h > 0 && std::isfinite(h))) return;
  c.on = true;
  c.before = effort(w);
  if (!w.purse.open) w.purse = {1, 0, kTry / h * units(w, true)};
  if (!any(w, Counted::implicit) || !may_be_cut(w, dt, h)) return;
  const double same = dt / h * units(w, true);
  c.most = same + std::max(0.0, w.purse.units);
  if (!chosen_here(w, dt)) c.most = std::min(c.most, kMostOfAStep * same);
  c.most *= kUnitWork;
}

double body_effort(const World &w, const StepContext &step) { return effort(w) - step.counting.before; }

void give_up_implicit(World &w) {
  turn(w, Counted::implicit, Counted::explicitly);
  w.purse.units = 0;
  w.purse.tries = std::min(w.purse.tries + 1, kMostTries);
}

bool may_take_up_implicit(const World &w) {
  return std::ranges::any_of(
      w.bodies, [](const auto &b) { return is(*b, Counted::explicitly) && b->model.can(DFM_CAP_STIFFNESS); });
}

void take_up_implicit(World &w) {
  for (const auto &b : w.bodies)  // parameters may have changed
    if (is(*b, Counted::explicitly) && !b->model.can(DFM_CAP_STIFFNESS)) b->integrator.counted = Counted::no;
  turn(w, Counted::explicitly, Counted::implicit);
  w.purse.units = kFilled;
}

void end_count(World &w, StepContext &step, double dt, double substeps) {
  const Counting &c = step.counting;
  if (!c.on) return;
  w.integrator_times.all += dt;
  if (any(w, Counted::implicit)) w.integrator_times.implicit += dt;
  IntegratorPurse &purse = w.purse;
  const double h = explicit_step(w), all = units(w, true), one = kTry / h * all;
  if (any(w, Counted::implicit)) {
    const double taken = (body_effort(w, step) + c.contact) / kUnitWork + substeps * units(w, false);
    purse.units = std::min(purse.units + dt / h * all - taken, kMost * one);
    if (purse.units == kMost * one) purse.tries = 0;
    if (purse.units < 0 && c.most > 0) give_up_implicit(w);
    return;
  }
  purse.units += kPutBy * substeps * all;
  if (purse.units < std::ldexp(one, int(purse.tries))) return;
  take_up_implicit(w);
  purse.units = one;
}

}  // namespace dfm
