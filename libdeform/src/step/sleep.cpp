// Sleep and waking.
//
//   end of a sub-step    A body is at rest while all its points are slower than sleep_speed and within half
//                        of d_c of where they were when it came to rest. Speed alone would let slow drift
//                        pass, and would keep a stiff body awake that vibrates by a nanometer. An island
//                        falls asleep when all its bodies have been at rest for sleep_time, none of its
//                        contacts slides or touches a moving obstacle or a rigid host's body, and no
//                        prescribed motion or load of its bodies is still to come
//   asleep               x, contacts and their forces stay, v = 0; no stage works on the body. Detection
//                        keeps its shape as a partner: pairs with at least one side awake, or with a moving
//                        obstacle, are tested as before
//   waking               A contact of such a pair, even one that is still open, wakes the whole island before
//                        the sub-step continues: the woken bodies run the stages that the others have passed,
//                        and detection runs again. So a woken body responds with its full dynamics, warm
//                        started by the contacts that it had when it fell asleep
//
// All decisions depend on the state alone, in the order of ids.
#include "state/sleep.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "body/make_surface.h"
#include "contact/reach.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/cut_drag.h"
#include "step/solve/tolerance.h"
#include "step/stages.h"

namespace dfm {
namespace {

constexpr double kStay = 0.5;  // of d_c
constexpr double kForever = std::numeric_limits<double>::infinity();

template <class Key>
double last_time(const std::vector<Key> &keys) {
  return keys.empty() ? -kForever : keys.back().t;
}

// The time after which prescribed motions and loads of a body no longer change.
double rest_start(const Body &b) {
  double t = -kForever;
  for (const Load &l : b.loads)
    t = std::max(t, l.sine.amplitude[0] != 0 && l.sine.frequency != 0 ? kForever : last_time(l.keys));
  for (const Spring &s : b.springs) t = std::max(t, last_time(s.keys));
  for (const HeldMotion &m : b.motions) {
    const bool swings = m.sine.frequency != 0 && norm2(load3(m.sine.amplitude)) != 0;
    t = std::max(t, swings ? kForever : last_time(m.keys));
  }
  return t;
}

// Bodies for which `counts` is true share an island with those to which they are attached.
template <class Counts>
void join_attached(const WorldState &state, const Entities &entities, Islands &islands, Counts counts) {
  for (const Attachment &a : state.attachments) {
    const uint32_t i = slot_of(entities, a.body), j = a.obstacle ? kNone : slot_of(entities, a.to);
    if (j != kNone && !a.released && counts(*entities.bodies[i]) && counts(*entities.bodies[j]))
      islands.join(i, j);
  }
}

bool asleep(const Entities &entities, uint64_t id) {
  const uint32_t i = slot_of(entities, id);
  return i != kNone && entities.bodies[i]->sleep_state.asleep;
}

}  // namespace

// Ids increase with the slots; only prepare() renumbers slots.
template <class List>
static uint32_t place_of(const List &list, uint64_t id) {
  const auto at = std::ranges::lower_bound(list, id, {}, [](const auto &x) { return x->id; });
  return at != list.end() && (*at)->id == id ? static_cast<uint32_t>(at - list.begin()) : kNone;
}
uint32_t slot_of(const Entities &e, uint64_t id) { return place_of(e.bodies, id); }
uint32_t obstacle_slot_of(const Entities &e, uint64_t id) { return place_of(e.obstacles, id); }

// Finds the active bodies of a sub-step, and the bodies that receive contact impulses.
void gather_active(Entities &entities, Derived &derived, Views &views, SubStepEnd &end, Awake &awake) {
  awake.active.clear();
  end.sinks.clear();
  end.given.known = false;
  for (uint32_t i = 0; i < entities.bodies.size(); ++i) {
    Body &b = *entities.bodies[i];
    BodyView &view = views.body_views[i];
    view.asleep = b.sleep_state.asleep;
    view.speed = b.sleep_state.asleep ? 0 : -1;
    if (b.sleep_state.asleep) continue;
    awake.active.push_back(i);
    end.sinks.push_back({view.first_node, b.surface.nsurfel, b.p.n, &b.surface, b.surfel_impulse.data(),
                         b.dynamics->unknowns().diagonal ? b.p.impulse.data() : nullptr});
  }
  derived.sleepers = static_cast<uint32_t>(entities.bodies.size() - awake.active.size());
}

void gather_active(World &w) { gather_active(w, w, *w.steps, *w.steps, *w.steps); }

void reserve_sleep(World &w, StepContext &step, uint32_t n) {
  if (w.def.sleep) {
    step.islands.reserve(n);
    step.active.reserve(n);
    step.woken.reserve(n);
    step.stirred.reserve(n);
  }
}

void rouse(World &w, std::span<const uint32_t> slots) {
  StepContext &step = *w.steps;
  Roused &before = step.roused;
  before.bodies.reserve(before.bodies.size() + slots.size());
  if (before.bodies.empty()) {
    before.dwell.assign(w.store.dwell.begin(), w.store.dwell.end());
    before.total.clear();
    for (const Attachment &a : w.attachments) before.total.push_back(a.total);
  }
  // Adds the elapsed time to contacts that sleep: their age, and their total impulse.
  for (uint32_t m = 0; m < w.store.n; ++m) {
    const uint32_t a = slot_of(w, w.store.id_a[m]);
    if (w.store.touching[m] && a != kNone && w.bodies[a]->sleep_state.asleep &&
        std::binary_search(slots.begin(), slots.end(), a))
      w.store.dwell[m] += w.time - w.bodies[a]->sleep_state.since;
  }
  for (const uint32_t i : slots) {
    Body &b = *w.bodies[i];
    before.bodies.push_back({i, b.sleep_state, b.contact_impulse});
    if (b.sleep_state.asleep) {
      b.contact_impulse += (w.time - b.sleep_state.since) * b.sleep_state.force;
      for (Attachment &a : w.attachments)
        if (a.body == b.id && a.h > 0) a.total += ((w.time - b.sleep_state.since) / a.h) * a.sum();
      step.woken.push_back(i);
    }
    b.sleep_state = {false, 0, 0, b.sleep_state.h, {}};  // h: of its impulses, until the next ones
  }
  if (!w.changed) return gather_active(w);
  // the views are out of date, and prepare(w) makes the rest
  const auto sleeps = [](const auto &b) { return b->sleep_state.asleep; };
  w.sleepers = static_cast<uint32_t>(std::count_if(w.bodies.begin(), w.bodies.end(), sleeps));
}

void undo_waking(World &w, StepContext &step) {
  Roused &before = step.roused;
  if (before.bodies.empty()) return;
  for (auto was = before.bodies.rbegin(); was != before.bodies.rend(); ++was) {
    w.bodies[was->slot]->sleep_state = was->sleep_state;
    w.bodies[was->slot]->contact_impulse = was->impulse;
  }
  std::copy(before.dwell.begin(), before.dwell.end(), w.store.dwell.begin());
  for (size_t k = 0; k < w.attachments.size(); ++k) w.attachments[k].total = before.total[k];
  before.bodies.clear();
  gather_active(w);
}

// Wakes the whole island, by its contacts at the time when it fell asleep.
void wake(World &w, Body &b) {
  StepContext &step = *w.steps;
  b.sleep_state.quiet_time = 0;
  if (!b.sleep_state.asleep) return;
  step.islands.start(static_cast<uint32_t>(w.bodies.size()));
  for (uint32_t m = 0; m < w.store.n; ++m) {
    const uint32_t i = slot_of(w, w.store.id_a[m]), j = slot_of(w, w.store.id_b[m]);
    if (i != kNone && j != kNone && w.bodies[i]->sleep_state.asleep && w.bodies[j]->sleep_state.asleep)
      step.islands.join(i, j);
  }
  join_attached(w, w, step.islands, [](const Body &x) { return x.sleep_state.asleep; });
  step.islands.finish();
  const uint32_t k = step.islands.of[slot_of(w, b.id)];
  rouse(w, {&step.islands.member[step.islands.begin[k]], step.islands.begin[k + 1] - step.islands.begin[k]});
}

void wake_all(World &w) {
  StepContext &step = *w.steps;
  for (auto &b : w.bodies) b->sleep_state.quiet_time = 0;
  if (w.sleepers == 0) return;
  step.islands.start(static_cast<uint32_t>(w.bodies.size()));
  step.islands.finish();
  rouse(w, step.islands.member);  // of islands that no pair joins: all bodies, ascending
}

void wake_touching(World &w, uint64_t obstacle) {
  for (uint32_t m = 0; m < w.store.n; ++m)
    if (const uint32_t i = w.store.id_b[m] == obstacle ? slot_of(w, w.store.id_a[m]) : kNone; i != kNone)
      wake(w, *w.bodies[i]);
}

// Whether nothing moves and nothing will, so that the sub-step would change nothing. Only a rigid host knows
// the motion of its bodies.
bool all_idle(const World &w, const StepContext &step) {
  return w.sleepers > 0 && step.active.empty() && w.rigid_sets.empty() &&
         std::none_of(step.obstacle_views.begin(), step.obstacle_views.end(),
                      [](const ObstacleView &o) { return o.moves(); });
}

namespace {

// end: s, of the sub-step of length h
void fall_asleep(WorldState &state, const Plan &plan, double end, double h, Body &b) {
  Phyxels &p = b.p;
  Vec3 momentum, impulse;
  double kinetic = 0;
  for (uint32_t i = 0; i < p.n; ++i) {
    const Vec3 v = load3(&p.v[size_t(i) * kStride]);
    momentum += p.mass[i] * v;
    kinetic += 0.5 * p.mass[i] * norm2(v);
  }
  state.stats.sleep_energy += kinetic;
  add3(state.stats.sleep_momentum, momentum);
  std::fill(p.v.begin(), p.v.end(), 0.0);
  b.relax_dampers();
  std::fill(p.v_free.begin(), p.v_free.end(), 0.0);
  b.dynamics->points_changed();
  gather_surface(b.surface, p.x.data(), p.v.data());  // detection continues to see it at its place
  if (plan.touches())
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) impulse += load3(&b.surfel_impulse[3 * size_t(s)]);
  b.sleep_state = {true, 0, end, h, (1 / h) * impulse};
  b.bound.known = false;
}

}  // namespace

// At the end of a sub-step that has been committed; allocates nothing.
void stage_sleep(WorldState &state, Entities &entities, const Rules &rules, Derived &derived,
                 const SubStepTimes &times, const Detection &detection, const Solution &solution,
                 Views &views, SubStepEnd &end, Awake &awake) {
  const double now = state.time + times.h;
  awake.woken.clear();
  bool tired = false;
  for (const uint32_t i : awake.active) {
    Body &b = *entities.bodies[i];
    const Phyxels &p = b.p;
    double &quiet_time = b.sleep_state.quiet_time;
    if (!(largest_norm(p.n, p.v.data(), nullptr) < rules.def.sleep_speed)) {
      quiet_time = 0;
    } else if (quiet_time > 0 && largest_norm(p.n, p.x.data(), b.anchor.data()) <= kStay * derived.offset) {
      quiet_time += times.h;
    } else {
      quiet_time = times.h;
      std::copy(p.x.begin(), p.x.end(), b.anchor.begin());
    }
    tired |= b.sleep_state.quiet_time >= rules.def.sleep_time;
  }
  if (!tired || now < last_time(rules.gravity.keys)) return;

  const size_t n = derived.plan.touches() ? detection.contacts.size() : 0;
  awake.islands.start(static_cast<uint32_t>(entities.bodies.size()));
  for (size_t i = 0; i < n; ++i)
    if (!detection.contacts[i].obstacle)
      awake.islands.join(detection.contacts[i].slot_a, detection.contacts[i].slot_b);
  join_attached(state, entities, awake.islands, [](const Body &b) { return !b.sleep_state.asleep; });
  awake.islands.finish();
  awake.stirred.assign(awake.islands.count, 0);
  const double creep = tangent_at_rest(rules, derived, times.h);
  for (const uint32_t i : awake.active) {
    const Body &b = *entities.bodies[i];
    if (!(b.sleep_state.quiet_time >= rules.def.sleep_time && rest_start(b) <= now) || has_dues(b))
      awake.stirred[awake.islands.of[i]] = 1;
  }
  for (size_t i = 0; i < n; ++i) {
    const ContactPoint &c = detection.contacts[i];
    const double *const l = &solution.rows.impulse[3 * i];
    // A contact at the edge of its cone may also be at rest: it slides if it is faster than the tolerance of
    // a sticking contact.
    const double s1 = solution.state.vt[i], s2 = solution.state.vt[solution.state.stride + i];
    const bool slides =
        solution.state.mode[i] != 1 && (l[1] != 0 || l[2] != 0) && s1 * s1 + s2 * s2 > creep * creep;
    const bool pushed =
        c.obstacle && (entities.obstacles[c.slot_b]->rigid || views.obstacle_views[c.slot_b].moves());
    if (slides || pushed) awake.stirred[awake.islands.of[c.slot_a]] = 1;
  }
  for (const Attachment &a : state.attachments) {
    if (!a.obstacle) continue;
    const uint32_t slot = obstacle_slot_of(entities, a.to);
    if (entities.obstacles[slot]->rigid || views.obstacle_views[slot].moves())
      awake.stirred[awake.islands.of[slot_of(entities, a.body)]] = 1;
  }
  bool any = false;
  for (const uint32_t i : awake.active)
    if (!awake.stirred[awake.islands.of[i]]) {
      fall_asleep(state, derived.plan, now, times.h, *entities.bodies[i]);
      any = true;
    }
  if (any) gather_active(entities, derived, views, end, awake);
}

// Contacts of sleeping bodies are appended to those of this sub-step, in the order of their keys.
void carry_sleepers(World &w, StepContext &step, uint32_t *touching, uint32_t *sticking) {
  ContactStore &to = step.next_store;
  const uint32_t own = to.n;
  const double scale = w.store.h > 0 ? step.h / w.store.h : 0;  // impulses belong to a sub-step's length
  uint64_t last = 0;  // contacts of a body are adjacent, where they have just fallen asleep
  bool rests = false;
  const auto sleeps = [&](uint32_t m) {
    if (std::exchange(last, w.store.id_a[m]) != w.store.id_a[m]) rests = asleep(w, last);
    return rests;
  };
  const auto carry = [&](uint32_t from, uint32_t end) {
    const auto copy = [=](const auto &source, auto &into, size_t width) {
      into.insert(into.end(), source.begin() + std::ptrdiff_t(from * width),
                  source.begin() + std::ptrdiff_t(end * width));
    };
    each_column(
        [&](const ContactColumn &column, const auto &source, auto &into) {
          if (column.carried && column.width != kOwnLength && column.width != kPerState)
            copy(source, into, column.width);
        },
        w.store, to);
    if (step.shares) copy(w.store.next_area.empty() ? w.store.area : w.store.next_area, to.next_area, 1);
    if (to.nstate == w.store.nstate) copy(w.store.bristle, to.bristle, w.store.nstate);
    else
      for (uint32_t m = from; m < end; ++m)
        for (uint32_t s = 0; s < to.nstate; ++s)
          to.bristle.push_back(s < w.store.nstate ? w.store.bristle[size_t(w.store.nstate) * m + s] : 0);
    std::iota(step.goes_on.begin() + from, step.goes_on.begin() + end, to.n);
    to.n += end - from;
  };
  // While the same bodies sleep, their contacts are the tail of the old store, and are taken over as a whole.
  uint32_t tail = w.store.n;
  while (tail > 0 && sleeps(tail - 1) && (tail == w.store.n || w.store.key[tail - 1] < w.store.key[tail]))
    --tail;
  uint32_t before = 0;
  while (before < tail && !sleeps(before)) ++before;
  if (before == tail) {
    carry(tail, w.store.n);
  } else {
    for (const uint32_t m : w.store.by_key)
      if (sleeps(m)) carry(m, m + 1);
  }
  to.began.resize(to.n, 0);
  to.by_key.resize(to.n);
  for (size_t i = size_t(3) * own; i < size_t(3) * to.n; ++i) to.impulse[i] *= scale;
  for (uint32_t m = own; m < to.n; ++m) {
    to.lasting[m] *= scale;
    *touching += to.touching[m];
    *sticking += to.sticks[m];
  }

  // Two sorted runs: this sub-step's, which `match` takes meanwhile, and the carried, whose places
  // are their order.
  std::copy(to.by_key.begin(), to.by_key.begin() + own, step.match.begin());
  for (uint32_t i = 0, m = own, k = 0; k < to.n; ++k)
    to.by_key[k] = m == to.n || (i < own && to.key[step.match[i]] < to.key[m]) ? step.match[i++] : m++;
}

// Contacts of sleeping bodies stick: a hold that begins now counts them from now on.
void hold_sleepers(World &w) {
  for (uint32_t m = 0; m < w.store.n; ++m)
    w.store.held[m] = w.store.impulse[size_t(3) * m] > 0 && asleep(w, w.store.id_a[m]);
}

}  // namespace dfm
