// contact <-> friction: the outer loop over the laws around the inner sweeps (doc/concepts/contact.md).
//
//   warm start: last impulses of the same keys, times h/h_old, applied before the first sweep
//   repeat   ask all laws once, in batches, at the present slip and normal force
//            residual of the true laws below tolerance: done
//            sweep the linearized laws until their own residual is below tolerance
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "body/make_surface.h"
#include "contact/solver.h"
#include "core/error.h"
#include "state/world.h"
#include "step/attach.h"
#include "step/bristles.h"
#include "step/context.h"
#include "step/pair_table.h"
#include "step/pre_solve.h"
#include "step/rigid.h"
#include "step/stages.h"
#include "step/tolerance.h"

namespace dfm {
namespace {

// Responses between the touched surfels of bodies whose points answer each other.
void fill_response(World &w, StepContext &step, const ContactRows::Block &block) {
  const Body &b = *w.bodies[block.source];
  step.block_surfels.resize(block.count);
  for (uint32_t k = 0; k < block.count; ++k) step.block_surfels[k] = step.rows.point[block.first + k];
  step.rows.set_answers(block, [&](double *answers) {
    if (!b.dynamics->response(sub_step_of(w, step), block.count, step.block_surfels.data(), answers))
      fail(DFM_E_FATAL, "model '%s' of body '%s' does not answer impulses; change the model",
           b.model.type->id, b.name.c_str());
  });
}

void fill_responses(World &w, StepContext &step) {
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (block.group == kNone) fill_response(w, step, block);
    else rigid_response(w, step, block);
  }
}

void apply_last(ContactRows &rows) {
  rows.y_free.assign(rows.y.begin(), rows.y.end());
  for (uint32_t i = 0; i < rows.n; ++i) {
    double *const l = &rows.impulse[size_t(i) * 3];
    if (!(rows.wn[i] > 0)) l[0] = l[1] = l[2] = 0;
    else if (l[0] != 0) rows.apply(i, load3(l));
  }
  for (uint32_t i = rows.n; i < rows.all(); ++i) rows.apply(i, load3(&rows.impulse[size_t(i) * 3]));
}

constexpr uint32_t kMostRevisions = 6;  // of what rigid hosts take for granted, within a sub-step
// Revisions of bodies by the last impulses before the first solve: a few, because the solve moves bodies
// anyway where they do not rest. Further solves at most, once bodies are content, of what the cap on sweeps
// has cut off.
constexpr uint32_t kWarmRevisions = 4, kMostAgain = 6;
// A solve that ends at its cap, or goes on beyond it by momentum, leaves impulses that drift, and bodies
// follow them: each finds something to change after the other, and none of it is an error that falls. After
// so many such solves a body is as right as it will be where it lies within what it tolerates.
constexpr uint32_t kMostCapped = 20;
// A sub-step in which a body does not come to a state with its contacts is taken anew, half as long, down to
// this share of the planned one.
constexpr double kLeastPiece = 1.0 / 256;

// Where laws remember, errors of the normal force do not average out: each time a force falls by one, the
// cone cuts off a part of the bristle that does not come back when it rises; and a point that shakes under a
// bristle of share s stretches it by (1 - s) of each way forth and slackens it by (1 + s) of each way back.
// What is held creeps by both. This share of the normal tolerance then holds while bodies shake, and at rest
// this share of the tangential one (doc/decisions/0028). So it does for bodies whose end is solved for: stiff
// ones sag by less than the normal tolerance in a long step.
constexpr double kRememberedShare = 0.05, kRememberedRest = 1e-3;

// The cap on sweeps bounds the cost of what is not exact, not of what lets bodies through: where a normal
// residual would eat more than a tenth of the rest distance within the sub-step, up to kBeyondCap times as
// many are done (many surfels on few phyxels, struck hard).
constexpr uint32_t kBeyondCap = 8, kFewSweeps = 8;  // kFewSweeps: where the step has to save
bool may_sweep(World &w, StepContext &step, const Residual &residual, uint32_t cap) {
  if (step.sweeps >= kFewSweeps && spares(step, Thrift::sweeps)) return false;
  if (step.sweeps < cap) return true;
  return residual.normal * step.h > 0.1 * w.offset && step.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps;
}

// What goes beyond what must be reached is polish, and this many sweeps of a sub-step are enough for it: the
// next one goes on from there.
constexpr uint32_t kPolish = 20;
bool good(StepContext &step, const Residual &left, double most) {
  return left.relative <= most ||
         (left.due <= most && (step.sweeps >= kPolish || spares(step, Thrift::polish)));
}

// Each sweep solves the bonds to this share of their tolerance, so that the residual which the next sweep
// finds comes from the contacts.
constexpr double kBondShare = 0.1;

// Beyond this times the best residual sweeps are running away: with a jam of strong friction block
// Gauss-Seidel need not converge, and where laws are affine nothing else stops it before numbers end.
constexpr double kRunsAway = 1e6;

// A law that is no projection is known by its tangent, so what is solved is only as right as the slip is near
// at which the law was asked. Where nearly redundant normal forces take all sweeps of the first pass, that
// slip is the one before contact: bodies would be left with friction that no law gives, and pushed by it.
// Beyond the cap laws are asked again, with so many sweeps each time (doc/decisions/0201).
constexpr uint32_t kPassSweeps = 20;
bool asks_beyond(const World &w, const StepContext &step) {
  return step.sweeps >= w.def.max_sweeps && step.batches.remembers();
}
bool may_ask(World &w, StepContext &step) {
  return asks_beyond(w, step) && step.residual.due > 1 &&
         step.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps && !spares(step, Thrift::sweeps);
}

// The response by which a contact looks for the slip at which it comes to rest alone. Many contacts that hold
// one body turn its slip round together and could not stop it one by one: asked by their own responses they
// say "slide" one way and the other in turn, for ever. Beyond the cap each takes that of all.
const double *trial_response(const World &w, StepContext &step) {
  const ContactRows &rows = step.rows;
  if (!asks_beyond(w, step)) return rows.wt.data();
  double loaded = 0;
  for (uint32_t i = 0; i < rows.n; ++i) loaded += rows.impulse[size_t(i) * 3] > 0;
  step.trial_response.assign(rows.wt.begin(), rows.wt.end());
  for (double &wt : step.trial_response) wt *= std::max(1.0, loaded);
  return step.trial_response.data();
}

// Of bodies that move in few ways sweeps hand loads over too slowly: what they have left at the cap goes on
// in long strides. rho is 1000 over a contact's own response; less where a stride is not found so. The
// strides of a part cost no more than so many times its sweeps up to the cap; what is left then is left to
// the next sub-step, which begins there. Not of bodies that revise what they answer: impulses that move far
// move them.
constexpr uint32_t kMostStrides = 12, kStridesOverCap = 32;
constexpr double kRho = 1e3, kLeastRho = 10;
void stride_on(World &w, StepContext &step, const Tolerance &tolerance, uint32_t part) {
  Proximal &proximal = step.proximal;
  const std::span<const uint32_t> contacts = proximal.contacts(part);
  const auto left = [&] { return inner_residual(step.rows, step.state, step.h, tolerance, contacts); };
  double best = left().due, rho = kRho;
  if (best <= 1 || !proximal.take(step.rows, part)) return;
  const uint64_t most = uint64_t{kStridesOverCap} * w.def.max_sweeps * contacts.size();
  uint64_t work = 0;
  for (uint32_t k = 0; k < kMostStrides && rho >= kLeastRho && work < most; ++k) {
    const bool found = proximal.stride(step.rows, step.state, step.h, rho);
    work += proximal.work();
    charge(w, step, proximal.work());
    if (!found) {
      rho *= 0.1;
      continue;
    }
    const Residual now = left();
    if (now.due < best) {
      best = now.due;
      for (const uint32_t i : contacts)
        std::copy_n(&step.rows.impulse[size_t(3) * i], 3, &step.best_impulse[size_t(3) * i]);
    }
    if (good(step, now, 0.5)) break;
  }
  proximal.put(step.rows, step.best_impulse.data());
}
void stride_on(World &w, StepContext &step, const Tolerance &tolerance) {
  if (spares(step, Thrift::sweeps)) return;
  step.revised.clear();
  for (const ContactRows::Block &b : step.rows.blocks)
    step.revised.push_back(b.group == kNone && w.bodies[b.source]->dynamics->abilities().revises);
  const uint32_t parts = step.proximal.find_parts(step.rows, step.revised);
  for (uint32_t part = 0; part < parts; ++part) stride_on(w, step, tolerance, part);
}

// Nearly redundant contacts of bodies that revise (doc/decisions/0360). Normal forces that hold the bodies in
// more places than these can move in agree only to a few 1e-8 m: a sweep takes a little load from a contact
// that is that far open, gives it to others, and goes on so until the first has none, with friction behind.
// What nobody needs is left out: once the polish is over, contacts whose normal velocity is within kLeave of
// what is allowed keep their normal impulses. At the cap as many sweeps are added, by momentum, from the best
// state.
constexpr double kLeave = 0.2;
double leave_of(const StepContext &step, const Tolerance &tolerance) {
  return step.bodies_revise && step.sweeps >= kPolish ? kLeave * tolerance.most_normal : 0;
}
void settle(World &w, StepContext &step, const Tolerance &tolerance, double &best) {
  step.momentum.start(step.rows);
  for (uint32_t k = 0; k < w.def.max_sweeps && !spares(step, Thrift::sweeps); ++k) {
    charge(w, step, step.rows.all());
    const uint32_t passes =
        sweep(step.rows, step.state, step.h, kBondShare * tolerance.bond, kLeave * tolerance.most_normal);
    charge(w, step, uint64_t{passes} * step.rows.nbond);
    ++step.sweeps;
    const Residual left = inner_residual(step.rows, step.state, step.h, tolerance);
    if (left.due < best) {
      best = left.due;
      step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
    }
    if (left.due <= 0.5) return;
    if (!(left.due <= kRunsAway * std::max(1.0, best))) break;
    step.momentum.follow(step.rows);
  }
  step.rows.impulse.assign(step.best_impulse.begin(), step.best_impulse.end());
  step.rows.restore();
}

// Whether velocities still move is asked after every so many sweeps, once the polish is over, and of laws
// without memory: what is left over stretches bristles.
constexpr uint32_t kAskStands = 4;
bool asks_redundant(StepContext &step) {
  return step.bodies_revise && step.sweeps >= kPolish && step.sweeps % kAskStands == 0 &&
         !step.batches.remembers() && step.redundant.found(step.rows);
}

// Sweeps on the laws as they were last answered. At the cap the best state seen is taken, not the last one.
void sweep_until_good(World &w, StepContext &step, Acceleration &acceleration, Tolerance &tolerance) {
  const uint32_t cap = asks_beyond(w, step) ? step.sweeps + kPassSweeps : w.def.max_sweeps;
  double best = std::numeric_limits<double>::infinity();
  step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  acceleration.start(step.rows);
  bool asks = false;
  for (double before = leave_of(step, tolerance);;) {
    charge(w, step, step.rows.all());
    const double leave = leave_of(step, tolerance);
    if (leave > before) acceleration.start(step.rows);
    before = leave;
    if (asks) step.redundant.note(step.rows);
    const uint32_t passes = sweep(step.rows, step.state, step.h, kBondShare * tolerance.bond, leave);
    charge(w, step, uint64_t{passes} * step.rows.nbond);
    ++step.sweeps;
    Residual left = inner_residual(step.rows, step.state, step.h, tolerance);
    if (asks && left.due > 0.5 && step.redundant.stands(step.rows, step.state, step.h, tolerance))
      left = inner_residual(step.rows, step.state, step.h, tolerance);
    if (!(left.due <= kRunsAway * std::max(1.0, best)) || !(left.due < std::numeric_limits<double>::max())) {
      step.rows.impulse.assign(step.best_impulse.begin(), step.best_impulse.end());
      return step.rows.restore();
    }
    if (good(step, left, 0.5)) return;
    if (left.due < best) {
      best = left.due;
      step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
    }
    if (!may_sweep(w, step, left, cap)) break;
    // what stands is seen from one plain sweep to the next
    asks = asks_redundant(step);
    acceleration.follow(step.rows, !asks);
  }
  if (std::isinf(best)) return;
  for (uint32_t i = 0; i < step.rows.all(); ++i) {
    double *const l = &step.rows.impulse[size_t(i) * 3];
    const Vec3 change = load3(&step.best_impulse[size_t(i) * 3]) - load3(l);
    if (change.x == 0 && change.y == 0 && change.z == 0) continue;
    step.rows.apply(i, change);
    store3(l, load3(&step.best_impulse[size_t(i) * 3]));
  }
  if (best > 0.5 && step.bodies_revise) settle(w, step, tolerance, best);
  if (best > 1) stride_on(w, step, tolerance);
}

}  // namespace

void give_impulses(StepContext &step) {
  const ContactRows &rows = step.rows;
  distribute(step.contacts, rows.frame.data(), rows.impulse.data(), step.sinks, step.bonds,
             rows.impulse.data() + size_t{3} * rows.n);
}

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
  take_choices(step);
  if (step.rigid_again) step.best_impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  make_bonds(w, step, step.rigid_again || step.guard.resolving);
  step.rows.build(step.contacts, step.sources, {step.rigid_places, step.rigid_groups}, step.bonds);
  correct_rigids(w, step);
  fill_responses(w, step);
  step.tangents.resize(size_t(3) * n);
  step.match.resize(n);
  warm_start(w.store, step.contacts, step.h, step.rows, step.state, step.tangents.data(), step.match.data());
  share_areas(w, step);
  fit_bristles(w, step);
  step.rows.recovery = w.def.recovery_speed;
  step.rows.finish(step.contacts, step.tangents.data(), step.h, step.guard.planned, w.offset, step.bonds);
  run_belts(step);
  std::copy(step.bond_impulse.begin(), step.bond_impulse.end(),
            step.rows.impulse.begin() + std::ptrdiff_t{3} * step.rows.n);
  if (step.guard.resolving) guard_impulses(step);
  if (!step.guard.kept.empty()) guard_rates(step);
  if (step.rigid_again) step.rows.impulse.assign(step.best_impulse.begin(), step.best_impulse.end());
  step.batches.gather(w.pairs.laws, step.state);
}

// Passes until the true residual is good enough; a law that failed, or null.
const LawInstance *solve_rows(World &w, StepContext &step) {
  const double gap_margin = normal_at_rest(w, step.h), least = tangent_at_rest(w, step.h);
  const bool memory = step.batches.remembers();
  // an equilibrium is as good as its contacts: nothing is left to a next sub-step
  const ToleranceBounds bounds =
      w.prescribed.stands()
          ? ToleranceBounds{least, least, least}
          : ToleranceBounds{least, memory || step.bodies_revise ? kRememberedRest * least : gap_margin,
                            memory ? kRememberedShare * gap_margin : gap_margin};
  for (;;) {
    charge(w, step, 4 * uint64_t{step.rows.all()});
    const double *const response = trial_response(w, step);
    set_trial(step.rows, step.h, response, step.state);
    // The sweeps take the next Newton step from there: what is asked a hundredth off is answered to a
    // ten-thousandth.
    if (const LawInstance *bad = step.batches.answer(step.h, response, 0.1 * least, 1e-2, step.state))
      return bad;
    if (step.batches.smooth()) linearize(step.rows, step.h, step.state);
    ++step.passes;
    if (step.sweeps) {
      step.residual = true_residual(step.rows, step.state, step.h, step.tolerance);
      if (good(step, step.residual, 1) || step.passes > w.def.max_passes ||
          !(may_sweep(w, step, step.residual, w.def.max_sweeps) || may_ask(w, step)))
        return nullptr;
    }
    if (const LawInstance *bad = step.batches.slopes(step.h, step.state)) return bad;
    if (step.batches.differences()) linearize(step.rows, step.h, step.state);
    if (!step.sweeps) {
      set_tolerance(step.rows, step.state, step.contacts, step.h, bounds,
                    static_cast<uint32_t>(w.bodies.size()), step.disturbance, step.tolerance);
      step.redundant.allow(step.tolerance);
    }
    // at least one sweep on a warm start is part of the method
    sweep_until_good(w, step, step.acceleration, step.tolerance);
  }
}

namespace {

// After the operator has changed.
void finish_rows(World &w, StepContext &step) {
  step.rows.finish(step.contacts, step.tangents.data(), step.h, step.guard.planned, w.offset, step.bonds);
  run_belts(step);
  if (!step.guard.kept.empty()) guard_rates(step);
}

// The body's velocities without contact, anew.
void take_velocities(Body &b, StepContext &step, const ContactRows::Block &block) {
  gather_surface(b.surface, b.p.x.data(), b.dynamics->point_velocity());
  for (uint32_t k = 0; k < block.count; ++k)
    std::copy_n(b.dynamics->contact_velocity() + size_t{kStride} * step.rows.point[block.first + k], kStride,
                &step.rows.y_free[size_t{kStride} * (block.first + k)]);
}

enum class Revised { nothing, something, diverged, failed };

// Bodies whose forces are not linear in the velocity look at what the impulses have made of them. What they
// answer then is put in the place of what they answered before; impulses stay.
Revised revise_bodies(World &w, StepContext &step, bool last = false) {
  if (!step.bodies_revise) return Revised::nothing;
  give_impulses(step);
  bool velocities = false, responses = false;
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (block.group != kNone) continue;
    Body &b = *w.bodies[block.source];
    const Revision found = b.dynamics->revise(sub_step_of(w, step), b.surfel_impulse.data(), last);
    if (found == Revision::failed) {
      set_last_error(format("step %llu, body '%s': model '%s' could not answer at the state that contact "
                            "leads to; take a smaller step or change the model",
                            static_cast<unsigned long long>(w.step_count), b.name.c_str(), b.model.type->id)
                         .c_str());
      return Revised::failed;
    }
    if (found == Revision::diverged) {
      step.unsettled = &b;
      return Revised::diverged;
    }
    if (found == Revision::none) continue;
    velocities = true;
    take_velocities(b, step, block);
    if (found != Revision::response) continue;
    responses = true;
    fill_response(w, step, block);
  }
  if (!velocities) return Revised::nothing;
  if (responses) finish_rows(w, step);
  step.rows.restore();
  return Revised::something;
}

// Back to the free motion, where the last impulses lead to no state: they need not hold together any more.
void forget_revisions(World &w, StepContext &step) {
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (block.group != kNone) continue;
    Body &b = *w.bodies[block.source];
    double kinetic = 0;
    if (!b.dynamics->abilities().revises || !b.dynamics->free_motion(sub_step_of(w, step), kinetic)) continue;
    take_velocities(b, step, block);
    fill_response(w, step, block);
  }
  finish_rows(w, step);
  step.rows.restore();
}

// With what rigid hosts and bodies answer differently by the impulses that are found: the same problem again,
// from these impulses. At first they are those of the last sub-step. A body at rest is linear enough around
// the state that these hold it in; around its free motion the first solve would let it fall, and friction
// with memory slide, from where the sweeps do not find back.
const LawInstance *solve_revised(World &w, StepContext &step, Revised &revised) {
  uint32_t passes = 0, sweeps = 0;
  const LawInstance *bad = nullptr;
  Revised warm = Revised::something;
  for (uint32_t k = 0; k < kWarmRevisions && warm == Revised::something; ++k) warm = revise_bodies(w, step);
  if (warm == Revised::diverged || warm == Revised::failed) forget_revisions(w, step);
  for (uint32_t hosts = 0, again = 0, capped = 0;;) {
    bad = solve_rows(w, step);
    const bool beyond = step.sweeps >= w.def.max_sweeps;
    passes += std::exchange(step.passes, 0);
    sweeps += std::exchange(step.sweeps, 0);
    if (bad) break;
    // A motor holds or lets go.
    if (hosts < kMostRevisions && !step.rows.rigid.empty() && revise_rigids(w, step)) {
      finish_rows(w, step);
      ++hosts;
      continue;
    }
    capped += beyond || step.residual.due > 1;
    revised = revise_bodies(w, step, capped >= kMostCapped);
    if (revised == Revised::nothing && step.bodies_revise && step.residual.due > 1 && again++ < kMostAgain)
      continue;
    if (revised != Revised::something) break;
  }
  step.passes = passes;
  step.sweeps = sweeps;
  return bad;
}

// Else the sub-step is to be taken anew, with the motion that goes with contacts.
bool contacts_taken(World &w, StepContext &step) {
  bool all = true;
  for (const ContactPoint &c : step.contacts) {
    if (!w.bodies[c.slot_a]->dynamics->take_contact()) all = false;
    if (!c.obstacle && !w.bodies[c.slot_b]->dynamics->take_contact()) all = false;
  }
  for (const Attachment &a : w.attachments) {
    if (a.released) continue;
    for (const uint64_t id : {a.body, a.to})
      if (const uint32_t slot = slot_of(w, id);
          slot != kNone && !w.bodies[slot]->slumber.asleep && !w.bodies[slot]->dynamics->take_contact())
        all = false;
  }
  step.guard.again = step.guard.again || !all;
  return all;
}

// Shorter, a body moves less far from where its forces are known.
bool retry_shorter(World &w, StepContext &step, uint32_t *trouble) {
  if (step.h > kLeastPiece * step.guard.planned) {
    step.guard.again = true;
    step.guard.cut = 0.5;
    return false;
  }
  set_last_error(
      format("step %llu, body '%s': no state was found in which its forces and contacts agree, not "
             "even in a sub-step of %g s; take a smaller step, or lessen the stiffness",
             static_cast<unsigned long long>(w.step_count), step.unsettled->name.c_str(), step.h)
          .c_str());
  *trouble |= DFM_TROUBLE_NONFINITE;
  return false;
}

}  // namespace

bool stage_solve(World &w, StepContext &step, uint32_t *trouble) {
  ask_pre_solve(w, step);
  if (!contacts_taken(w, step)) return false;
  step.passes = step.sweeps = 0;
  step.residual = {};
  make_rows(w, step);
  apply_last(step.rows);
  step.redundant.start();
  if (step.rows.all() == 0) {
    w.stats.passes = w.stats.sweeps = 0;
    w.stats.residual = 0;
    reserve_contacts(w, step);
    return true;
  }
  Revised revised = Revised::nothing;
  const LawInstance *const bad = solve_revised(w, step, revised);
  if (revised == Revised::diverged) return retry_shorter(w, step, trouble);
  if (revised == Revised::failed) {
    *trouble |= DFM_TROUBLE_PLUGIN;
    return false;
  }
  double poison = 0;
  for (double l : step.rows.impulse) poison += 0.0 * l;
  if (bad || poison != 0) {
    *trouble |= tell_failed_solve(w, step, bad);
    return false;
  }
  step.bond_impulse.assign(step.rows.impulse.begin() + std::ptrdiff_t{3} * step.rows.n,
                           step.rows.impulse.end());
  // laws may have been asked beside the slips that were solved for
  std::swap(step.state.vt, step.state.slip);
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
