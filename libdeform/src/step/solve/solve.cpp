// contact <-> friction (doc/concepts/contact.md): the rows, the revision of bodies whose response depends on
// the impulses, and what is kept. Contacts start with the last impulses of the same keys; solve_islands.cpp
// solves them, by sweeps (contact/sweeps.cpp) where no body is implicit, then by Newton's method
// (contact/newton.cpp) where these do not suffice.
#include <algorithm>
#include <limits>
#include <utility>

#include "body/implicit_system.h"
#include "contact/solver.h"
#include "core/error.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/overlap/overlap.h"
#include "step/pair_table.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"
#include "step/sides.h"
#include "step/solve/attach.h"
#include "step/solve/friction_memory.h"
#include "step/solve/cut_drag.h"
#include "step/solve/pre_solve.h"
#include "step/solve/restitution.h"
#include "step/solve/solve_islands.h"
#include "step/stages.h"
#include "step/step_bound.h"

namespace dfm {
namespace {

// Responses between the touched surfels of bodies whose points respond to each other's impulses, and of
// groups of rigid bodies.
bool fill_responses(World &w, StepContext &step, uint32_t *trouble) {
  bool given = true;
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (!given) return false;
    if (block.group != kNone) {
      given = rigid_response(w, step, block, trouble);
      continue;
    }
    const Body &b = *w.bodies[block.source];
    const uint32_t *const surfels = &step.rows.point[block.first];
    step.rows.set_response(block, true, [&](double *responses) {
      given =
          b.dynamics->response(sub_step_of(w, w, step), block.count, surfels, responses) ||
          fail_step(trouble, DFM_TROUBLE_PLUGIN, "%s: model '%s' does not answer impulses; change the model",
                    at_step(w, b).c_str(), b.model.type->id);
    });
  }
  return given;
}

// What a solid body answers at its surface, over the response of its mass: 2.5 at a ball.
constexpr double kWhole = 2.5;
constexpr uint32_t kMaxRevisions = 12;  // of the responses of rigid hosts, within a sub-step
// m/s, at which a depth opens that a pair was found with.
constexpr double kRecoverySpeed = 7e-4;

// m, what was left of the depth that the pair was found with; `most` if it is found now.
double left_of_pair(const ContactStore &store, uint64_t a, uint64_t b, double most) {
  double left = -1;
  for (uint32_t i = 0; i < store.n; ++i)
    if ((store.id_a[i] == a && store.id_b[i] == b) || (store.id_a[i] == b && store.id_b[i] == a))
      left = std::max(left, store.start_depth[i]);
  return left < 0 ? most : left;
}

// Once the responses are known.
void finish_frames(World &w, StepContext &step) {
  step.rows.finish(step.contacts, step.tangents.data(), step.h, step.length.planned, w.offset, step.bonds,
                   &w.context->tasks);
  run_belts(step);
}

void finish_rates(const World &w, StepContext &step) {
  bounce(step);
  if (!step.guard.kept.empty()) guard_rates(step);
  // an equilibrium has no velocity that an opening could leave
  if (!w.prescribed.is_static()) step.rows.soften_openings(step.rebound_speed);
}

}  // namespace

// The depth of bodies that are set on each other, or by up to d_c into each other. No motion has made it, so
// it opens by a speed, whatever the sub-step: a share per sub-step would throw what is stiff. Faces of a cut
// have distances of their own, and an equilibrium has no speed to open by.
double start_depth(const World &w, const StepContext &step, const ContactPoint &c, uint32_t match,
                   double depth) {
  if (!(depth > 0) || w.prescribed.is_static()) return 0;
  const double opened = step.h * (w.def.recovery_speed > 0 ? w.def.recovery_speed : kRecoverySpeed);
  const Body &a = *w.bodies[c.slot_a], *const b = c.obstacle ? nullptr : w.bodies[c.slot_b].get();
  double left = 0;
  if (match != kNone) left = w.store.start_depth[match];
  else if (!(b && made_id(a) == made_id(*b)))
    left = left_of_pair(w.store, a.id, b ? b->id : w.obstacles[c.slot_b]->id, 2 * w.offset + opened);
  return std::max(0.0, std::min(left - opened, depth));
}

bool may_shorten(const SubStepTimes &times) { return times.h > kMinRepeated * times.length.planned; }

void report_impulses(const Detection &detection, const Solution &solution, SubStepEnd &end) {
  const ContactRows &rows = solution.rows;
  distribute(detection.contacts, rows.frame.data(), rows.impulse.data(), end.sinks, end.given, solution.bonds,
             rows.impulse.data() + size_t{3} * rows.n);
}

void stage_distribute(const Detection &detection, const Solution &solution, SubStepEnd &end) {
  end.ended = false;
  report_impulses(detection, solution, end);
}

// Makes rows of the contacts, with the impulses of the last sub-step, which are not applied yet.
bool make_rows(World &w, StepContext &step, uint32_t *trouble) {
  const uint32_t n = static_cast<uint32_t>(step.contacts.size());
  const bool again = step.rigid_again || step.guard.resolving;
  if (step.rigid_again)
    step.impulse_before_rebuild.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  make_bonds(w, step, again);
  make_cut_drags(w, step, again);
  const std::span<const RigidSides> between_rigids = step.tools->sides();
  uint32_t nstate = 0;
  for (const LawInstance *law : w.pairs.laws) nstate = std::max(nstate, law->nstate);
  step.state.resize(n + static_cast<uint32_t>(between_rigids.size()), nstate);
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = step.contacts[i];
    step.state.law[i] = contact_law(w, c);
    step.state.area[i] = c.area;
  }
  take_choices(step);
  // The force of laws with memory is proportional to area. A crossing has its part of the area, so it has to
  // carry its part of the load.
  if (nstate > 0)
    for (uint32_t i = 0; i < n; ++i)
      if (w.pairs.laws[step.state.law[i]]->nstate > 0) step.contacts[i].indentation = 0;
  for (size_t i = 0; i < w.bodies.size(); ++i) {  // the present state and the last end may have been swapped
    const Body &b = *w.bodies[i];
    step.sources[i].velocity = b.dynamics->unknowns().velocity;
    const double mass = step.systems[i] ? step.systems[i]->mass() : 0;
    step.sources[i].whole = mass > 0 ? kWhole / mass : 0;
    const bool set_back = b.surface.identity() && (b.surface.slit || b.surface.back > 0);
    step.sources[i].place = set_back ? b.p.x.data() : nullptr;
  }
  step.rows.build(step.contacts, step.sources, {step.rigid_places, step.rigid_groups}, step.bonds,
                  between_rigids);
  start_rigids(w, step);
  if (!fill_responses(w, step, trouble)) return false;
  step.tangents.resize(size_t(3) * n);
  step.match.resize(n);
  warm_start(w.store, step.contacts, step.h, step.rows.impulse, step.state, step.tangents.data(),
             step.match.data(), &w.context->tasks);
  step.rows.borne.resize(n);
  for (uint32_t i = 0; i < n; ++i) step.rows.borne[i] = step.rows.impulse[size_t(3) * i];
  step.rows.start_depth.resize(n);
  for (uint32_t i = 0; i < n; ++i)
    step.rows.start_depth[i] =
        start_depth(w, step, step.contacts[i], step.match[i], w.offset - step.contacts[i].distance);
  share_areas(w, step);
  fit_bristles(w, step);
  step.rows.recovery = w.def.recovery_speed;
  finish_frames(w, step);
  find_throws(w, step);
  finish_rates(w, step);
  reset_stick_drift(w, step);
  std::copy(step.bond_impulse.begin(), step.bond_impulse.end(),
            step.rows.impulse.begin() + std::ptrdiff_t{3} * step.rows.n);
  if (step.guard.resolving) guard_impulses(step);
  if (step.rigid_again)
    std::copy_n(step.impulse_before_rebuild.begin(), 3 * size_t{n}, step.rows.impulse.begin());
  step.tools->put(step.rows, step.state);
  step.solve_islands->find(w, step);
  return true;
}

namespace {

// Solves again, from the present impulses, until rigid bodies turn and drive as the solve assumed. bad: out,
// an island with a law that fails. False: a rigid host has failed.
bool solve_revised(World &w, StepContext &step, const SolveIsland *&bad, uint32_t *trouble) {
  const std::span<SolveIsland> all = step.solve_islands->all();
  for (SolveIsland &own : all) {
    own.all_passes = own.all_sweeps = 0;
    own.open = true;
  }
  for (uint32_t revisions = 0;;) {
    bad = solve_islands(w, step);
    double left = 0;
    for (SolveIsland &own : all) {
      if (own.between_rigids) left = std::max(left, own.residual.normal);
      if (!own.open) continue;
      own.all_passes += own.passes;
      own.all_sweeps += own.sweeps;
    }
    if (bad || step.rows.rigid.empty()) return true;
    Followed after;
    if (!follow_rigids(w, step, left, revisions < kMaxRevisions, after, trouble)) return false;
    if (!after.goes_on) return true;
    if (after.renewed) {
      ++revisions;
      finish_frames(w, step);
      finish_rates(w, step);
    }
    restart_rigids(w, step);
    for (SolveIsland &own : all) own.open = own.rigid;
  }
}

// Takes the largest residual of all islands, and the passes and sweeps of the island that needed most.
void add_up(World &w, StepContext &step) {
  dfm_world_stats &s = w.stats;
  s.passes = s.sweeps = 0;
  for (const SolveIsland &own : step.solve_islands->all()) {
    s.passes = std::max(s.passes, own.all_passes);
    s.sweeps = std::max(s.sweeps, own.all_sweeps);
    step.residual = larger(step.residual, own.residual);
  }
  s.residual = step.residual.speed;
  s.passes_max = std::max(s.passes_max, s.passes);
  s.sweeps_max = std::max(s.sweeps_max, s.sweeps);
  s.residual_max = std::max(s.residual_max, s.residual);
}

// False: the sub-step is to be repeated, with the integrator that contacts need.
bool contacts_taken(World &w, StepContext &step) {
  bool all = true;
  each_body_touched(w, step, [&](uint32_t slot) { all &= w.bodies[slot]->dynamics->choose_scheme(true); });
  if (!all) step.length.repeat(1);
  return all;
}

// False: the sub-step is too long for contact of a body that steps itself. It is repeated as the first of
// shorter ones, of which the bound, asked for again, then keeps the size.
bool short_enough(World &w, StepContext &step) {
  if (!any_bounds_contact(w)) return true;
  double longest = std::numeric_limits<double>::infinity(), parts = 1;
  each_body_touched(w, step, [&](uint32_t slot) {
    if (!w.bodies[slot]->sleep_state.asleep)
      longest = std::min(longest, w.bodies[slot]->dynamics->contact_step());
  });
  while (longest > 0 && step.h > parts * longest) parts *= 2;  // zero: the step's own check refuses it
  if (parts == 1) return true;
  expire_bound(w);
  w.bound.strain = kBoundStrain;  // all that the bound allows for, so that it is evaluated
  step.length.divide(step.h, parts);
  return false;
}

// In a shorter sub-step a body moves less far from where its forces are known.
bool retry_shorter(World &w, StepContext &step, const SolveIsland &own, uint32_t *trouble) {
  if (may_shorten(step)) {
    step.length.repeat(0.5);
    return false;
  }
  if (!own.implicit) return report_failed_solve(w, step, nullptr, kNone, trouble);
  return fail_step(trouble, DFM_TROUBLE_NONFINITE,
                   "%s: no state was found in which its forces and contacts agree, not even in a sub-step of "
                   "%g s; take a smaller step, or lower the stiffness",
                   at_step(w, *w.bodies[own.implicit_body]).c_str(), step.h);
}

// False: the sub-step is to be repeated, up to where a body lands that a restitution throws back.
bool cut_at_landing(World &w, StepContext &step) {
  if (step.rigid_again || step.guard.resolving) return true;
  const double share = lands_at(w, step);
  if (share == 1 || !may_repeat(w, w, step, step.budget)) return true;
  step.length.repeat(share);
  return false;
}

}  // namespace

bool stage_solve(World &w, StepContext &step, uint32_t *trouble) {
  call_pre_solve(w, step);
  if (!contacts_taken(w, step) || !short_enough(w, step)) return false;
  step.residual = {};
  if (!make_rows(w, step, trouble)) return false;
  if (!cut_at_landing(w, step)) return false;
  step.guard.resolving = false;  // what it has kept is in the rows
  step.rows.apply_last();
  if (step.rows.all() == 0) {
    w.stats.passes = w.stats.sweeps = 0;
    w.stats.residual = 0;
    reserve_contacts(w, step);
    return true;
  }
  share_work(w, step);
  const SolveIsland *bad = nullptr;
  if (!solve_revised(w, step, bad, trouble)) return false;
  for (const SolveIsland &own : step.solve_islands->all())
    if (own.failed && !own.bad) return retry_shorter(w, step, own, trouble);
  double nan_flag = 0;
  for (double l : step.rows.impulse) nan_flag += 0.0 * l;
  if (bad) return report_failed_solve(w, step, bad->bad, bad->batches.failed(), trouble);
  if (nan_flag != 0) return report_failed_solve(w, step, nullptr, kNone, trouble);
  step.bond_impulse.assign(step.rows.impulse.begin() + std::ptrdiff_t{3} * step.rows.n,
                           step.rows.impulse.end());
  // laws may have been evaluated at slips that differ from the solution
  std::swap(step.state.vt, step.state.slip);
  update_stick_drift(w, step);
  add_up(w, step);
  reserve_contacts(w, step);
  return true;
}

}  // namespace dfm
