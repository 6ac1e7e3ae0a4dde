#include "step/counting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "contact/reach.h"
#include "core/error.h"
#include "dynamics/relative_work.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/turn_integrators.h"

namespace dfm {
namespace {

// s of explicit time, by its work:
constexpr double kTry = 1.0 / 30;    // what a trial may cost
constexpr double kFirst = 2 * kTry;  // credit at the start
constexpr double kMost = 4 * kTry;   // largest credit
constexpr double kPutBy = 0.25;      // share of explicit time that is saved for the next trial
// A host that gives the length of its steps waits for each of them: an implicit step may count this share of
// the explicit work of the same time, whatever was saved before.
constexpr double kShareOfAStep = 0.5;
constexpr double kSafeShare = 0.25;  // of the limit on sub-steps
constexpr double kFilled = 1e300;    // s, for a step without limit

bool is(const Body &b, Counted what) { return b.integrator.counted == what; }
bool any(const World &w, Counted what) {
  return std::ranges::any_of(w.bodies, [&](const auto &b) { return is(*b, what); });
}

// Units of one explicit sub-step of all awake bodies, or of those that are explicit now.
double units(const World &w, bool all) {
  double sum = 0;
  for (const auto &b : w.bodies)
    if (!b->slumber.asleep && (all || !is(*b, Counted::implicit)))
      sum += units_of_a_cell(b->model.type->id) * (double(b->p.n) + double(b->ncell()));
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
  if (!w.allowance.open) w.allowance = {1, 0, kFirst};
  if (!any(w, Counted::implicit) || !may_be_cut(w, dt, h)) return;
  c.most_time = chosen_here(w, dt) ? dt + std::clamp(w.allowance.credit, 0.0, kMost) : kShareOfAStep * dt;
  c.most_touching = kUnitWork * c.most_time / h;
  c.most = c.most_touching * units(w, true);
}

// Explicit sub-steps are so short that they have contacts only where surfaces are as near as at rest.
void count_contacts(const World &w, StepContext &step) {
  Counting &c = step.counting;
  if (!c.on) return;
  double all = 0, near = 0;
  for (const ContactPoint &p : step.contacts) {
    const double units = p.obstacle ? kObstacleContactUnits : kBodyContactUnits;
    all += units;
    if (p.distance < contact_reach(0, w.offset, 0)) near += units;
  }
  c.touching = near;
  c.contact += kUnitWork * all;
}

bool costs_too_much(const Counting &c, double multiplications) {
  return c.most > 0 && multiplications > c.most + c.most_touching * c.touching;
}

double body_effort(const World &w, const StepContext &step) { return effort(w) - step.counting.before; }

void give_up_implicit(World &w, double time) {
  turn(w, Counted::implicit, Counted::explicitly);
  IntegratorAllowance &allowance = w.allowance;
  allowance.credit -= time;
  if (allowance.credit > 0) {  // this step cost too much, which says little about the next
    allowance.lost = std::min(allowance.lost + time, kMost);
    allowance.credit = std::min(allowance.credit, kTry - (allowance.lost - time));
    return;
  }
  allowance.credit = 0;
  allowance.tries = std::min(allowance.tries + 1, kMostTries);
}

bool may_take_up_implicit(const World &w) {
  return std::ranges::any_of(
      w.bodies, [](const auto &b) { return is(*b, Counted::explicitly) && b->model.can(DFM_CAP_STIFFNESS); });
}

void take_up_implicit(World &w) {
  for (const auto &b : w.bodies)  // parameters may have changed
    if (is(*b, Counted::explicitly) && !b->model.can(DFM_CAP_STIFFNESS)) b->integrator.counted = Counted::no;
  turn(w, Counted::explicitly, Counted::implicit);
  w.allowance.credit = kFilled;
}

void end_count(World &w, StepContext &step, double dt, double substeps) {
  const Counting &c = step.counting;
  if (!c.on) return;
  w.integrator_times.all += dt;
  if (any(w, Counted::implicit)) w.integrator_times.implicit += dt;
  IntegratorAllowance &allowance = w.allowance;
  if (any(w, Counted::implicit)) {
    const double rate = (units(w, true) + c.touching) / explicit_step(w);  // units of explicit time in 1 s
    const double taken = (body_effort(w, step) + c.contact) / kUnitWork + substeps * units(w, false);
    const double saved = dt - (rate > 0 ? taken / rate : 0);
    allowance.credit = std::min(allowance.credit + saved, kMost);
    allowance.lost = std::max(0.0, allowance.lost - std::max(0.0, saved));
    if (allowance.credit == kMost) allowance.tries = 0;
    if (allowance.credit < 0 && c.most > 0) give_up_implicit(w, 0);
    return;
  }
  allowance.credit += kPutBy * dt;
  if (allowance.credit < std::ldexp(kTry, int(allowance.tries))) return;
  const double left = allowance.tries > 0 ? kTry : allowance.credit;
  take_up_implicit(w);
  allowance.credit = left;
}

}  // namespace dfm
