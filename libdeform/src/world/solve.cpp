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
#include "world/world.h"

namespace dfm {
namespace {

// Responses of self-stepping bodies to unit impulses at their touched surfels: column by column.
void fill_responses(World &w) {
  for (const ContactRows::Block &block : w.rows.blocks) {
    if (block.group != kNone) {
      rigid_response(w, block.group, &w.rows.response[block.response]);
      continue;
    }
    Body &b = *w.bodies[block.source];
    const uint32_t n = block.count;
    w.block_surfels.resize(n), w.block_impulse.resize(size_t(3) * n), w.block_velocity.resize(size_t(3) * n);
    for (uint32_t k = 0; k < n; ++k) w.block_surfels[k] = w.rows.point[block.first + k];
    const dfm_kin kin = b.kin(w.time, w.h, nullptr);
    for (uint32_t c = 0; c < 3 * n; ++c) {
      std::fill(w.block_impulse.begin(), w.block_impulse.end(), 0.0), std::fill(w.block_velocity.begin(), w.block_velocity.end(), 0.0);
      w.block_impulse[c] = 1;
      if (b.model.call("respond", [&] {
            return b.model.stepper->respond(b.model.self, &kin, n, w.block_surfels.data(), w.block_impulse.data(), w.block_velocity.data());
          }) != DFM_OK)
        fail(DFM_E_FATAL, "model '%s' of body '%s' does not answer impulses; change the model", b.model.type->id, b.name.c_str());
      for (uint32_t r = 0; r < 3 * n; ++r) w.rows.response[block.response + size_t(r) * 3 * n + c] = w.block_velocity[r];
    }
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

constexpr uint32_t kMostRevisions = 6;   // of what rigid hosts take for granted, within a sub-step

// Where laws remember, errors of the normal force do not average out: each time a force falls by one, the cone cuts off a part of the bristle that does
// not come back when it rises; and a point that shakes under a bristle of share s stretches it by (1 - s) of each way forth and slackens it by
// (1 + s) of each way back. What is held creeps by both. This share of the normal tolerance then holds while bodies shake, and at rest this share
// of the tangential one (doc/decisions/0028).
constexpr double kRememberedShare = 0.05, kRememberedRest = 1e-3;

// The cap on sweeps bounds the cost of what is not exact, not of what lets bodies through: where a normal residual would eat more than a tenth
// of the rest distance within the sub-step, up to kBeyondCap times as many are done (many surfels on few phyxels, struck hard).
constexpr uint32_t kBeyondCap = 8, kFewSweeps = 8;   // kFewSweeps: where the step has to save
bool may_sweep(World &w, const Residual &residual) {
  if (w.sweeps >= kFewSweeps && spares(w, Thrift::sweeps)) return false;
  if (w.sweeps < w.def.max_sweeps) return true;
  return residual.normal * w.h > 0.1 * w.offset && w.sweeps < uint64_t{kBeyondCap} * w.def.max_sweeps;
}

// What goes beyond what must be reached is polish, and this many sweeps of a sub-step are enough for it: the next one goes on from there.
constexpr uint32_t kPolish = 20;
bool good(World &w, const Residual &left, double share) {
  return left.share <= share || (left.due <= share && (w.sweeps >= kPolish || spares(w, Thrift::polish)));
}

// Beyond this times the best residual sweeps are running away: with a jam of strong friction block Gauss-Seidel need not converge, and where laws are affine
// nothing else stops it before numbers end.
constexpr double kRunsAway = 1e6;

// Sweeps on the laws as they were last answered. At the cap the best state seen is taken, not the last one.
void sweep_until_good(World &w, Acceleration &acceleration, const Tolerance &tolerance) {
  double best = std::numeric_limits<double>::infinity();
  w.best_impulse.assign(w.rows.impulse.begin(), w.rows.impulse.end());
  acceleration.start(w.rows);
  for (;;) {
    charge(w, w.rows.n);
    sweep(w.rows, w.state, w.h);
    ++w.sweeps;
    const Residual left = inner_residual(w.rows, w.state, w.h, tolerance);
    if (!(left.due <= kRunsAway * std::max(1.0, best)) || !(left.due < std::numeric_limits<double>::max())) {
      w.rows.impulse.assign(w.best_impulse.begin(), w.best_impulse.end());
      return w.rows.restore();
    }
    if (good(w, left, 0.5)) return;
    if (left.due < best) best = left.due, w.best_impulse.assign(w.rows.impulse.begin(), w.rows.impulse.end());
    if (!may_sweep(w, left)) break;
    acceleration.follow(w.rows);
  }
  if (std::isinf(best)) return;
  for (uint32_t i = 0; i < w.rows.n; ++i) {
    double *const l = &w.rows.impulse[size_t(i) * 3];
    const Vec3 change = load3(&w.best_impulse[size_t(i) * 3]) - load3(l);
    if (change.x == 0 && change.y == 0 && change.z == 0) continue;
    w.rows.apply(i, change);
    store3(l, load3(&w.best_impulse[size_t(i) * 3]));
  }
}

}  // namespace

// Contacts as rows, with what they kept from the last sub-step: its impulses, not applied yet.
void World::make_rows() {
  const uint32_t n = static_cast<uint32_t>(contacts.size());
  uint32_t nstate = 0;
  for (const LawInstance *law : law_list) nstate = std::max(nstate, law->nstate);
  state.resize(n, nstate);
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    state.law[i] = law_of(c.slot_a, c.obstacle, c.slot_b);
    state.area[i] = c.area;
  }
  if (!zone_table.empty()) set_zone_laws();
  if (rigid_again) best_impulse.assign(rows.impulse.begin(), rows.impulse.end());
  rows.build(contacts, sources, {rigid_places, rigid_groups});
  correct_rigids(*this);
  fill_responses(*this);
  tangents.resize(size_t(3) * n), match.resize(n);
  warm_start(store, contacts, h, rows, state, tangents.data(), match.data());
  share_areas(*this), fit_bristles(*this);
  rows.recovery = def.recovery_speed;
  rows.finish(contacts, tangents.data(), h, guard.planned, offset);
  if (guard.resolving) guard_impulses(*this);
  if (!guard.kept.empty()) guard_rates(*this);
  if (rigid_again) rows.impulse.assign(best_impulse.begin(), best_impulse.end());
  batches.gather(law_list, state);
}

// Passes until the true residual is good enough; a law that failed, or null.
const LawInstance *World::solve_rows() {
  const double gap_margin = 0.01 * (0.5 * offset) / h;
  const double least = def.contact_tolerance > 0 ? def.contact_tolerance : std::min(1e-6, gap_margin);
  const bool memory = batches.remembers();
  const ToleranceBounds bounds{least, memory ? kRememberedRest * least : gap_margin, memory ? kRememberedShare * gap_margin : gap_margin};
  for (;;) {
    charge(*this, 4 * uint64_t{rows.n});
    set_trial(rows, h, state);
    // The sweeps take the next Newton step from there: what is asked a hundredth off is answered to a ten-thousandth.
    if (const LawInstance *bad = batches.answer(h, rows.wt.data(), 0.1 * least, 1e-2, state)) return bad;
    ++passes;
    if (sweeps) {
      residual = true_residual(rows, state, h, tolerance);
      if (good(*this, residual, 1) || !may_sweep(*this, residual) || passes > def.max_passes) return nullptr;
    }
    if (const LawInstance *bad = batches.slopes(h, state)) return bad;
    if (!sweeps) set_tolerance(rows, state, contacts, h, bounds, static_cast<uint32_t>(bodies.size()), disturbance, tolerance);
    // at least one sweep on a warm start is part of the method
    sweep_until_good(*this, acceleration, tolerance);
  }
}

bool World::stage_solve(uint32_t *trouble) {
  passes = sweeps = 0;
  residual = {};
  make_rows();
  apply_last(rows);
  if (rows.n == 0) return reserve_contacts(), true;
  uint32_t passes_before = 0, sweeps_before = 0;
  const LawInstance *bad = nullptr;
  for (uint32_t revision = 0;; ++revision) {
    bad = solve_rows();
    if (bad || revision == kMostRevisions || rows.rigid.empty() || !revise_rigids(*this)) break;
    // A motor holds or lets go: the same problem with another response, from the impulses that were found.
    rows.finish(contacts, tangents.data(), h, guard.planned, offset);
    if (!guard.kept.empty()) guard_rates(*this);
    passes_before += passes, sweeps_before += sweeps, passes = sweeps = 0;
  }
  passes += passes_before, sweeps += sweeps_before;
  double poison = 0;
  for (double l : rows.impulse) poison += 0.0 * l;
  if (bad || poison != 0) {
    *trouble |= tell_failed_solve(bad);
    return false;
  }
  if (batches.smooth()) set_slips(rows, state);
  if (residual.due > 1) *trouble |= DFM_TROUBLE_UNCONVERGED, ++stats.unconverged;
  stats.passes = passes, stats.sweeps = sweeps, stats.residual = residual.speed;
  stats.passes_max = std::max(stats.passes_max, passes), stats.sweeps_max = std::max(stats.sweeps_max, sweeps);
  stats.residual_max = std::max(stats.residual_max, stats.residual);
  reserve_contacts();
  return true;
}

// All memory that keep_contacts() will need, so that it cannot fail once the bodies have moved.
void World::reserve_contacts() {
  const uint32_t n = rows.n + (sleepers ? store.n : 0), S = state.nstate;
  ContactStore &to = next_store;
  Report &next = sleepers ? last_report : report;   // the one that keep_contacts() will write
  auto room = [&](size_t entries, auto &...arrays) { (arrays.reserve(entries), ...); };
  room(n, to.key, to.id_a, to.id_b, to.by_key, to.law, to.dwell, to.area, to.due, to.touching, to.held, to.began, to.crossings, next.contacts, next.mode);
  room(size_t(2) * n, to.path, next.slip), room(size_t(3) * n, to.normal, to.tangent, to.impulse, next.impulse);
  room(size_t(S) * n, to.bristle), room(size_t(9) * n, next.frame);
  work.reserve(std::min(work.size() + n, bodies.size() * (bodies.size() + obstacles.size())));
  reserve_events(size_t(n) + store.n);
  reserve_impulses(*this, n);
}

void World::reserve_events(size_t more) {
  const size_t most = events.size() + more;
  if (events.capacity() < most) events.reserve(2 * most);
}

void World::add_event(uint32_t kind, uint64_t a, uint64_t b, uint64_t key, double t) {
  events.push_back({sizeof(dfm_contact_event), kind, handle_of(a), handle_of(b), key, t});
}

void World::list_crossings() {
  Array<Crossing> &list = next_store.crossings;
  list.clear();
  for (uint32_t i = 0; i < next_store.n; ++i) {
    const ContactPoint &c = report.contacts[i];
    if (c.type_a == 1 && next_store.touching[i]) list.push_back({next_store.id_a[i], next_store.id_b[i], c.feature_a, c.feature_b});
  }
  std::sort(list.begin(), list.end());
}

// After the commit: what contacts keep for the next sub-step, their events, the hold measure, friction work and the report.
void World::keep_contacts() {
  const uint32_t n = rows.n, S = state.nstate;
  ContactStore &to = next_store;
  if (sleepers) std::swap(report, last_report);
  to.n = n, to.nstate = S, to.h = h;
  to.key.resize(n), to.id_a.resize(n), to.id_b.resize(n), to.by_key.resize(n), to.law.resize(n), to.dwell.resize(n), to.area.resize(n);
  to.normal.resize(size_t(3) * n), to.tangent.resize(size_t(3) * n), to.impulse.resize(size_t(3) * n), to.path.resize(size_t(2) * n);
  to.bristle.resize(size_t(S) * n), to.touching.resize(n), to.held.resize(n), to.began.resize(n);
  report.n = n, report.h = h;
  report.contacts.assign(contacts.begin(), contacts.end());
  for (uint32_t i = 0; i < n; ++i) report.contacts[i].area = state.area[i];
  report.frame.assign(rows.frame.begin(), rows.frame.end());
  report.impulse.assign(rows.impulse.begin(), rows.impulse.end());
  report.slip.resize(size_t(2) * n), report.mode.resize(n);

  uint32_t touching = 0, sticking = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    const uint64_t a = bodies[c.slot_a]->id, b = c.obstacle ? obstacles[c.slot_b]->id : bodies[c.slot_b]->id;
    const double *const l = &rows.impulse[size_t(i) * 3];
    const uint32_t m = match[i];
    const uint32_t known = m != kNone ? m : store.find(c.key);   // also where the normal turned over and nothing else is taken along
    const bool before = known != kNone && store.touching[known];
    // hysteresis: a contact ends when it carries nothing and has opened by a tenth of the offset
    const bool now = l[0] > 0 || (before && c.distance - offset < 0.1 * offset);
    const bool stick = l[0] > 0 && state.mode[i] == 1;
    to.key[i] = c.key, to.id_a[i] = a, to.id_b[i] = b, to.law[i] = state.law[i], to.by_key[i] = i;
    store3(&to.normal[size_t(3) * i], load3(&rows.frame[size_t(9) * i]));
    store3(&to.tangent[size_t(3) * i], load3(&rows.frame[size_t(9) * i + 3]));
    store3(&to.impulse[size_t(3) * i], load3(l));
    const uint32_t own = now ? law_list[state.law[i]]->nstate : 0;   // its law wrote no further: the rest of the columns is another contact's
    for (uint32_t s = 0; s < S; ++s) to.bristle[size_t(S) * i + s] = s < own ? state.bristle_out[size_t(s) * state.stride + i] : 0;
    to.dwell[i] = now ? state.dwell[i] + h : 0, to.area[i] = state.area[i];
    const double v1 = state.vt[i], v2 = state.vt[state.stride + i];
    // A hold counts from hold_begin on: what sticks in the first sub-step after it, and in every one since.
    const bool first = time <= hold_start, carried = !first && m != kNone && store.held[m];
    const bool holds = holding && stick && (first || carried);
    to.path[2 * i] = holds ? (carried ? store.path[2 * m] : 0) + h * v1 : 0;
    to.path[2 * i + 1] = holds ? (carried ? store.path[2 * m + 1] : 0) + h * v2 : 0;
    to.touching[i] = now, to.held[i] = holds;
    to.began[i] = now && !before;
    if (now && !before) add_event(DFM_EVENT_BEGIN, a, b, c.key, time + h);
    if (before && !now) add_event(DFM_EVENT_END, a, b, c.key, time + h);
    report.slip[2 * i] = v1, report.slip[2 * i + 1] = v2, report.mode[i] = state.mode[i];
    touching += now, sticking += stick;

    if (l[1] != 0 || l[2] != 0) {
      auto it = std::lower_bound(work.begin(), work.end(), std::pair(a, b), [](const PairWork &w, auto &k) { return std::pair(w.a, w.b) < k; });
      if (it == work.end() || it->a != a || it->b != b) it = work.insert(it, {a, b, 0});
      it->work += l[1] * v1 + l[2] * v2;
    }
  }
  follow_load(*this), turn_frames(*this);
  std::sort(to.by_key.begin(), to.by_key.end(), [&](uint32_t i, uint32_t j) { return to.key[i] < to.key[j]; });
  if (sleepers) carry_sleepers(&touching, &sticking);
  for (uint32_t m = 0; m < store.n; ++m)
    if (store.touching[m] && !sleeps(m) && to.find(store.key[m]) == kNone) add_event(DFM_EVENT_END, store.id_a[m], store.id_b[m], store.key[m], time + h);
  list_crossings();
  std::swap(store, next_store);

  stats.contacts = touching, stats.sticking = sticking, stats.pairs_tested = static_cast<uint32_t>(broad.candidates().size());
  stats.contacts_max = std::max(stats.contacts_max, touching);
  stats.contacts_mean += (touching - stats.contacts_mean) / double(stats.substeps + 1);
}

}  // namespace dfm
