// The outer loop of one island over the laws, around the inner sweeps (doc/concepts/contact.md).
#include "step/solve_islands.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact/bonds.h"
#include "contact/fixed_limits.h"
#include "contact/recovery.h"
#include "dynamics/relative_work.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stuck_slip.h"
#include "step/tolerance.h"

namespace dfm {
namespace {

// Laws with memory accumulate errors of the normal force instead of averaging them out. Whenever the force
// falls, the friction cone cuts off a part of the bristle, which does not come back when the force rises. A
// point that oscillates under a bristle of share s stretches it by (1 - s) of each way forth and slackens it
// by (1 + s) of each way back. Both make a held contact creep. Islands with such laws therefore use this
// share of the normal tolerance while bodies move, and this share of the tangential one at rest
// (doc/decisions/friction_memory.md). So do bodies whose end state is solved for: stiff ones sag by less
// than the normal tolerance in a long step.
constexpr double kRememberedShare = 0.05, kRememberedRest = 1e-3;

// The limit of sweeps may leave a solve inexact, but must not let bodies pass through each other. If a normal
// residual would consume more than a tenth of the rest distance within the sub-step, up to kBeyondCap times
// as many sweeps are made (many surfels on few phyxels, at a hard impact).
constexpr uint32_t kBeyondCap = 8, kFewSweeps = 8;  // kFewSweeps: at least, on a short budget

// Impulses at explicit bodies move single points, so a sweep costs little beside the forces of the bodies,
// but contacts that share points may need hundreds of sweeps. After kAccelerated sweeps the solve continues
// with momentum, beyond the limit up to kMostBeyond times as many sweeps, while all rows together are swept
// at most kFreeShare times per unit of the sub-step's work without contact. A residual that does not fall is
// no reason to stop: it can stay the same for hundreds of sweeps while loads move to other contacts
// (doc/decisions/contact_solver.md).
constexpr uint32_t kAccelerated = 50, kMostBeyond = 20, kLookBeyond = 4;
constexpr double kFreeShare = 32;
bool glides(const SolveIsland &own) { return !(own.soft || own.revises || own.batches.remembers()); }
double affordable_sweeps(const World &w, const StepContext &step, const SolveIsland &own) {
  if (!glides(own)) return 0;
  const double share =
      kFreeShare * double(body_work(w, step) + surface_work(w, step)) / double(own.spent.all);
  return std::min(share, double(kMostBeyond) * w.def.max_sweeps);
}

// Whether another sweep would take what the end of the solve needs.
constexpr uint64_t kBareEnd = 8;  // per row: two sweeps that hold work back, the laws, one sweep
bool out_of_work(const StepContext &step, SolveIsland &own) {
  if (holds_barely(step, own.spent, kBareEnd * own.part.all())) return false;
  own.spent.used = std::max(own.spent.used, Thrift::sweeps);
  return true;
}

bool may_sweep(const World &w, const StepContext &step, SolveIsland &own, const Residual &residual,
               uint32_t cap) {
  if (own.sweeps >= kFewSweeps && spares(step, own.spent, Thrift::sweeps)) return false;
  if (out_of_work(step, own)) return false;
  if (own.sweeps < cap) return true;
  if (own.affordable < 0) own.affordable = affordable_sweeps(w, step, own);
  if (own.sweeps < own.affordable) return true;
  return residual.normal * step.h > 0.1 * w.offset && own.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps;
}

// Residual::relative is stricter than what is required (Residual::due). Sweeps that only improve the former
// are polish. A sub-step spends at most this many sweeps on it, because the next sub-step continues from
// there.
constexpr uint32_t kPolish = 20;
bool good(const StepContext &step, SolveIsland &own, const Residual &left, double most) {
  return left.relative <= most || (left.due <= most && (own.sweeps >= kPolish || own.stalls ||
                                                        spares(step, own.spent, Thrift::polish)));
}

// Sweeps diverge if the residual exceeds this times the best one: block Gauss-Seidel need not converge in a
// jam with strong friction, and if the laws are affine, nothing else stops it before numbers overflow.
constexpr double kRunsAway = 1e6;

// A law with memory is linearized, so the solution is accurate only near the slip at which the law was
// evaluated. Where nearly redundant normal forces use up all sweeps of the first pass, that slip is the one
// before contact: the bodies would keep, and be pushed by, friction that no law gives. Beyond the limit of
// sweeps the laws are therefore evaluated again, followed by this many sweeps each time.
constexpr uint32_t kPassSweeps = 20;
// Where the budget does not hold all sweeps, no pass may use up what the others need
// (doc/decisions/budgets.md).
bool is_tight(const World &w, const StepContext &step, const SolveIsland &own) {
  const uint64_t most = uint64_t{kBeyondCap} * w.def.max_sweeps;
  return step.budget.divided && own.batches.remembers() && own.sweeps < most &&
         !holds(step, own.spent, (most - own.sweeps) * own.part.all());
}
bool asks_beyond(const World &w, const SolveIsland &own) {
  return own.sweeps >= w.def.max_sweeps && own.batches.remembers();
}
bool may_ask(const World &w, const StepContext &step, SolveIsland &own) {
  return asks_beyond(w, own) && own.residual.due > 1 &&
         own.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps && !spares(step, own.spent, Thrift::sweeps);
}

// The response with which a contact estimates the slip at which it would come to rest alone. If many contacts
// hold one body, each with its own response reverses the body's slip instead of stopping it, and the laws say
// "slide" in one direction and the other in turn, forever. Beyond the limit of sweeps each contact uses the
// summed response of all loaded contacts. Where few of them bear most of the load, that can cycle as well:
// from then on, two passes with one response that do not halve the residual are followed by passes with the
// other response.
constexpr double kHalves = 0.5;
void choose_response(const World &w, SolveIsland &own) {
  if (!asks_beyond(w, own)) return;
  if (!own.asked) own.common = true;
  else if (own.asked >= 2 && !(own.due <= kHalves * own.due_before)) {
    own.common = !own.common;
    own.asked = 0;
  }
  ++own.asked;
}
const double *trial_response(StepContext &step, const SolveIsland &own) {
  const ContactRows &rows = step.rows;
  if (!own.common) return rows.wt.data();
  double loaded = 0;
  each_row(own.part.contacts, [&](uint32_t i) { loaded += rows.impulse[size_t(i) * 3] > 0; });
  each_row(own.part.contacts,
           [&](uint32_t i) { step.trial_response[i] = rows.wt[i] * std::max(1.0, loaded); });
  return step.trial_response.data();
}

// Copies the island's rows of columns of size [3 rows].
void copy_impulses(const RowsPart &part, const Array<double> &from, Array<double> &to) {
  const auto copy = [&](std::span<const RowRun> runs) {
    for (const RowRun &r : runs)
      std::copy_n(from.data() + size_t(3) * r.first, size_t(3) * r.n, to.data() + size_t(3) * r.first);
  };
  copy(part.contacts);
  copy(part.bonds);
}
void keep_best(StepContext &step, const SolveIsland &own) {
  copy_impulses(own.part, step.rows.impulse, step.best_impulse);
}
// Back to the best impulses; velocities change by the difference.
void go_to_best(StepContext &step, const SolveIsland &own) {
  ContactRows &rows = step.rows;
  const auto go = [&](uint32_t i) {
    double *const l = &rows.impulse[size_t(i) * 3];
    const Vec3 best = load3(&step.best_impulse[size_t(i) * 3]), change = best - load3(l);
    if (change.x == 0 && change.y == 0 && change.z == 0) return;
    rows.apply(i, change);
    store3(l, best);
  };
  each_row(own.part.contacts, go);
  each_row(own.part.bonds, go);
}
void take_best(StepContext &step, const SolveIsland &own) {
  copy_impulses(own.part, step.best_impulse, step.rows.impulse);
  step.rows.restore(own.part);
}

// Bonds are solved to a share of their tolerance, so that the residual of the next sweep comes from contacts.
constexpr double kBondShare = 0.1;
void solve_island_bonds(const World &w, StepContext &step, SolveIsland &own) {
  if (!own.part.nbond) return;
  const uint32_t passes = solve_bonds(step.rows, own.part, kBondShare * own.tolerance.bond, own.scratch);
  spend(w, step, own.spent, uint64_t{passes} * own.part.nbond);
}

void sweep_once(const World &w, StepContext &step, SolveIsland &own, double leave) {
  own.spent.effort += own.effort;
  spend(w, step, own.spent, own.part.all());
  sweep(step.rows, own.part, step.state, step.h, leave);
  ++own.sweeps;
  solve_island_bonds(w, step, own);
}

// For bodies with few degrees of freedom, sweeps redistribute loads too slowly: at the limit of sweeps the
// solve continues with proximal steps. rho is 1000 over a contact's own response, and less if a step fails
// with it. The steps of a part cost at most kStridesOverCap times its sweeps up to the limit; the next
// sub-step continues from there. Bodies that revise their response take no such steps, because large changes
// of impulses would change the response.
constexpr uint32_t kMostStrides = 12, kStridesOverCap = 32;
constexpr double kRho = 1e3, kLeastRho = 10;
void stride_on(const World &w, StepContext &step, SolveIsland &own, uint32_t part) {
  Proximal &proximal = own.proximal;
  const std::span<const uint32_t> contacts = proximal.contacts(part);
  const auto left = [&] { return inner_residual(step.rows, step.state, step.h, own.tolerance, contacts); };
  double best = left().due, rho = kRho;
  if (best <= 1 || !proximal.take(step.rows, part)) return;
  const uint64_t most = uint64_t{kStridesOverCap} * w.def.max_sweeps * contacts.size();
  uint64_t work = 0;
  for (uint32_t k = 0; k < kMostStrides && rho >= kLeastRho && work < most; ++k) {
    const bool found = proximal.stride(step.rows, step.state, step.h, rho);
    work += proximal.work();
    spend(w, step, own.spent, proximal.work());
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
    if (good(step, own, now, 0.5)) break;
  }
  proximal.put(step.rows, step.best_impulse.data());
}
// Laws with memory are linearized at the slip before contact in the first pass, and at that of the pass
// before in later ones. Solving a linearization to less than this share of its own error would be wasted.
constexpr double kTangentShare = 0.1;
bool strides_help(const SolveIsland &own, double left) {
  return left > 1 &&
         (!own.batches.remembers() || (own.passes > 1 && left > kTangentShare * own.residual.due));
}
void stride_on(const World &w, StepContext &step, SolveIsland &own) {
  if (spares(step, own.spent, Thrift::sweeps)) return;
  const uint32_t parts = own.proximal.find_parts(step.rows, own.part, step.revised);
  for (uint32_t part = 0; part < parts; ++part) stride_on(w, step, own, part);
}

// Nearly redundant contacts of bodies that revise their response. Normal forces that
// hold a body in more places than it can move in are consistent only to a few 1e-8 m: each sweep takes a
// little load from a contact that is that far open and gives it to others, until the first has no load, and
// friction follows. So once the polish is over, contacts whose normal velocity is within kLeave of the
// tolerance keep their normal impulses. At the limit of sweeps, as many sweeps are added, with momentum, from
// the best state.
constexpr double kLeave = 0.2;
double leave_of(const SolveIsland &own) {
  return own.revises && own.sweeps >= kPolish ? kLeave * own.tolerance.most_normal : 0;
}
void settle(const World &w, StepContext &step, SolveIsland &own, double &best) {
  own.momentum.start(step.rows, own.part);
  for (uint32_t k = 0; k < w.def.max_sweeps && !spares(step, own.spent, Thrift::sweeps); ++k) {
    sweep_once(w, step, own, kLeave * own.tolerance.most_normal);
    const Residual left = inner_residual(step.rows, own.part, step.state, step.h, own.tolerance);
    if (left.due < best) {
      best = left.due;
      keep_best(step, own);
    }
    if (left.due <= 0.5) return;
    if (!(left.due <= kRunsAway * std::max(1.0, best))) break;
    own.momentum.follow(step.rows, own.part);
  }
  take_best(step, own);
}

// Whether velocities have stopped changing is checked after every kAskStands sweeps, once the polish is over.
// Laws with memory are left out, because the remaining slip stretches bristles, and so is static mode, whose
// contacts must be solved. Bodies that do not revise their response are checked between cut faces only
// (doc/decisions/contact_solver.md).
constexpr uint32_t kAskStands = 4;
bool asks_redundant(const World &w, const StepContext &step, SolveIsland &own) {
  const uint8_t *const cut = step.solve_islands->of_cuts();
  if (!(own.revises || cut) || own.sweeps < kPolish || own.sweeps % kAskStands != 0 ||
      own.batches.remembers() || w.prescribed.stands())
    return false;
  return own.revises ? own.redundant.found(step.rows, own.part, cut)
                     : own.redundant.found_at_cuts(step.rows, own.part, cut);
}

// Many contacts on one implicit body (contact/tresca.h). This method is tried when sweeps reach their limit
// without a result. Later solves of the sub-step resemble the first one and begin with this method: sweeps
// that stall leave errors by which the body revises its response, and do not undo them.
constexpr double kBackedMost = 0.1;  // of the tolerance: bodies revise their response by the rest
class BodyBacked final : public BackedResponse {
 public:
  explicit BodyBacked(Dynamics &body) : body_(body) {}
  bool factor(const Backing &contacts) override { return body_.back(contacts); }
  bool solve(const Backing &contacts, const double *impulse, double *change) override {
    return body_.backed_response(contacts, impulse, change);
  }

 private:
  Dynamics &body_;
};
Backs solve_backed(const World &w, StepContext &step, SolveIsland &own, double most) {
  if (!own.revises || !own.backs || own.sweeps < (own.stalls ? 0 : w.def.max_sweeps) ||
      spares(step, own.spent, Thrift::sweeps))
    return Backs::never;
  own.backs = Tresca::serves(step.rows, own.part, step.state);
  if (!own.backs) return Backs::never;
  Dynamics &body = *w.bodies[step.rows.blocks[own.part.blocks[0]].source]->dynamics;
  const Backs when = body.backs();
  own.backs = when == Backs::now || (when == Backs::later && !own.stalls);  // once
  own.stalls = own.backs;
  if (when != Backs::now) return own.backs ? when : Backs::never;
  BodyBacked backed(body);
  own.backs = own.stalls =
      own.tresca.solve(step.rows, own.part, step.state, step.h, own.tolerance, kBackedMost, most, backed);
  own.stuck = !own.backs;
  own.spent.effort += own.tresca.products() * own.effort;
  spend(w, step, own.spent, uint64_t{own.tresca.products()} * own.part.all());
  return own.backs ? Backs::now : Backs::never;
}

// If neither sweeps nor that method find a result, the sub-step is repeated, shorter: the body then moves
// less far.
bool gives_up(const StepContext &step, const SolveIsland &own) { return own.stuck && may_shorten(step); }

// Decides after which sweeps the residual is computed. For explicit bodies it costs as much as a sweep. A
// sweep seldom reduces the residual to less than a quarter, and seldom to less than a half if the sweeps
// before left more than 0.7 of it; so the residual is computed when it could be small enough at the earliest.
// After the polish it is computed each time, because the best state is searched for
// (doc/decisions/contact_solver.md).
class Looks {
 public:
  bool due(const StepContext &step, const SolveIsland &own, uint32_t cap) const {
    if (own.sweeps >= std::min({next_, kPolish, cap}) || !own.part.blocks.empty()) return true;
    Spent spent = own.spent;
    return (own.sweeps >= kFewSweeps && spares(step, spent, Thrift::sweeps)) ||
           !holds_barely(step, spent, kBareEnd * own.part.all());
  }
  void note(uint32_t sweeps, const Residual &left, double most) {
    const int size = std::ilogb(left.due / most);  // in halves
    const bool slow = known_ && 2 * (size_ - size) <= int(sweeps - at_);
    const int sweeps_left = slow ? size + 1 : (size + 2) / 2;
    next_ = sweeps + uint32_t(std::clamp(sweeps_left, 1, kMostUnseen));
    known_ = true;
    size_ = size;
    at_ = sweeps;
  }

 private:
  static constexpr int kMostUnseen = 4;
  bool known_ = false;
  int size_ = 0;
  uint32_t at_ = 0, next_ = 0;
};

// Sweeps with the laws as they were last evaluated. At the limit of sweeps the best state is taken, not the
// last one. Returns whether the result is good enough.
bool sweep_until_good(const World &w, StepContext &step, SolveIsland &own) {
  ContactRows &rows = step.rows;
  const bool tight = is_tight(w, step, own);
  const uint32_t cap = tight || asks_beyond(w, own) ? own.sweeps + kPassSweeps : w.def.max_sweeps;
  double best = std::numeric_limits<double>::infinity();
  keep_best(step, own);
  own.acceleration.start(rows, own.part);
  constexpr double kMost = 0.5;  // of the tolerance
  if (own.stalls) {
    if (inner_residual(rows, own.part, step.state, step.h, own.tolerance).due <= kMost) return true;
    if (solve_backed(w, step, own, kMost) == Backs::now) return true;
    if (gives_up(step, own)) return false;
  }
  bool asks = false, momentum = false;
  Looks looks;
  for (double before = leave_of(own);;) {
    const double leave = leave_of(own);
    if (leave > before) own.acceleration.start(rows, own.part);
    before = leave;
    if (asks) own.redundant.note(rows, own.part);
    sweep_once(w, step, own, leave);
    if (momentum && own.sweeps % kLookBeyond) {
      own.momentum.follow(rows, own.part);
      continue;
    }
    if (!looks.due(step, own, cap)) {
      own.acceleration.follow(rows, own.part);
      continue;
    }
    Residual left = inner_residual(rows, own.part, step.state, step.h, own.tolerance);
    if (asks && left.due > kMost && own.redundant.stands(rows, own.part, step.state, step.h, own.tolerance))
      left = inner_residual(rows, own.part, step.state, step.h, own.tolerance);
    if (!(left.due <= kRunsAway * std::max(1.0, best)) || !(left.due < std::numeric_limits<double>::max())) {
      take_best(step, own);
      return false;
    }
    if (good(step, own, left, kMost)) return true;
    looks.note(own.sweeps, left, kMost);
    if (left.due < best) {
      best = left.due;
      keep_best(step, own);
    }
    if (glides(own) && own.sweeps >= kAccelerated && best <= 1) break;
    const Backs backs = solve_backed(w, step, own, kMost);
    if (backs == Backs::now) return true;
    if (gives_up(step, own)) return false;
    own.waits = backs == Backs::later;
    if (own.waits) break;
    if ((tight && own.sweeps >= cap) || !may_sweep(w, step, own, left, cap)) break;
    if (momentum) {
      own.momentum.follow(rows, own.part);
      continue;
    }
    momentum = glides(own) && own.sweeps >= kAccelerated;
    if (momentum) {
      go_to_best(step, own);
      own.momentum.start(rows, own.part);
      continue;
    }
    // whether velocities have stopped changing shows between two plain sweeps
    asks = asks_redundant(w, step, own);
    own.acceleration.follow(rows, own.part, !asks);
  }
  if (std::isinf(best)) return false;
  go_to_best(step, own);
  if (own.waits) return best <= 1;
  if (best > kMost && own.revises) settle(w, step, own, best);
  if (strides_help(own, best)) stride_on(w, step, own);
  return best <= 1;
}

// A solve that did not converge may leave impulses that do work: with much friction in a jam each sweep adds
// to it. If the contacts of an island do more work than their bias velocities explain, the island is solved
// again with fixed friction limits, first without friction, which cannot add energy
// (contact/fixed_limits.h, doc/decisions/contact_solver.md). most: of the work that the
// impulses would do without a response.
constexpr double kExcess = 0.1;
constexpr uint32_t kFixedSweeps = 8;  // without friction, and as many with friction
bool hold_work_back(const World &w, StepContext &step, SolveIsland &own, double most) {
  const ExcessWork excess = excess_work(step.rows, own.part);
  if (excess.work <= most * excess.scale) return false;
  drop_impulses(step.rows, own.part);
  own.limit.assign(own.part.n, 0.0);
  uint32_t each = kFixedSweeps;
  while (each > 1 && !holds_barely(step, own.spent, (2 * each + 4) * own.part.all())) each /= 2;
  for (uint32_t k = 0; k < 2 * each; ++k) {
    if (k == each) fix_limits(step.rows, own.part, step.state, own.limit);
    own.spent.effort += own.effort;
    spend(w, step, own.spent, own.part.all());
    sweep_fixed(step.rows, own.part, own.limit.data());
    ++own.sweeps;
    solve_island_bonds(w, step, own);
  }
  return true;
}

// Begins a pass: evaluates the laws at the present state. Returns false if a law has failed.
bool ask(const World &w, StepContext &step, SolveIsland &own) {
  spend(w, step, own.spent, 4 * uint64_t{own.part.all()});
  choose_response(w, own);
  const double *const response = trial_response(step, own);
  set_trial(step.rows, own.part, step.h, response, step.state);
  // The sweeps are the next Newton step: from a slip with an error of 1e-2 they reach one of 1e-4.
  if ((own.bad = own.batches.answer(step.h, response, 0.1 * tangent_at_rest(w, step.h), 1e-2, step.state)))
    return false;
  if (own.batches.smooth()) linearize(step.rows, own.part, step.h, step.state);
  ++own.passes;
  return true;
}
bool ask_slopes(StepContext &step, SolveIsland &own) {
  if ((own.bad = own.batches.slopes(step.h, step.state))) return false;
  if (own.batches.differences()) linearize(step.rows, own.part, step.h, step.state);
  return true;
}

// Evaluates the laws at the warm start, and finds the disturbance that it leaves at each body.
void start_island(const World &w, StepContext &step, SolveIsland &own) {
  if (ask(w, step, own) && ask_slopes(step, own))
    find_disturbance(step.rows, own.part, step.state, step.h, step.solve_islands->sides(),
                     step.disturbance.data());
}

// A solve that its budget has ended need not end with its best pass.
void end_at_best_pass(const World &w, StepContext &step, SolveIsland &own) {
  if (own.spent.used < Thrift::sweeps || !(own.residual.due > own.best_due) ||
      !holds_barely(step, own.spent, 4 * own.part.all()))
    return;
  copy_impulses(own.part, step.best_pass, step.rows.impulse);
  step.rows.restore(own.part);
  if (ask(w, step, own)) own.residual = true_residual(step.rows, own.part, step.state, step.h, own.tolerance);
}

// Passes until the true residual is good enough, or a law has failed.
void solve_passes(const World &w, StepContext &step, SolveIsland &own) {
  for (;;) {
    // at least one sweep on a warm start is part of the method
    if (!sweep_until_good(w, step, own)) {
      if (gives_up(step, own)) return;
      hold_work_back(w, step, own, kExcess);
    }
    if (!ask(w, step, own)) return;
    own.residual = true_residual(step.rows, own.part, step.state, step.h, own.tolerance);
    own.due_before = std::exchange(own.due, own.residual.due);
    if (own.residual.due < own.best_due) {
      own.best_due = own.residual.due;
      copy_impulses(own.part, step.rows.impulse, step.best_pass);
    }
    if (good(step, own, own.residual, 1) || own.waits || own.passes > w.def.max_passes ||
        !(may_sweep(w, step, own, own.residual, w.def.max_sweeps) || may_ask(w, step, own)))
      return end_at_best_pass(w, step, own);
    if (!ask_slopes(step, own)) return;
  }
}

// Penetration depths are opened at bias velocities that do little work. Where contacts oppose each other the
// work is large, and the island is solved again from zero impulses with lower bias velocities: first so low
// that the work, which grows with their square, should be what is allowed; then with none, which adds no
// energy (contact/recovery.h, doc/decisions/contact_solver.md).
constexpr double kSlowOpening = 0.03;  // of the rest distance in a sub-step: this is always allowed
double share_of_opening(const ContactRows &rows, const RowsPart &part, double slow) {
  const OpeningWork opening = opening_work(rows, part, slow);
  if (!(opening.put_in > opening.allowed)) return 1;
  const double work = work_of_opening(rows, part, opening.put_in);
  return work > opening.allowed ? std::sqrt(opening.allowed / work) : 1;
}

// Impulses of contacts that oppose each other are large and nearly cancel, so they do noticeable work even at
// velocities within the tolerance. An island in which bias velocities do much work must therefore do none
// beyond it, whether its solve has converged or not (doc/decisions/energy_watch.md).
void solve_island(const World &w, StepContext &step, SolveIsland &own) {
  if (own.bad || own.thrown) return;
  const double gap_margin = normal_at_rest(w, step.h), least = tangent_at_rest(w, step.h);
  const bool memory = own.batches.remembers();
  // static mode: no later sub-step corrects what this solve leaves
  const ToleranceBounds bounds =
      w.prescribed.stands()
          ? ToleranceBounds{least, least, least}
          : ToleranceBounds{least, memory || own.revises ? kRememberedRest * least : gap_margin,
                            memory ? kRememberedShare * gap_margin : gap_margin};
  set_tolerance(step.rows, own.part, step.contacts, step.h, bounds, step.solve_islands->sides(),
                step.disturbance.data(), own.tolerance);
  own.redundant.allow(own.part, own.tolerance);
  ask_slip_back(w, step, own);
  const double slow = kSlowOpening * w.offset / step.guard.planned;
  for (bool last = false;;) {
    solve_passes(w, step, own);
    if (own.bad || gives_up(step, own)) return;
    const bool dear = opens_dearly(step.rows, own.part, slow);
    if (!dear && !own.slowed) return;
    const double share = dear && !last ? share_of_opening(step.rows, own.part, slow) : 1;
    if (!(share < 1)) {
      if (hold_work_back(w, step, own, 0) && ask(w, step, own))
        own.residual = true_residual(step.rows, own.part, step.state, step.h, own.tolerance);
      return;
    }
    last = own.slowed;
    slow_opening(step.rows, own.part, last ? 0 : share);
    own.slowed = true;
    drop_impulses(step.rows, own.part);
    own.start();
    if (!ask(w, step, own) || !ask_slopes(step, own)) return;
  }
}

// The work of a sweep, in multiplications of a triangular solve that take as long. An impulse at a surfel
// moves all touched surfels of its body: three columns, read four numbers at a time, which wait for memory if
// the response is larger than a cache (doc/decisions/implicit_time.md).
constexpr double kPairWork = 1.5, kFarPairWork = 6;
constexpr uint32_t kFar = 100;  // surfels: 1 MB
double work_of_sweep(const ContactRows &rows, const RowsPart &part, bool blocks) {
  double sum = kUnitWork * (blocks ? kSweptBlockUnits : kSweptUnits) * part.all();
  if (!blocks) return sum;
  each_row(part.contacts, [&](uint32_t i) {
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      const uint32_t block = rows.block[rows.dof[j]], count = block == kNone ? 0 : rows.blocks[block].count;
      sum += (count > kFar ? kFarPairWork : kPairWork) * count;
    }
  });
  return sum;
}

}  // namespace

SolveIslands::SolveIslands(const Memory &m) : memory_(m), joined_(m) {
  use_memory(m, pairs_, owner_, met_, side_, body_of_, largest_, sides_, of_cuts_, order_, contact_, bond_,
             block_, begin_);
}

// Joins pairs that move the same unknown.
void SolveIslands::join(const ContactRows &rows) {
  joined_.start(static_cast<uint32_t>(pairs_.size()));
  owner_.assign(pairs_.size() > 1 ? rows.ndof : 0, kNone);
  for (uint32_t k = 0; k < pairs_.size() && !owner_.empty(); ++k) {
    bool points = false;  // if a pair moves none, its first row is enough
    const auto move = [&](uint32_t dof) {
      const uint32_t block = rows.block[dof];
      points = points || block == kNone;
      uint32_t &owner = owner_[block == kNone ? dof : rows.blocks[block].first];
      if (owner == kNone) owner = k;
      else if (owner != k) joined_.join(owner, k);
    };
    const RowRun run = pairs_[k].rows;
    for (uint32_t i = run.first; i < run.first + run.n; ++i) {
      for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) move(rows.dof[j]);
      if (!rows.rigid.empty() && rows.rigid[i] != kNone) move(rows.rigid[i]);
      if (!points) break;
    }
  }
  joined_.finish();
  count_ = joined_.count;
}

// Numbers the bodies on both sides of contacts. A body in two islands gets two numbers.
void SolveIslands::number_sides(size_t bodies, size_t of_contacts) {
  met_.assign(bodies, kNone);
  side_.resize(bodies);
  body_of_.clear();
  const auto number = [&](uint32_t body, uint32_t island) {
    if (body == kNone) return kNone;
    if (std::exchange(met_[body], island) != island) {
      side_[body] = static_cast<uint32_t>(body_of_.size());
      body_of_.push_back(body);
    }
    return side_[body];
  };
  for (uint32_t k = 0; k < count_; ++k)
    for (uint32_t m = joined_.begin[k]; m < joined_.begin[k + 1]; ++m) {
      const Pair &p = pairs_[joined_.member[m]];
      if (joined_.member[m] >= of_contacts) continue;
      const uint32_t a = number(p.a, k), b = number(p.b, k);
      for (uint32_t i = p.rows.first; i < p.rows.first + p.rows.n; ++i) {
        sides_[2 * size_t{i}] = a;
        sides_[2 * size_t{i} + 1] = b;
      }
    }
}

bool SolveIslands::shares_sides() const {
  size_t bodies = 0;
  for (const uint32_t m : met_) bodies += m != kNone;
  return bodies < body_of_.size();
}

void SolveIslands::largest_by_body(Array<double> &values) {
  largest_.assign(2 * met_.size(), 0.0);
  const auto each = [&](auto &&f) {
    for (size_t s = 0; s < body_of_.size(); ++s)
      for (size_t k = 0; k < 2; ++k) f(values[2 * s + k], largest_[2 * size_t{body_of_[s]} + k]);
  };
  each([](double value, double &most) { most = std::max(most, value); });
  each([](double &value, double most) { value = most; });
}

void SolveIslands::find_cuts(const World &w, const StepContext &step) {
  const auto cut = [&](uint32_t slot) {
    const Surface &s = w.bodies[slot]->surface;
    return s.slit || s.back > 0;
  };
  of_cuts_.clear();
  if (std::none_of(w.bodies.begin(), w.bodies.end(), [&](auto &b) { return cut(b->slot); })) return;
  for (const ContactPoint &c : step.contacts)
    of_cuts_.push_back(!c.obstacle && cut(c.slot_a) && cut(c.slot_b));
}

// Contacts of the same two bodies are neighbors in the list, so most work is done once for each pair.
void SolveIslands::find(const World &w, StepContext &step) {
  const size_t of_contacts = find_pairs(step);
  join(step.rows);
  sides_.resize(2 * size_t{step.rows.n});
  number_sides(w.bodies.size(), of_contacts);
  find_cuts(w, step);
  while (islands_.size() < count_) islands_.emplace_back(memory_);
  give_rows(of_contacts);
  sort_blocks(step.rows.blocks);
  prepare(w, step);
  std::sort(order_.begin(), order_.end(), [&](uint32_t l, uint32_t r) {
    const uint32_t a = islands_[l].part.all(), b = islands_[r].part.all();
    return a != b ? a > b : l < r;
  });
}

size_t SolveIslands::find_pairs(const StepContext &step) {
  pairs_.clear();
  const auto add = [&](const auto &all, uint32_t first) {
    for (uint32_t i = 0; i < all.size();) {
      const auto &c = all[i];
      const uint32_t begin = i, a = c.slot_a, b = c.slot_b, obstacle = c.obstacle;
      while (++i < all.size() && all[i].slot_a == a && all[i].slot_b == b && all[i].obstacle == obstacle) {}
      pairs_.push_back({a, obstacle ? kNone : b, {first + begin, i - begin}});
    }
  };
  add(step.contacts, 0);
  const size_t of_contacts = pairs_.size();
  add(step.bonds, step.rows.n);
  return of_contacts;
}

// begin_[k] is then the end of island k's, where that of the next one begins.
void SolveIslands::split(std::span<const Pair> pairs, Array<RowRun> &out) {
  const auto of = [&](const Pair &p) { return joined_.of[size_t(&p - pairs_.data())]; };
  begin_.assign(size_t{count_} + 1, 0);
  uint32_t last = kNone;
  for (const Pair &p : pairs)
    if (const uint32_t k = of(p); k != std::exchange(last, k)) ++begin_[k + 1];
  for (uint32_t k = 0; k < count_; ++k) begin_[k + 1] += begin_[k];
  out.resize(begin_[count_]);
  last = kNone;
  for (const Pair &p : pairs) {
    const uint32_t k = of(p);
    if (k != std::exchange(last, k)) out[begin_[k]++] = p.rows;
    else out[begin_[k] - 1].n += p.rows.n;
  }
}

void SolveIslands::give_rows(size_t of_contacts) {
  const auto rows_of = [](std::span<const RowRun> runs) {
    uint32_t n = 0;
    for (const RowRun &r : runs) n += r.n;
    return n;
  };
  split({pairs_.data(), of_contacts}, contact_);
  for (uint32_t k = 0; k < count_; ++k) {
    RowsPart &part = islands_[k].part;
    part.contacts = slice(contact_, k);
    part.n = rows_of(part.contacts);
  }
  split({pairs_.data() + of_contacts, pairs_.size() - of_contacts}, bond_);
  for (uint32_t k = 0; k < count_; ++k) {
    RowsPart &part = islands_[k].part;
    part.bonds = slice(bond_, k);
    part.nbond = rows_of(part.bonds);
  }
}

void SolveIslands::sort_blocks(const Array<ContactRows::Block> &blocks) {
  const auto of_block = [&](const ContactRows::Block &b) {
    return owner_.empty() ? 0 : joined_.of[owner_[b.first]];
  };
  begin_.assign(size_t{count_} + 1, 0);
  for (const ContactRows::Block &b : blocks) ++begin_[of_block(b) + 1];
  for (uint32_t k = 0; k < count_; ++k) begin_[k + 1] += begin_[k];
  block_.resize(blocks.size());
  for (uint32_t b = 0; b < blocks.size(); ++b) block_[begin_[of_block(blocks[b])]++] = b;
}

void SolveIslands::prepare(const World &w, StepContext &step) {
  const Array<ContactRows::Block> &blocks = step.rows.blocks;
  step.revised.resize(blocks.size());
  order_.resize(count_);
  for (uint32_t k = 0; k < count_; ++k) {
    SolveIsland &own = islands_[k];
    order_[k] = k;
    own.part.blocks = slice(block_, k);
    own.revises = own.rigid = own.soft = false;
    for (const uint32_t b : own.part.blocks) {
      const bool rigid = blocks[b].group != kNone;
      own.soft = own.soft || !rigid;
      step.revised[b] = !rigid && w.bodies[blocks[b].source]->dynamics->abilities().revises;
      own.rigid = own.rigid || rigid;
      own.revises = own.revises || step.revised[b];
    }
    own.effort = work_of_sweep(step.rows, own.part, own.soft);
    own.batches.gather(w.pairs.laws, own.part.contacts, step.state);
  }
}

const SolveIsland *solve_islands(World &w, StepContext &step) {
  const size_t n = step.rows.n;
  step.tolerance.normal.resize(n);
  step.tolerance.tangent.resize(n);
  step.trial_response.resize(n);
  step.best_impulse.resize(3 * size_t{step.rows.all()});
  step.best_pass.resize(3 * size_t{step.rows.all()});
  step.disturbance.resize(2 * size_t{step.solve_islands->side_count()});
  const std::span<SolveIsland> all = step.solve_islands->all();
  uint64_t rows = 0;
  for (SolveIsland &own : all) {
    if (!own.open) continue;
    rows += own.part.all();
    own.part.alone = step.rows.is_alone(own.part);
    own.start();
    own.slowed = own.waits = false;
    own.limit.reserve(own.part.n);
    own.spent = {0, 0, own.part.all(), Thrift::none, 0};
    own.residual = {};
    own.bad = nullptr;
    own.thrown = nullptr;
    own.tolerance.normal = step.tolerance.normal.data();
    own.tolerance.tangent = step.tolerance.tangent.data();
  }
  for (SolveIsland &own : all) own.spent.all = rows;
  const std::span<const uint32_t> order = step.solve_islands->by_size();
  if (step.counting.most > 0) step.counting.bodies = body_effort(w, step);
  // one job for both, unless islands share a body: then its tolerances follow from all of them
  const bool shared = step.solve_islands->shares_sides();
  const auto run = [&](bool starts, bool solves) {
    w.context->tasks.parallel_for(static_cast<uint32_t>(order.size()), 1, [&](uint32_t begin, uint32_t end) {
      for (uint32_t k = begin; k < end; ++k) {
        SolveIsland &own = all[order[k]];
        if (!own.open) continue;
        try {
          if (starts) start_island(w, step, own);
          if (!solves) continue;
          solve_island(w, step, own);
          restore_drive(step, own);
        } catch (...) {
          own.thrown = std::current_exception();
        }
      }
    });
  };
  run(true, !shared);
  if (shared) {
    step.solve_islands->largest_by_body(step.disturbance);
    run(false, true);
  }
  for (const SolveIsland &own : all)
    if (own.open) charge(w, step, own.spent);
  const SolveIsland *bad = nullptr;
  for (const SolveIsland &own : all) {
    if (!own.open) continue;
    if (own.thrown) std::rethrow_exception(own.thrown);
    if (own.bad && !bad) bad = &own;
  }
  return bad;
}

}  // namespace dfm
