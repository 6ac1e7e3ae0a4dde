#include "step/watch/energy_watch.h"

#include <algorithm>
#include <cmath>

#include "body/turning.h"
#include "core/error.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/solve/tolerance.h"
#include "step/stages.h"
#include "step/watch/contact_energy.h"

namespace dfm {
namespace {

// An energy costs about as much as two sub-steps.
constexpr uint32_t kEvery = 512;
// So one check in this many sub-steps costs less than 1 %.
constexpr uint32_t kEvaluationCost = 256;
// Share of the energy of the kick: stiff modes return a third of it on average as they decay, and a check
// sees it at one instant.
constexpr double kReturned = 0.5;
// Stiff modes whose energy is all motion show it in the kick within a quarter of their period: the base is
// taken over this time.
constexpr uint32_t kWarmUp = 8;      // sub-steps
constexpr double kRounding = 1e-12;  // of the sums that a balance is the difference of
constexpr double kPositionDigits = 8 * 2.3e-16;
// Share of the largest energy so far that a body that steps itself may gain. What such a model leaves out of
// the motion to keep its step cheap is energy that comes and goes. If its elastic energy is unknown: its
// velocities are means over steps, and the energy of an oscillation that is fast for the step varies with its
// phase.
constexpr double kOwnSteps = 0.25, kHidden = 1;
constexpr char kFlow[] = "deform.plasticity";
constexpr double kNoLimit = 1e300;  // J, of a base: its energy may be anything
// An implicit sub-step costs that much more, so the same share of the time allows as many more checks.
constexpr uint32_t kAges = 32;

bool watching(const Rules &r) { return r.def.energy_watch > 0; }
bool steps_itself(const Body &b) { return b.model.stepper.has_value(); }
// By backward Euler, or by the model itself: the balance is that of the true energy, and what is done counts
// at the end of the sub-step.
bool at_end(const Body &b) { return b.dynamics->abilities().damps || steps_itself(b); }
bool books(const Body &b) { return b.dynamics->abilities().energy || at_end(b); }
// Its elastic energy is unknown, but not below zero: the kinetic energy comes from that at the start and from
// the work done since.
bool hides(const Body &b) { return steps_itself(b) && !b.model.can(DFM_CAP_ENERGY); }
double allowed(const Body &b) { return hides(b) ? kHidden : steps_itself(b) ? kOwnSteps : 0; }
bool watched(const Body &b) { return books(b) && (b.model.can(DFM_CAP_ENERGY) || hides(b)); }
// Loads that change from sub-step to sub-step have no potential: their work is booked as it is done.
bool books_loads(const Body &b) { return b.loads_vary(); }
// TR-BDF2 does the work of what varies along the sub-step, not at its end as it is booked.
// A model that steps itself does not say with what force it is held.
bool unbooked(const World &w, const Body &b) {
  if (steps_itself(b)) return !b.motions.empty();
  return b.dynamics->abilities().parts && (books_loads(b) || !b.motions.empty() || !w.gravity.keys.empty());
}

// The work of the holders of driven points, by the trapezoid of the force: the force at the start of this
// sub-step counts for half of the displacement of the one before, and for half of that in `time`, s, of this
// one.
double work_of_holders(const World &w, const StepContext &step, const Body &b, double time) {
  double sum = 0;
  for (const Driven &d : step.driven) {
    if (d.velocity < b.p.v.data() || d.velocity >= b.p.v.data() + b.p.v.size()) continue;
    const size_t at = size_t(d.velocity - b.p.v.data());
    const double force = b.p.f[at] + b.p.mass[at / kStride] * w.gravity.now[int(at % kStride)] -
                         (books_loads(b) ? b.p.load[at] : 0);
    sum -= 0.5 * force * (w.watch.last_h * d.before + time * *d.velocity);
  }
  return sum;
}

// Another size h of the sub-steps makes of G = .. + v.M v* / 2 another quantity that the scheme keeps, which
// is larger by (h2 - h1) v.f / 2. That is no instability: the changes that the library makes are few, and
// what those of a host bring is taken out by damping (state/step_sizes.h). f is taken from the forces, since
// v* may hold the impulses of contact by now. Pieces that the guard cuts do not count: what they bring they
// take away again.
double work_of_new_size(const World &w, const StepContext &step, const Body &b) {
  if (!(w.watch.size_before > 0 && w.watch.last_h > 0)) return 0;
  const bool load_booked = books_loads(b);
  const Phyxels &p = b.p;
  double sum = 0;
  for (uint32_t i = 0; i < p.n; ++i)
    for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at)
      if (p.moves(at))
        sum += p.v[at] * (p.f[at] + p.mass[i] * w.gravity.now[int(k)] - (load_booked ? p.load[at] : 0));
  return 0.5 * (step.length.planned - w.watch.size_before) * sum;
}

double rounding_of(const Body &b, double h, double potential, double kinetic, double elastic, double reach) {
  const double drift = kPositionDigits * reach / h;
  return kRounding * (std::fabs(b.energy.work) + std::fabs(potential) + kinetic + elastic) +
         b.mass * drift * drift;
}

// For a body whose model sums over its points, so that a check takes no longer than a step.
bool check_sums(const World &w, const StepContext &step, const Body &b, EnergySample &out) {
  if (!steps_itself(b) || hides(b) || books_loads(b)) return false;
  if (std::any_of(b.p.load.begin(), b.p.load.end(), [](double f) { return f != 0; })) return false;
  BodySums sums;
  if (!b.dynamics->sums(sums)) return false;
  const double potential = -dot(w.gravity.now, sums.first);
  out = {sums.kinetic,
         sums.elastic,
         sums.elastic + potential + sums.kinetic - b.energy.work,
         0,
         rounding_of(b, step.h, potential, sums.kinetic, sums.elastic, sums.reach),
         true};
  return true;
}

// The energy that the scheme keeps, U(x) - F.x + v.M v_free / 2, and half of the energy of the kick, by which
// it may rise as stiff modes decay. U of a body that flows is that after the flow at x: what flow
// dissipates is still in U until the sub-step is committed.
bool look(World &w, const StepContext &step, Body &b, EnergySample &out) {
  if (check_sums(w, step, b, out)) return true;
  const Phyxels &p = b.p;
  b.dynamics->see_points();
  const bool load_booked = books_loads(b), ends = at_end(b);
  double kinetic = 0, cross = 0, kick = 0, potential = 0, reach = 0;
  for (uint32_t i = 0; i < p.n; ++i) {
    const size_t at = size_t(i) * kStride;
    const double m = p.mass[i];
    for (size_t k = 0; k < 3; ++k) {
      const double x = p.x[at + k], v = p.v[at + k], load = p.load[at + k];
      reach = std::max(reach, std::fabs(x));
      potential -= (m * w.gravity.now[int(k)] + (load_booked ? 0 : load)) * x;
      if (!p.moves(at + k)) continue;
      kinetic += 0.5 * (m * v * v);
      if (ends) continue;
      const double change = p.v_free[at + k] - v;
      kick += 0.5 * (m * change * change);
      cross += 0.5 * v * (m * p.v_free[at + k] - (load_booked ? step.h * load : 0));
    }
  }
  double elastic = 0;
  dfm_kin kin = b.dynamics->kin(w.time, 0);
  if (!ends && b.model.works(kFlow)) kin.state = b.model.state_out.data();
  const OnBehalf prefix(b.name);
  const auto query = [&] { return b.model.ops->energy(b.model.self, &kin, &elastic); };
  if (!hides(b) && b.model.call("energy", query) != DFM_OK) return false;
  elastic += b.dynamics->damper_energy(w.time);
  // the call came between its prediction and its commit, which may share memory with the result
  double again = 0;
  if (steps_itself(b) && (!hides(b) || b.dynamics->abilities().late) &&
      !b.dynamics->free_motion(sub_step_of(w, w, step), again))
    return false;
  const double half_done = ends ? 0 : work_of_holders(w, step, b, 0) + work_of_new_size(w, step, b);
  out = {kinetic,
         elastic,
         elastic + potential + (ends ? kinetic : cross) - (b.energy.work + half_done),
         kReturned * kick,
         rounding_of(b, step.h, potential, kinetic, elastic, reach),
         true};
  return true;
}

// Each body by itself.
void sum_energies(World &w, StepContext &step) {
  step.samples.resize(step.active.size());
  each_on(&w.context->tasks, step.active.size(), 1, [&](size_t k) {
    Body &b = *w.bodies[step.active[k]];
    step.samples[k].known = watched(b) && look(w, step, b, step.samples[k]);
  });
}

// Books the dofs of contact, and the mean velocities that it does its work at.
void book_contact(World &w, StepContext &step) {
  step.mean.resize(size_t{kStride} * step.rows.ndof);
  for (uint32_t d = 0; d < step.rows.ndof; ++d) {
    double *const mean = &step.mean[size_t{kStride} * d];
    std::fill_n(mean, kStride, 0.0);
    if (step.rows.source[d] == kNone) continue;
    Body &b = *w.bodies[step.rows.source[d]];
    if (!b.dynamics->abilities().energy) {
      const EndState ends = b.dynamics->end();
      const double *const way = steps_itself(b) ? ends.mean : ends.v;
      if (step.rows.block[d] == kNone) std::copy_n(way + size_t{kStride} * step.rows.point[d], 3, mean);
      else
        b.surface.each_phyxel(step.rows.point[d], [&](uint32_t point, double weight) {
          for (size_t k = 0; k < 3; ++k) mean[k] += weight * way[size_t(point) * kStride + k];
        });
      continue;
    }
    const size_t at = size_t(step.rows.point[d]) * kStride;
    const double *const end = b.dynamics->end().v;
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      mean[k] = 0.5 * (b.p.v[at + k] + end[at + k]);
      if (b.p.moves(at + k)) sum += b.p.impulse[at + k] * mean[k];
    }
    b.energy.work += sum;
  }
}

// At the ends of the arcs, see book_end(). way: [npoint,4] m/s
double work_of_contact(const World &w, const StepContext &step, const Body &b, const double *way) {
  const Phyxels &p = b.p;
  double contact = 0;
  if (!w.plan.touches()) return contact;
  const Turning turning = steps_itself(b) ? Turning{} : turning_of(p, way, step.h);
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
    const double *const q = &b.surfel_impulse[3 * size_t(s)];
    if (q[0] == 0 && q[1] == 0 && q[2] == 0) continue;
    b.surface.each_phyxel(s, [&](uint32_t point, double weight) {
      const Vec3 arc = turning.arc(load3(way + size_t(point) * kStride));
      for (size_t k = 0, at = size_t(point) * kStride; k < 3; ++k, ++at)
        if (p.moves(at)) contact += weight * q[k] * (way[at] + arc[int(k)]);
    });
  }
  return contact;
}

// A sub-step of backward Euler, with r the residual that Newton's method leaves:
//
//   M (v' - v) = h (f' + loads + m g) + p + r,  x' = x + h v'
//
// times v': kinetic energy rises by what f', loads, weight, contact and r do at v', less
// |v' - v|^2 M / 2. The elastic energy rises by no more than -f'.(x' - x) where it is convex. Where the guard
// takes a fraction of the way only, the potentials change by that fraction at most.
//
// A rotation is not convex: between its ends a chord leads through a body that is smaller, so inner forces
// that carry a contact's force through the body do work on x' - x and no elastic energy pays for it. With the
// contact's work at the end of the arc, v' + h/2 spin x (v' - v_center), the balance holds to that order.
//
// A model that steps itself says where its points end: contact and loads do their work on that way, arcs
// included, whatever velocity the points have at its end.
void book_end(World &w, StepContext &step, Body &b, double motion) {
  const Phyxels &p = b.p;
  const bool load_booked = books_loads(b), driven = !step.driven.empty() && !b.motions.empty();
  const double *const end = b.dynamics->end().v;
  const double *const way = steps_itself(b) ? b.dynamics->end().mean : end;
  double loads = 0, gained = 0, held = 0;
  const double contact = work_of_contact(w, step, b, way);
  const bool forces = driven && b.dynamics->end_forces(sub_step_of(w, w, step));
  const bool by_point = load_booked || driven || motion < 1;
  for (uint32_t i = 0; by_point && i < p.n; ++i)
    for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at) {
      const double load = load_booked ? p.load[at] : 0;
      if (p.moves(at)) {
        loads += step.h * load * way[at];
        gained += p.mass[i] * (end[at] - p.v[at]) * end[at];
      } else if (forces) {
        held -= motion * step.h * p.v[at] * (p.f[at] - load + p.mass[i] * w.gravity.now[int(k)]);
      }
    }
  b.energy.work += contact + loads + held + (1 - motion) * (gained - loads - contact);
}

// What forces that act in full do on the part of the way that the guard has left out.
void book_unmoved(Body &b, double motion) {
  const Phyxels &p = b.p;
  const double *const end = b.dynamics->end().v;
  double sum = 0;
  for (size_t at = 0; at < p.v.size(); ++at)
    if (p.moves(at)) sum += (p.mass[at / kStride] * (end[at] - p.v[at]) - p.impulse[at]) * end[at];
  b.energy.work += (1 - motion) * sum;
}

// Loads without a potential, which act for this share of the sub-step (Dynamics::take_part).
void book_loads(const StepContext &step, Body &b, double motion) {
  const Phyxels &p = b.p;
  const double *const end = b.dynamics->end().v;
  double sum = 0;
  for (size_t at = 0; at < p.v.size(); ++at)
    if (p.moves(at)) sum += step.h * p.load[at] * 0.5 * (p.v[at] + end[at]);
  b.energy.work += motion * sum;
}

}  // namespace

bool has_balance(const Body &b) { return watched(b); }

double gain_at_end(const World &w, const StepContext &step, const Body &b) {
  if (!at_end(b) || !b.model.can(DFM_CAP_ENERGY) || !b.motions.empty() || b.model.works(kFlow)) return 0;
  if (steps_itself(b) && b.p.held_anywhere() != 0) return 0;  // steps may leave out points
  const Phyxels &p = b.p;
  const EndState ends = b.dynamics->end();
  double had = 0, has = 0, gained = 0;
  for (uint32_t i = 0; i < p.n; ++i)
    for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at) {
      if (!p.moves(at)) continue;
      const double before = p.v[at], after = ends.v[at], m = p.mass[i];
      had += 0.5 * m * (before * before);
      has += 0.5 * m * (after * after);
      gained += 0.5 * m * (after * after - before * before) -
                step.h * ends.mean[at] * (p.load[at] + m * w.gravity.now[int(k)]);
    }
  gained -= work_of_contact(w, step, b, steps_itself(b) ? ends.mean : ends.v);
  double elastic = 0, elastic_end = 0;
  dfm_kin kin = b.dynamics->kin(w.time, 0);
  const OnBehalf prefix(b.name);
  const auto query = [&](double &u) {
    return b.model.call("energy", [&] { return b.model.ops->energy(b.model.self, &kin, &u); }) == DFM_OK;
  };
  if (!query(elastic)) return 0;
  kin.x = p.x_end.data();
  kin.v = p.v_end.data();
  if (steps_itself(b)) kin.state = b.model.state_out.data();
  if (!query(elastic_end)) return 0;
  return (gained + elastic_end - elastic) / std::max(had + elastic, has + elastic_end);
}

const char *unwatched(const World &w, const Body &b) {
  if (!watching(w)) return "energy_watch is 0";
  if (!watched(b)) return "its model gives no energy, or not with these parameters";
  if (steps_itself(b)) return unbooked(w, b) ? "its held points move, and its model steps itself" : "";
  return unbooked(w, b) ? "tr_bdf2 takes loads, held points or gravity that vary along the sub-step" : "";
}

// Of G = U(x) - m g.x + v.M v* / 2 with v* = v + h g + ..: a weight that changes does work at the places x -
// h v / 2, whatever the motion; at x where G is the true energy. The sub-step may fail after this and be
// tried again with another gravity, from the same state: then the rest is booked.
void change_gravity(const WorldState &state, Entities &entities, Rules &rules, Vec3 gravity) {
  const Vec3 by = gravity - rules.gravity.now;
  rules.gravity.now = gravity;
  if (!watching(rules) || norm2(by) == 0) return;
  for (auto &b : entities.bodies) {
    if (!watched(*b)) continue;
    if (BodySums sums; at_end(*b) && b->dynamics->sums(sums)) {
      b->energy.work -= dot(by, sums.first);
      continue;
    }
    b->dynamics->see_points();
    const Phyxels &p = b->p;
    const double behind = at_end(*b) ? 0 : 0.5 * state.watch.last_h;
    for (uint32_t i = 0; i < p.n; ++i)
      for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at)
        b->energy.work -= p.mass[i] * by[int(k)] * (p.x[at] - (p.moves(at) ? behind * p.v[at] : 0));
  }
}

namespace {

// Whether the energies are to be computed: after kEvery sub-steps, and earlier if a body moves much faster.
bool needs_check(const World &w, const StepContext &step) {
  const double limit = w.def.energy_watch * w.stats.energy_max;
  bool needed = w.watch.age >= kEvery || contact_over(w);
  for (const uint32_t i : step.active) {
    const EnergyBook &e = w.bodies[i]->energy;
    const bool faster = step.free_kinetic[i] > 2 * e.kinetic + limit;
    const bool wants_base = e.known < kWarmUp && (e.known > 0 || faster);
    needed = needed || (watched(*w.bodies[i]) &&
                        (e.known == kWarmUp ? faster : wants_base && w.watch.credit >= kEvaluationCost));
  }
  return needed;
}

// The energies of all watched bodies, J, and what they have gained beyond what their books explain.
struct Balance {
  double total = 0, gain = 0;
  struct {
    const Body *body = nullptr;
    double rise = 0, share = 0;  // share: of the largest energy, that is allowed
  } worst;
};
Balance take_balance(World &w, StepContext &step) {
  Balance out;
  auto &worst = out.worst;
  sum_energies(w, step);
  for (size_t k = 0; k < step.active.size(); ++k) {
    Body &b = *w.bodies[step.active[k]];
    const EnergySample &now = step.samples[k];
    if (!now.known) continue;
    EnergyBook &e = b.energy;
    out.total += now.kinetic + now.elastic;
    if (unbooked(w, b)) continue;
    const bool warmed_up = e.known == kWarmUp, hidden = hides(b);
    const double rise = now.balance - e.base - now.rounding, share = w.def.energy_watch + allowed(b);
    // before the first check `base` is what a hidden energy may be
    const double level = now.balance + now.returned + (hidden && !e.known ? e.base : 0);
    if (warmed_up && rise > 0) out.gain += rise;
    if (warmed_up && rise > share * w.stats.energy_max && rise > worst.rise) worst = {&b, rise, share};
    // a hidden energy may give back what it takes
    if (!warmed_up) e.base = e.known ? std::max(e.base, level) : level;
    else if (!hidden) e.base = std::min(e.base, level);
    e.known += !warmed_up;
    // what contact takes away again included: it is compared with the same of later sub-steps
    e.kinetic = step.free_kinetic[step.active[k]];
  }
  return out;
}

// Ends the run, with this sentence. The next step is checked again.
bool stop_for_energy(World &w, uint32_t *trouble, const std::string &why) {
  w.watch.age = kEvery;
  return fail_step(trouble, DFM_TROUBLE_ENERGY, "%s", why.c_str());
}

}  // namespace

bool watch_energy(World &w, StepContext &step, uint32_t *trouble) {
  // pieces of a sub-step are not compared with whole ones
  if (!watching(w) || step.length.planned != step.h) return true;
  double moving = 0;
  for (const uint32_t i : step.active) moving += watched(*w.bodies[i]) ? step.free_kinetic[i] : 0;
  dfm_world_stats &s = w.stats;
  if (!needs_check(w, step)) {
    s.energy_max = std::max(s.energy_max, moving);
    return true;
  }
  w.watch.credit -= std::min(w.watch.credit, kEvaluationCost);
  const Balance now = take_balance(w, step);
  const auto &worst = now.worst;
  if (w.watch.age == ~0u) s.energy_start = now.total;
  w.watch.age = 0;
  s.energy_gain = std::max(s.energy_gain, now.gain);
  // what moves by less than contact counts as rest is at rest
  const double at_rest = tangent_at_rest(w, w, step.h);
  const double largest = std::max(
      {s.energy_max, now.total - worst.rise, worst.body ? 0.5 * worst.body->mass * (at_rest * at_rest) : 0});
  if (worst.rise > worst.share * largest)
    return stop_for_energy(
        w, trouble,
        format("%s of model '%s': its energy has grown by %.3g J beyond what loads, "
               "motions and contact have put in (limit: %g %% of %.3g J, the largest energy so far); take a "
               "shorter step, or give the material stiffness damping; where the model is a plugin's, check "
               "its forces (energy_watch sets the limit, 0 switches the watch off)",
               at_step(w, *worst.body).c_str(), worst.body->model.type->id, worst.rise, 100 * worst.share,
               largest));
  s.energy_max = std::max({s.energy_max, now.total, moving});
  const std::string contact = describe_contact_gain(w);
  w.watch.reported = !contact.empty();
  return w.watch.reported ? stop_for_energy(w, trouble, contact) : true;
}

void book_energy(World &w, StepContext &step, double motion) {
  if (!watching(w)) return;
  if (w.plan.touches() && step.rows.all() > 0) {
    book_contact(w, step);
    book_contact_gain(w, step);
  }
  uint32_t ages = 1;
  for (const uint32_t i : step.active) {
    Body &b = *w.bodies[i];
    if (at_end(b)) {
      book_end(w, step, b, motion);
      if (!steps_itself(b)) ages = kAges;
      continue;
    }
    if (!step.driven.empty()) b.energy.work += work_of_holders(w, step, b, motion * step.h);
    if (books(b)) b.energy.work += work_of_new_size(w, step, b);
    if (books(b) && books_loads(b)) book_loads(step, b, motion);
    if (books(b) && motion < 1 && step.acts_in_full(i)) book_unmoved(b, motion);
  }
  w.watch.last_h = motion * step.h;
  w.watch.size_before = 0;
  if (w.watch.age <= kEvery) w.watch.age = std::min(w.watch.age + ages, kEvery);
  w.watch.credit = std::min(w.watch.credit + ages, kMaxCredit);
}

// Keeps as much of a hidden elastic energy as was there: at most what the body had and was given, less what
// its place in gravity and in lasting loads has taken.
void forget_energy(Body &b) {
  forget_contact_gain(*b.world);
  EnergyBook &e = b.energy;
  double hidden = 0;
  if (hides(b)) {
    hidden = e.base;
    if (e.known > 0) {
      for (uint32_t i = 0; i < b.p.n; ++i)
        for (size_t k = 0, at = size_t(i) * kStride; k < 3; ++k, ++at)
          hidden +=
              (b.p.mass[i] * b.world->gravity.now[int(k)] + (books_loads(b) ? 0 : b.p.load[at])) * b.p.x[at];
      hidden = std::max(0.0, hidden + e.work);
    }
    hidden = std::min(hidden, kNoLimit);
  }
  e = {};
  e.base = hidden;
}

void lose_energy(Body &b) {
  forget_contact_gain(*b.world);
  b.energy = {};
  if (hides(b)) b.energy.base = kNoLimit;
}

void forget_energy(World &w) {
  for (auto &b : w.bodies) forget_energy(*b);
}

double moving_energy(const Body &b) {
  double sum = 0;
  for (uint32_t i = 0; i < b.p.n; ++i)
    for (size_t k = 0, at = size_t{kStride} * i; k < 3; ++k, ++at)
      if (b.p.moves(at)) sum += 0.5 * b.p.mass[i] * (b.p.v[at] * b.p.v[at]);
  return sum;
}

void ready_change_work(Body &b, const SubStep &now) {
  if (b.changes.open && !b.motions.empty() && b.dynamics->abilities().damps) b.dynamics->end_forces(now);
}

void book_change_work(const World &w, Body &b, double h) {
  ChangeBook &book = b.changes;
  if (!book.open) return;
  const Phyxels &p = b.p;
  const double *const before = p.x_end.data();  // the two have been swapped
  const bool driven = !b.motions.empty();
  double sum = 0;
  for (uint32_t i = 0; i < p.n; ++i)
    for (size_t k = 0, at = size_t{kStride} * i; k < 3; ++k, ++at) {
      const double way = p.x[at] - before[at];
      if (p.moves(at)) sum += (p.load[at] + p.mass[i] * w.gravity.now[int(k)]) * way;
      else if (driven) sum -= (p.f[at] - p.load[at]) * way;  // work of the hold against the inner forces
    }
  if (w.plan.touches())
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      const double *const q = &b.surfel_impulse[3 * size_t{s}];
      if (q[0] == 0 && q[1] == 0 && q[2] == 0) continue;
      b.surface.each_phyxel(s, [&](uint32_t point, double weight) {
        for (size_t k = 0, at = size_t{kStride} * point; k < 3; ++k, ++at)
          if (p.moves(at)) sum += weight * q[k] * (p.x[at] - before[at]) / h;
      });
    }
  book.work += sum;
  book.largest = std::max(book.largest, moving_energy(b) - std::max(0.0, book.unpaid));
}

bool is_valid(const EnergyBook &e) {
  return e.known <= kWarmUp && std::isfinite(e.base) && std::isfinite(e.work) && e.kinetic >= 0 &&
         std::isfinite(e.kinetic);
}

bool is_valid(const EnergyWatch &e) {
  return (e.age <= kEvery || e.age == ~0u) && e.credit <= kMaxCredit && e.last_h >= 0 &&
         std::isfinite(e.last_h) && e.made >= 0 && std::isfinite(e.made) && std::isfinite(e.rubbed);
}

}  // namespace dfm
