// Results of contacts after a completed sub-step: the store for the next one and for reports, events, the
// hold, and the work of friction.
#include <algorithm>
#include <utility>

#include "friction/laws.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"
#include "step/self_contact.h"
#include "step/sides.h"
#include "step/solve/friction_memory.h"
#include "step/stages.h"
#include "step/step_impulses.h"

namespace dfm {

// Reserves all memory of keep_contacts(), so that it cannot fail after bodies have moved.
void reserve_contacts(World &w, StepContext &step) {
  const uint32_t n = step.rows.soft() + (w.sleepers ? w.store.n : 0), S = step.state.nstate;
  ContactStore &to = step.next_store;
  each_column([&](const ContactColumn &column, auto &values) { values.reserve(column.entries(n, S)); }, to);
  step.mean.reserve(size_t{kStride} * step.rows.ndof);
  step.before.resize(n);
  step.goes_on.reserve(w.store.n);
  reserve_reports(w, w, w, step, step, w.step_impulses);
}

void reserve_reports(WorldState &state, const Entities &entities, const Derived &derived, const Views &views,
                     const Solution &solution, StepImpulses &impulses) {
  const size_t rigid = views.tools->next_touching().size();
  size_t contacts = 0;
  if (derived.plan.touches())
    contacts = solution.rows.soft() + (derived.sleepers ? size_t{state.store.n} : 0);
  const size_t pairs = entities.bodies.size() * (entities.bodies.size() + entities.obstacles.size());
  state.work.reserve(state.work.size() + std::min(contacts, pairs) + rigid);
  reserve_events(state,
                 contacts + state.store.n + state.attachments.size() + rigid + state.rigid_touching.size());
  reserve_impulses(impulses, state, pairs, contacts, rigid);
}

void reserve_events(WorldState &state, size_t more) {
  const size_t most = state.events.size() + more;
  if (state.events.capacity() < most) state.events.reserve(2 * most);
}

void add_event(World &w, uint32_t kind, uint64_t a, uint64_t b, uint64_t key, double t) {
  w.events.push_back({sizeof(dfm_contact_event), kind, w.handle_of(a), w.handle_of(b), key, t});
}

void add_friction_work(World &w, uint64_t a, uint64_t b, double joule) {
  auto it = std::lower_bound(w.work.begin(), w.work.end(), std::pair(a, b),
                             [](const PairWork &p, auto &k) { return std::pair(p.a, p.b) < k; });
  if (it == w.work.end() || it->a != a || it->b != b) it = w.work.insert(it, {a, b, 0});
  it->friction += joule;
}

void end_contacts(World &w) {
  end_idle(w);
  ContactStore &s = w.store;
  reserve_events(w, s.n);
  for (uint32_t i = 0; i < s.n; ++i)
    if (s.touching[i]) add_event(w, DFM_EVENT_END, s.id_a[i], s.id_b[i], s.key[i], w.time);
  each_column([](const ContactColumn &, auto &values) { values.clear(); }, s);
  s.n = 0;
  s.h = 0;
  for (auto &b : w.bodies) std::fill(b->surfel_impulse.begin(), b->surfel_impulse.end(), 0.0);
  w.stats.contacts = w.stats.sticking = w.stats.self_bodies = 0;
}

void list_crossings(StepContext &step) {
  ContactStore &s = step.next_store;
  Array<Crossing> &list = s.crossings;
  list.clear();
  for (uint32_t i = 0; i < s.n; ++i)
    if (s.type_a[i] == 1 && s.touching[i])
      list.push_back({s.id_a[i], s.id_b[i], s.feature_a[i], s.feature_b[i]});
  // contacts between bodies are in this order already
  if (!std::is_sorted(list.begin(), list.end())) std::sort(list.begin(), list.end());
}

namespace {

// Stores contact i for the next sub-step and for reports.
void keep_contact(const World &w, StepContext &step, uint32_t i) {
  const uint32_t S = step.state.nstate;
  ContactStore &to = step.next_store;
  const ContactPoint &c = step.contacts[i];
  const double *const l = &step.rows.impulse[size_t(i) * 3];
  const uint32_t m = step.match[i];
  // also if the normal was reversed and nothing else is kept
  const uint32_t known = m != kNone ? m : w.store.find(c.key);
  const bool before = known != kNone && w.store.touching[known];
  // hysteresis: a contact ends when it carries nothing and has opened by a tenth of the offset
  const bool now = l[0] > 0 || (before && c.distance - w.offset < 0.1 * w.offset);
  const bool stick = l[0] > 0 && step.state.mode[i] == 1;
  to.key[i] = c.key;
  to.id_a[i] = w.bodies[c.slot_a]->id;
  to.id_b[i] = id_of_b(w, c);
  to.feature_a[i] = c.feature_a;
  to.feature_b[i] = c.feature_b;
  to.type_a[i] = c.type_a;
  to.type_b[i] = type_b(c);
  to.law[i] = step.state.law[i];
  store3(&to.normal[size_t(3) * i], load3(&step.rows.frame[size_t(9) * i]));
  store3(&to.tangent[size_t(3) * i], load3(&step.rows.frame[size_t(9) * i + 3]));
  store3(&to.impulse[size_t(3) * i], load3(l));
  to.lasting[i] = step.rows.load_without_opening(i);
  store3(&to.turned[size_t(3) * i], load3(&to.tangent[size_t(3) * i]));
  store3(&to.point[size_t(3) * i], load3(c.point));
  to.gap[i] = c.distance - w.offset;
  // the law of this contact has `own` values of state; the other columns belong to laws with more
  const uint32_t own = now ? w.pairs.laws[step.state.law[i]]->nstate : 0;
  for (uint32_t s = 0; s < S; ++s)
    to.bristle[size_t(S) * i + s] = s < own ? step.state.bristle_out[size_t(s) * step.state.stride + i] : 0;
  to.dwell[i] = now ? step.state.dwell[i] + step.h : 0;
  to.area[i] = step.state.area[i];
  to.start_depth[i] = step.rows.start_depth[i];
  // A hold counts from hold_begin on: contacts that stick in the first sub-step after it and in every one
  // since.
  const bool first = w.time <= w.hold.start, carried = !first && m != kNone && w.store.held[m];
  const bool holds = w.hold.on && stick && (first || carried);
  for (size_t k = 0; k < 2; ++k) {
    const double slip = step.state.vt[step.state.stride * k + i];
    to.path[2 * size_t{i} + k] = holds ? (carried ? w.store.path[2 * size_t{m} + k] : 0) + step.h * slip : 0;
    to.slip[2 * size_t{i} + k] = slip;
  }
  to.touching[i] = now;
  to.held[i] = holds;
  to.sticks[i] = stick;
  to.began[i] = now && !before;
  step.before[i] = before;
}

void book_friction(World &w, const StepContext &step) {
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    const double *const l = &step.rows.impulse[size_t(i) * 3];
    if (l[1] == 0 && l[2] == 0) continue;
    const double work = l[1] * step.state.vt[i] + l[2] * step.state.vt[step.state.stride + i];
    const uint64_t a = w.bodies[c.slot_a]->id, b = id_of_b(w, c);
    // two bodies touch by surfels of either of them, and these contacts are one pair
    if (!c.obstacle && b < a) add_friction_work(w, b, a, work);
    else add_friction_work(w, a, b, work);
  }
}

// Further rows of a contact are the last ones. The first row, which has the area and the state of friction,
// gets what they bear. Returns the number of contacts.
uint32_t join_rows(StepContext &step) {
  const auto own = [](const ContactPoint &c) { return c.more == 0; };
  const auto end = std::find_if_not(step.contacts.begin(), step.contacts.end(), own);
  for (auto row = end; row != step.contacts.end(); ++row) {
    const auto is_same = [&](const ContactPoint &c) { return c.key == row->key; };
    const size_t from = size_t(row - step.contacts.begin()),
                 to = size_t(std::find_if(step.contacts.begin(), end, is_same) - step.contacts.begin());
    const Vec3 p = step.rows.world_impulse(uint32_t(from));
    add3(&step.rows.impulse[3 * to], in_frame(&step.rows.frame[9 * to], p));
    store3(&step.rows.impulse[3 * from], {});
  }
  return uint32_t(end - step.contacts.begin());
}

// The contacts in the order of their keys: those that go on, in the order of the store, merged with new ones.
void order_keys(const World &w, StepContext &step) {
  constexpr uint32_t kFew = 16;
  ContactStore &to = step.next_store;
  Array<uint32_t> &now = step.goes_on, &order = to.by_key;
  now.assign(w.store.n, kNone);
  for (uint32_t i = 0; i < to.n; ++i)
    if (step.match[i] != kNone) now[step.match[i]] = i;
  const auto before = [&](uint32_t i, uint32_t j) { return to.key[i] < to.key[j]; };
  auto end = order.begin();
  for (const uint32_t m : w.store.by_key)
    if (now[m] != kNone) *end++ = now[m];
  const bool few = size_t(order.end() - end) <= kFew;
  for (uint32_t i = 0; i < to.n; ++i) {
    if (step.match[i] != kNone && now[step.match[i]] == i) continue;
    const auto at = few ? std::upper_bound(order.begin(), end, i, before) : end;
    std::copy_backward(at, end, end + 1);
    *at = i;
    ++end;
  }
  if (!few) std::sort(order.begin(), order.end(), before);
}

}  // namespace

void keep_contacts(World &w, StepContext &step) {
  book_friction(w, step);
  const uint32_t n = join_rows(step), S = step.state.nstate;
  ContactStore &to = step.next_store;
  to.n = n;
  to.nstate = S;
  to.h = step.h;
  each_column(
      [&](const ContactColumn &column, auto &values) {
        if (column.width != kOwnLength) values.resize(column.entries(n, S));
      },
      to);
  if (step.stick_drift.empty()) std::fill(to.stick_drift.begin(), to.stick_drift.end(), 0.0);
  else std::copy_n(step.stick_drift.begin(), size_t(3) * n, to.stick_drift.begin());
  each_row_in_blocks(n, &w.context->tasks, [&](uint32_t i) { keep_contact(w, step, i); });
  uint32_t touching = 0, sticking = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const uint64_t a = to.id_a[i], b = to.id_b[i];
    if (to.began[i]) add_event(w, DFM_EVENT_BEGIN, a, b, to.key[i], w.time + step.h);
    if (step.before[i] && !to.touching[i]) add_event(w, DFM_EVENT_END, a, b, to.key[i], w.time + step.h);
    touching += to.touching[i];
    sticking += to.sticks[i];
  }
  follow_load(w, step);
  turn_frames(w, step);
  order_keys(w, step);
  if (w.sleepers) carry_sleepers(w, step, &touching, &sticking);
  for (uint32_t m = 0; m < w.store.n; ++m)
    if (w.store.touching[m] && step.goes_on[m] == kNone && to.find(w.store.key[m]) == kNone)
      add_event(w, DFM_EVENT_END, w.store.id_a[m], w.store.id_b[m], w.store.key[m], w.time + step.h);
  list_crossings(step);
  std::swap(w.store, step.next_store);
  w.stats.self_bodies = count_self(w, step);
  w.stats.self_max = std::max(w.stats.self_max, w.stats.self_bodies);
  w.stats.contacts = touching;
  w.stats.sticking = sticking;
  w.stats.contacts_max = std::max(w.stats.contacts_max, touching);
  w.stats.contacts_mean += (touching - w.stats.contacts_mean) / double(w.stats.substeps + 1);
}

}  // namespace dfm
