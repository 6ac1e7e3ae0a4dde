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
#include "world/bristles.h"
#include "world/context.h"
#include "world/stages.h"
#include "world/world.h"

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
bool good(StepContext &step, const Residual &left, double share) {
  return left.share <= share ||
         (left.due <= share && (step.sweeps >= kPolish || spares(step, Thrift::polish)));
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

// All memory that keep_contacts() will need, so that it cannot fail once the bodies have moved.
void reserve_contacts(World &w, StepContext &step) {
  const uint32_t n = step.rows.n + (w.sleepers ? w.store.n : 0), S = step.state.nstate;
  ContactStore &to = step.next_store;
  Report &next = w.sleepers ? step.last_report : w.report;  // the one that keep_contacts(w, step) will write
  auto room = [&](size_t entries, auto &...arrays) { (arrays.reserve(entries), ...); };
  each_column([&](const ContactColumn &column, auto &values) { values.reserve(column.entries(n, S)); }, to);
  room(n, next.contacts, next.mode);
  room(size_t(2) * n, next.slip);
  room(size_t(3) * n, next.impulse);
  room(size_t(9) * n, next.frame);
  w.work.reserve(std::min(w.work.size() + n, w.bodies.size() * (w.bodies.size() + w.obstacles.size())));
  reserve_events(w, size_t(n) + w.store.n);
  reserve_impulses(w, n);
}

void reserve_events(World &w, size_t more) {
  const size_t most = w.events.size() + more;
  if (w.events.capacity() < most) w.events.reserve(2 * most);
}

void add_event(World &w, uint32_t kind, uint64_t a, uint64_t b, uint64_t key, double t) {
  w.events.push_back({sizeof(dfm_contact_event), kind, w.handle_of(a), w.handle_of(b), key, t});
}

void end_contacts(World &w) {
  ContactStore &s = w.store;
  reserve_events(w, s.n);
  for (uint32_t i = 0; i < s.n; ++i)
    if (s.touching[i]) add_event(w, DFM_EVENT_END, s.id_a[i], s.id_b[i], s.key[i], w.time);
  each_column([](const ContactColumn &, auto &values) { values.clear(); }, s);
  s.n = w.report.n = 0;
  w.stats.contacts = w.stats.sticking = 0;
}

void list_crossings(World &w, StepContext &step) {
  Array<Crossing> &list = step.next_store.crossings;
  list.clear();
  for (uint32_t i = 0; i < step.next_store.n; ++i) {
    const ContactPoint &c = w.report.contacts[i];
    if (c.type_a == 1 && step.next_store.touching[i])
      list.push_back({step.next_store.id_a[i], step.next_store.id_b[i], c.feature_a, c.feature_b});
  }
  std::sort(list.begin(), list.end());
}

// After the commit: what contacts keep for the next sub-step, their events, the hold measure, friction work
// and the report.
void keep_contacts(World &w, StepContext &step) {
  const uint32_t n = step.rows.n, S = step.state.nstate;
  ContactStore &to = step.next_store;
  if (w.sleepers) std::swap(w.report, step.last_report);
  to.n = n;
  to.nstate = S;
  to.h = step.h;
  each_column(
      [&](const ContactColumn &column, auto &values) {
        if (column.width != kOwnLength) values.resize(column.entries(n, S));
      },
      to);
  w.report.n = n;
  w.report.h = step.h;
  w.report.contacts.assign(step.contacts.begin(), step.contacts.end());
  for (uint32_t i = 0; i < n; ++i) w.report.contacts[i].area = step.state.area[i];
  w.report.frame.assign(step.rows.frame.begin(), step.rows.frame.end());
  w.report.impulse.assign(step.rows.impulse.begin(), step.rows.impulse.end());
  w.report.slip.resize(size_t(2) * n);
  w.report.mode.resize(n);

  uint32_t touching = 0, sticking = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = step.contacts[i];
    const uint64_t a = w.bodies[c.slot_a]->id;
    const uint64_t b = c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id;
    const double *const l = &step.rows.impulse[size_t(i) * 3];
    const uint32_t m = step.match[i];
    // also where the normal turned over and nothing else is taken along
    const uint32_t known = m != kNone ? m : w.store.find(c.key);
    const bool before = known != kNone && w.store.touching[known];
    // hysteresis: a contact ends when it carries nothing and has opened by a tenth of the offset
    const bool now = l[0] > 0 || (before && c.distance - w.offset < 0.1 * w.offset);
    const bool stick = l[0] > 0 && step.state.mode[i] == 1;
    to.key[i] = c.key;
    to.id_a[i] = a;
    to.id_b[i] = b;
    to.law[i] = step.state.law[i];
    to.by_key[i] = i;
    store3(&to.normal[size_t(3) * i], load3(&step.rows.frame[size_t(9) * i]));
    store3(&to.tangent[size_t(3) * i], load3(&step.rows.frame[size_t(9) * i + 3]));
    store3(&to.impulse[size_t(3) * i], load3(l));
    // its law wrote no further: the rest of the columns is another contact's
    const uint32_t own = now ? w.pairs.laws[step.state.law[i]]->nstate : 0;
    for (uint32_t s = 0; s < S; ++s)
      to.bristle[size_t(S) * i + s] = s < own ? step.state.bristle_out[size_t(s) * step.state.stride + i] : 0;
    to.dwell[i] = now ? step.state.dwell[i] + step.h : 0;
    to.area[i] = step.state.area[i];
    const double v1 = step.state.vt[i], v2 = step.state.vt[step.state.stride + i];
    // A hold counts from hold_begin on: what sticks in the first sub-step after it, and in every one since.
    const bool first = w.time <= w.hold.start, carried = !first && m != kNone && w.store.held[m];
    const bool holds = w.hold.on && stick && (first || carried);
    to.path[2 * i] = holds ? (carried ? w.store.path[2 * m] : 0) + step.h * v1 : 0;
    to.path[2 * i + 1] = holds ? (carried ? w.store.path[2 * m + 1] : 0) + step.h * v2 : 0;
    to.touching[i] = now;
    to.held[i] = holds;
    to.began[i] = now && !before;
    if (now && !before) add_event(w, DFM_EVENT_BEGIN, a, b, c.key, w.time + step.h);
    if (before && !now) add_event(w, DFM_EVENT_END, a, b, c.key, w.time + step.h);
    w.report.slip[2 * i] = v1;
    w.report.slip[2 * i + 1] = v2;
    w.report.mode[i] = step.state.mode[i];
    touching += now;
    sticking += stick;

    if (l[1] != 0 || l[2] != 0) {
      auto it = std::lower_bound(w.work.begin(), w.work.end(), std::pair(a, b),
                                 [](const PairWork &p, auto &k) { return std::pair(p.a, p.b) < k; });
      if (it == w.work.end() || it->a != a || it->b != b) it = w.work.insert(it, {a, b, 0});
      it->work += l[1] * v1 + l[2] * v2;
    }
  }
  follow_load(w, step);
  turn_frames(w, step);
  std::sort(to.by_key.begin(), to.by_key.end(),
            [&](uint32_t i, uint32_t j) { return to.key[i] < to.key[j]; });
  if (w.sleepers) carry_sleepers(w, step, &touching, &sticking);
  for (uint32_t m = 0; m < w.store.n; ++m)
    if (w.store.touching[m] && !sleeps(w, step, m) && to.find(w.store.key[m]) == kNone)
      add_event(w, DFM_EVENT_END, w.store.id_a[m], w.store.id_b[m], w.store.key[m], w.time + step.h);
  list_crossings(w, step);
  std::swap(w.store, step.next_store);

  w.stats.contacts = touching;
  w.stats.sticking = sticking;
  w.stats.pairs_tested = static_cast<uint32_t>(step.broad.candidates().size());
  w.stats.contacts_max = std::max(w.stats.contacts_max, touching);
  w.stats.contacts_mean += (touching - w.stats.contacts_mean) / double(w.stats.substeps + 1);
}

}  // namespace dfm
