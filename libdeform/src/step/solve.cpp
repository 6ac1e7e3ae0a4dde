// contact <-> friction: the outer loop over the laws around the inner sweeps (doc/concepts/contact.md).
//
//   warm start: last impulses of the same keys, times h/h_old, applied before the first sweep
//   repeat   ask all laws once, in batches, at the present slip and normal force
//            residual of the true laws below tolerance: done
//            sweep the linearized laws until their own residual is below tolerance
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/solver.h"
#include "core/error.h"
#include "state/world.h"
#include "step/bristles.h"
#include "step/context.h"
#include "step/pair_table.h"
#include "step/rigid.h"
#include "step/stages.h"

namespace dfm {
namespace {

// Responses between the touched surfels of bodies whose points answer each other: the columns are those to
// unit impulses.
void fill_responses(World &w, StepContext &step) {
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (block.group != kNone) {
      rigid_response(w, step, block.group, &step.rows.response[block.response]);
      continue;
    }
    const Body &b = *w.bodies[block.source];
    const uint32_t n = block.count, width = 3 * n;
    step.block_surfels.resize(n);
    step.block_velocity.resize(size_t(width) * width);
    step.block_impulse.assign(size_t(width) * width, 0.0);
    for (uint32_t k = 0; k < n; ++k) step.block_surfels[k] = step.rows.point[block.first + k];
    for (uint32_t c = 0; c < width; ++c) step.block_impulse[size_t(c) * width + c] = 1;
    if (!b.dynamics->respond(sub_step_of(w, step), n, step.block_surfels.data(), width,
                             step.block_impulse.data(), step.block_velocity.data()))
      fail(DFM_E_FATAL, "model '%s' of body '%s' does not answer impulses; change the model",
           b.model.type->id, b.name.c_str());
    for (uint32_t r = 0; r < width; ++r)
      for (uint32_t c = 0; c < width; ++c)
        step.rows.response[block.response + size_t(r) * width + c] =
            step.block_velocity[size_t(c) * width + r];
  }
}

void apply_last(ContactRows &rows) {
  rows.y_free.assign(rows.y.begin(), rows.y.end());
  for (uint32_t i = 0; i < rows.n; ++i) {
    double *const l = &rows.impulse[size_t(i) * 3];
    if (!(rows.wn[i] > 0)) l[0] = l[1] = l[2] = 0;
    else if (l[0] != 0) rows.apply(i, load3(l));
  }
}

constexpr uint32_t kMostRevisions = 6;  // of what rigid hosts take for granted, within a sub-step

// Where laws remember, errors of the normal force do not average out: each time a force falls by one, the
// cone cuts off a part of the bristle that does not come back when it rises; and a point that shakes under a
// bristle of share s stretches it by (1 - s) of each way forth and slackens it by (1 + s) of each way back.
// What is held creeps by both. This share of the normal tolerance then holds while bodies shake, and at rest
// this share of the tangential one (doc/decisions/0028).
constexpr double kRememberedShare = 0.05, kRememberedRest = 1e-3;

// The cap on sweeps bounds the cost of what is not exact, not of what lets bodies through: where a normal
// residual would eat more than a tenth of the rest distance within the sub-step, up to kBeyondCap times as
// many are done (many surfels on few phyxels, struck hard).
constexpr uint32_t kBeyondCap = 8, kFewSweeps = 8;  // kFewSweeps: where the step has to save
bool may_sweep(World &w, StepContext &step, const Residual &residual) {
  if (step.sweeps >= kFewSweeps && spares(step, Thrift::sweeps)) return false;
  if (step.sweeps < w.def.max_sweeps) return true;
  return residual.normal * step.h > 0.1 * w.offset && step.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps;
}

// What goes beyond what must be reached is polish, and this many sweeps of a sub-step are enough for it: the
// next one goes on from there.
constexpr uint32_t kPolish = 20;
bool good(StepContext &step, const Residual &left, double most) {
  return left.relative <= most ||
         (left.due <= most && (step.sweeps >= kPolish || spares(step, Thrift::polish)));
}

// Beyond this times the best residual sweeps are running away: with a jam of strong friction block
// Gauss-Seidel need not converge, and where laws are affine nothing else stops it before numbers end.
constexpr double kRunsAway = 1e6;

// Sweeps on the laws as they were last answered. At the cap the best state seen is taken, not the last one.
void sweep_until_good(World &w, StepContext &step, Acceleration &acceleration, const Tolerance &tolerance) {
  double best = std::numeric_limits<double>::infinity();
  step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  acceleration.start(step.rows);
  for (;;) {
    charge(w, step, step.rows.n);
    sweep(step.rows, step.state, step.h);
    ++step.sweeps;
    const Residual left = inner_residual(step.rows, step.state, step.h, tolerance);
    if (!(left.due <= kRunsAway * std::max(1.0, best)) || !(left.due < std::numeric_limits<double>::max())) {
      step.rows.impulse.assign(step.best_impulse.begin(), step.best_impulse.end());
      return step.rows.restore();
    }
    if (good(step, left, 0.5)) return;
    if (left.due < best) {
      best = left.due;
      step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
    }
    if (!may_sweep(w, step, left)) break;
    acceleration.follow(step.rows);
  }
  if (std::isinf(best)) return;
  for (uint32_t i = 0; i < step.rows.n; ++i) {
    double *const l = &step.rows.impulse[size_t(i) * 3];
    const Vec3 change = load3(&step.best_impulse[size_t(i) * 3]) - load3(l);
    if (change.x == 0 && change.y == 0 && change.z == 0) continue;
    step.rows.apply(i, change);
    store3(l, load3(&step.best_impulse[size_t(i) * 3]));
  }
}

}  // namespace

// Contacts as rows, with what they kept from the last sub-step: its impulses, not applied yet.
void make_rows(World &w, StepContext &step) {
  const uint32_t n = static_cast<uint32_t>(step.contacts.size());
  uint32_t nstate = 0;
  for (const LawInstance *law : w.pairs.laws) nstate = std::max(nstate, law->nstate);
  step.state.resize(n, nstate);
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = step.contacts[i];
    step.state.law[i] = pair_law(w, c.slot_a, c.obstacle, c.slot_b);
    step.state.area[i] = c.area;
  }
  if (!w.pairs.zone_table.empty()) set_zone_laws(w, step.contacts, step.state.law);
  if (step.rigid_again) step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  step.rows.build(step.contacts, step.sources, {step.rigid_places, step.rigid_groups});
  correct_rigids(w, step);
  fill_responses(w, step);
  step.tangents.resize(size_t(3) * n);
  step.match.resize(n);
  warm_start(w.store, step.contacts, step.h, step.rows, step.state, step.tangents.data(), step.match.data());
  share_areas(w, step);
  fit_bristles(w, step);
  step.rows.recovery = w.def.recovery_speed;
  step.rows.finish(step.contacts, step.tangents.data(), step.h, step.guard.planned, w.offset);
  if (step.guard.resolving) guard_impulses(step);
  if (!step.guard.kept.empty()) guard_rates(step);
  if (step.rigid_again) step.rows.impulse.assign(step.best_impulse.begin(), step.best_impulse.end());
  step.batches.gather(w.pairs.laws, step.state);
}

// Passes until the true residual is good enough; a law that failed, or null.
const LawInstance *solve_rows(World &w, StepContext &step) {
  const double gap_margin = 0.01 * (0.5 * w.offset) / step.h;
  const double least = w.def.contact_tolerance > 0 ? w.def.contact_tolerance : std::min(1e-6, gap_margin);
  const bool memory = step.batches.remembers();
  const ToleranceBounds bounds{least, memory ? kRememberedRest * least : gap_margin,
                               memory ? kRememberedShare * gap_margin : gap_margin};
  for (;;) {
    charge(w, step, 4 * uint64_t{step.rows.n});
    set_trial(step.rows, step.h, step.state);
    // The sweeps take the next Newton step from there: what is asked a hundredth off is answered to a
    // ten-thousandth.
    if (const LawInstance *bad =
            step.batches.answer(step.h, step.rows.wt.data(), 0.1 * least, 1e-2, step.state))
      return bad;
    ++step.passes;
    if (step.sweeps) {
      step.residual = true_residual(step.rows, step.state, step.h, step.tolerance);
      if (good(step, step.residual, 1) || !may_sweep(w, step, step.residual) ||
          step.passes > w.def.max_passes)
        return nullptr;
    }
    if (const LawInstance *bad = step.batches.slopes(step.h, step.state)) return bad;
    if (!step.sweeps)
      set_tolerance(step.rows, step.state, step.contacts, step.h, bounds,
                    static_cast<uint32_t>(w.bodies.size()), step.disturbance, step.tolerance);
    // at least one sweep on a warm start is part of the method
    sweep_until_good(w, step, step.acceleration, step.tolerance);
  }
}

bool stage_solve(World &w, StepContext &step, uint32_t *trouble) {
  step.passes = step.sweeps = 0;
  step.residual = {};
  make_rows(w, step);
  apply_last(step.rows);
  if (step.rows.n == 0) {
    reserve_contacts(w, step);
    return true;
  }
  uint32_t passes_before = 0, sweeps_before = 0;
  const LawInstance *bad = nullptr;
  for (uint32_t revision = 0;; ++revision) {
    bad = solve_rows(w, step);
    if (bad || revision == kMostRevisions || step.rows.rigid.empty() || !revise_rigids(w, step)) break;
    // A motor holds or lets go: the same problem with another response, from the impulses that were found.
    step.rows.finish(step.contacts, step.tangents.data(), step.h, step.guard.planned, w.offset);
    if (!step.guard.kept.empty()) guard_rates(step);
    passes_before += step.passes;
    sweeps_before += step.sweeps;
    step.passes = step.sweeps = 0;
  }
  step.passes += passes_before;
  step.sweeps += sweeps_before;
  double poison = 0;
  for (double l : step.rows.impulse) poison += 0.0 * l;
  if (bad || poison != 0) {
    *trouble |= tell_failed_solve(w, step, bad);
    return false;
  }
  if (step.batches.smooth()) set_slips(step.rows, step.state);
  if (step.residual.due > 1) {
    *trouble |= DFM_TROUBLE_UNCONVERGED;
    ++w.stats.unconverged;
  }
  w.stats.passes = step.passes;
  w.stats.sweeps = step.sweeps;
  w.stats.residual = step.residual.speed;
  w.stats.passes_max = std::max(w.stats.passes_max, step.passes);
  w.stats.sweeps_max = std::max(w.stats.sweeps_max, step.sweeps);
  w.stats.residual_max = std::max(w.stats.residual_max, w.stats.residual);
  reserve_contacts(w, step);
  return true;
}

}  // namespace dfm
