// Sleep and waking.
//
//   end of a sub-step    a body whose points are all slower than sleep_speed, and within half of d_c of where they were when its calm began,
//                        stays calm. Speed alone would let slow drift pass, and never let a stiff body sleep that shivers by a nanometer
//                        an island sleeps when all its bodies have been calm for sleep_time, none of its contacts slides or meets
//                        an obstacle that moves or a rigid host's body, and nothing that is prescribed for its bodies lies ahead
//   asleep               x, contacts and their forces stay, v = 0; no stage works on the body. Detection keeps its shape as a partner:
//                        pairs of which at least one side is awake, or an obstacle that moves, are looked at as ever
//   waking               a contact between such a pair, even one that is still open, wakes the whole island before the sub-step goes on:
//                        the woken take the stages that the others have passed, and detection looks again. So a woken body meets what
//                        comes with all of its own dynamics, warm started by the contacts that it had when it fell asleep
//
// Everything is decided by the state alone, in the order of ids.
#include "world/sleep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "narrow/narrow_phase.h"
#include "surfel/make_surface.h"
#include "surfel/reach.h"
#include "world/world.h"

namespace dfm {
namespace {

constexpr double kStay = 0.5;   // of d_c
constexpr double kForever = std::numeric_limits<double>::infinity();

template <class Key>
double last_time(const std::vector<Key> &keys) { return keys.empty() ? -kForever : keys.back().t; }

// From when on nothing that is prescribed for a body changes any more.
double settled_from(const Body &b) {
  double t = -kForever;
  for (const Load &l : b.loads) t = std::max(t, l.sine.amplitude[0] != 0 && l.sine.frequency != 0 ? kForever : last_time(l.keys));
  for (const Spring &s : b.springs) t = std::max(t, last_time(s.keys));
  for (const HeldMotion &m : b.motions) {
    const bool swings = m.sine.frequency != 0 && norm2(load3(m.sine.amplitude)) != 0;
    t = std::max(t, swings ? kForever : last_time(m.keys));
  }
  return t;
}

// Ids rise with the slots; slots themselves are renewed by prepare() only.
uint32_t slot_of(const World &w, uint64_t id) {
  const auto at = std::lower_bound(w.bodies.begin(), w.bodies.end(), id, [](const auto &b, uint64_t value) { return b->id < value; });
  return at != w.bodies.end() && (*at)->id == id ? static_cast<uint32_t>(at - w.bodies.begin()) : kNone;
}

bool asleep(const World &w, uint64_t id) {
  const uint32_t i = slot_of(w, id);
  return i != kNone && w.bodies[i]->slumber.asleep;
}

}  // namespace

// Which bodies the stages of a sub-step work on, and whom contact impulses go to.
void World::gather_active() {
  active.clear(), sinks.clear();
  for (uint32_t i = 0; i < bodies.size(); ++i) {
    Body &b = *bodies[i];
    body_views[i].asleep = b.slumber.asleep;
    if (b.slumber.asleep) continue;
    active.push_back(i);
    sinks.push_back({body_views[i].first_node, b.surface.nsurfel, b.p.n, &b.surface, b.surfel_impulse.data(),
                     b.model.stepper ? nullptr : b.p.impulse.data()});
  }
  sleepers = static_cast<uint32_t>(bodies.size() - active.size());
}

void World::reserve_sleep(uint32_t n) {
  if (def.sleep) islands.reserve(n), active.reserve(n), woken.reserve(n), stirred.reserve(n);
}

void World::rouse(std::span<const uint32_t> slots) {
  // What time would have added to contacts that stay: their age, and the impulse that they pass on.
  for (uint32_t m = 0; m < store.n; ++m) {
    const uint32_t a = slot_of(*this, store.id_a[m]);
    if (store.touching[m] && a != kNone && bodies[a]->slumber.asleep && std::binary_search(slots.begin(), slots.end(), a))
      store.dwell[m] += time - bodies[a]->slumber.since;
  }
  for (const uint32_t i : slots) {
    Body &b = *bodies[i];
    if (b.slumber.asleep) {
      b.contact_impulse += (time - b.slumber.since) * b.slumber.force;
      woken.push_back(i);
    }
    b.slumber = {};
  }
  if (!changed) gather_active();   // else prepare() does, whose views are out of date now
}

// The whole island, as its contacts stood when it fell asleep.
void World::wake(Body &b) {
  b.slumber.calm = 0;
  if (!b.slumber.asleep) return;
  islands.start(static_cast<uint32_t>(bodies.size()));
  for (uint32_t m = 0; m < store.n; ++m) {
    const uint32_t i = slot_of(*this, store.id_a[m]), j = slot_of(*this, store.id_b[m]);
    if (i != kNone && j != kNone && bodies[i]->slumber.asleep && bodies[j]->slumber.asleep) islands.join(i, j);
  }
  islands.finish();
  const uint32_t k = islands.of[slot_of(*this, b.id)];
  rouse({&islands.member[islands.begin[k]], islands.begin[k + 1] - islands.begin[k]});
}

void World::wake_all() {
  for (auto &b : bodies) b->slumber.calm = 0;
  if (sleepers == 0) return;
  islands.start(static_cast<uint32_t>(bodies.size()));
  islands.finish();
  rouse(islands.member);   // of islands that no pair joins: all bodies, ascending
}

void World::wake_touching(uint64_t obstacle) {
  for (uint32_t m = 0; m < store.n; ++m)
    if (const uint32_t i = store.id_b[m] == obstacle ? slot_of(*this, store.id_a[m]) : kNone; i != kNone) wake(*bodies[i]);
}

// Nothing moves and nothing will: the sub-step would leave everything as it is. What a rigid host's bodies do only the host knows.
bool World::idle() const {
  return sleepers > 0 && active.empty() && rigid_sets.empty() &&
         std::none_of(obstacle_views.begin(), obstacle_views.end(), [](const ObstacleView &o) { return o.moves(); });
}

bool World::stage_narrow(uint32_t *trouble) {
  struct Restored {
    World &w;
    ~Restored() { w.gather_active(); }
  };
  for (;;) {
    find_contacts(body_views, obstacle_views, broad.candidates(), h, offset, store.crossings, lent, contacts);
    woken.clear();
    if (sleepers == 0) return true;
    for (const ContactPoint &c : contacts) {
      if (bodies[c.slot_a]->slumber.asleep) wake(*bodies[c.slot_a]);
      if (!c.obstacle && bodies[c.slot_b]->slumber.asleep) wake(*bodies[c.slot_b]);
    }
    if (woken.empty()) return true;
    std::sort(woken.begin(), woken.end());
    {
      const Restored all{*this};
      active.swap(woken);
      if (!stage_model(trouble) || !stage_predict(trouble)) return false;
      stage_gather();
    }
    stage_broad();
  }
}

// At the end of a sub-step that has been committed; allocates nothing.
void World::stage_sleep() {
  const double end = time + h;
  woken.clear();
  bool tired = false;
  for (const uint32_t i : active) {
    Body &b = *bodies[i];
    const Phyxels &p = b.p;
    double &calm = b.slumber.calm;
    if (!(largest_norm(p.n, p.v.data(), nullptr) < def.sleep_speed)) {
      calm = 0;
    } else if (calm > 0 && largest_norm(p.n, p.x.data(), b.anchor.data()) <= kStay * offset) {
      calm += h;
    } else {
      calm = h;
      std::copy(p.x.begin(), p.x.end(), b.anchor.begin());
    }
    tired |= b.slumber.calm >= def.sleep_time;
  }
  if (!tired || end < last_time(gravity_keys)) return;

  const size_t n = plan.touches() ? contacts.size() : 0;
  islands.start(static_cast<uint32_t>(bodies.size()));
  for (size_t i = 0; i < n; ++i)
    if (!contacts[i].obstacle) islands.join(contacts[i].slot_a, contacts[i].slot_b);
  islands.finish();
  stirred.assign(islands.count, 0);
  const double creep = def.contact_tolerance > 0 ? def.contact_tolerance : 1e-6;
  for (const uint32_t i : active) {
    const Body &b = *bodies[i];
    if (!(b.slumber.calm >= def.sleep_time && settled_from(b) <= end)) stirred[islands.of[i]] = 1;
  }
  for (size_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    const double *const l = &rows.impulse[3 * i];
    // At the edge of its cone a contact may rest as well: sliding is what is faster than a contact that sticks may be left with.
    const double s1 = state.vt[i], s2 = state.vt[state.stride + i];
    const bool slides = state.mode[i] != 1 && (l[1] != 0 || l[2] != 0) && s1 * s1 + s2 * s2 > creep * creep;
    const bool pushed = c.obstacle && (obstacles[c.slot_b]->rigid || obstacle_views[c.slot_b].moves());
    if (slides || pushed) stirred[islands.of[c.slot_a]] = 1;
  }
  bool any = false;
  for (const uint32_t i : active)
    if (!stirred[islands.of[i]]) fall_asleep(*bodies[i], end), any = true;
  if (any) gather_active();
}

void World::fall_asleep(Body &b, double end) {
  Phyxels &p = b.p;
  Vec3 momentum, impulse;
  double kinetic = 0;
  for (uint32_t i = 0; i < p.n; ++i) {
    const Vec3 v = load3(&p.v[size_t(i) * kStride]);
    momentum += p.mass[i] * v, kinetic += 0.5 * p.mass[i] * norm2(v);
  }
  stats.sleep_energy += kinetic;
  store3(stats.sleep_momentum, load3(stats.sleep_momentum) + momentum);
  std::fill(p.v.begin(), p.v.end(), 0.0), std::fill(p.v_free.begin(), p.v_free.end(), 0.0);
  gather_surface(b.surface, p.x.data(), p.v.data());   // detection goes on seeing it, where it stays
  if (plan.touches())
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) impulse += load3(&b.surfel_impulse[3 * size_t(s)]);
  b.slumber = {true, 0, end, h, (1 / h) * impulse};
  b.bound.known = false;
}

// Contacts of those who sleep go on behind the ones of this sub-step, in the order of their keys. last_report belongs to `store`.
void World::carry_sleepers(uint32_t *touching, uint32_t *sticking) {
  ContactStore &to = next_store;
  const uint32_t own = to.n;
  const double scale = store.h > 0 ? h / store.h : 0;   // impulses belong to a sub-step's length
  const auto carry = [&](uint32_t from, uint32_t end) {
    const auto copy = [=](const auto &source, auto &into, size_t width) {
      into.insert(into.end(), source.begin() + std::ptrdiff_t(from * width), source.begin() + std::ptrdiff_t(end * width));
    };
    copy(store.key, to.key, 1), copy(store.id_a, to.id_a, 1), copy(store.id_b, to.id_b, 1), copy(store.law, to.law, 1);
    copy(store.dwell, to.dwell, 1), copy(store.area, to.area, 1);
    if (shares) copy(store.due.empty() ? store.area : store.due, to.due, 1);
    copy(store.touching, to.touching, 1), copy(store.held, to.held, 1), copy(store.path, to.path, 2);
    copy(store.normal, to.normal, 3), copy(store.tangent, to.tangent, 3), copy(store.impulse, to.impulse, 3);
    copy(last_report.contacts, report.contacts, 1), copy(last_report.frame, report.frame, 9), copy(last_report.slip, report.slip, 2);
    copy(last_report.mode, report.mode, 1);
    if (to.nstate == store.nstate) copy(store.bristle, to.bristle, store.nstate);
    else
      for (uint32_t m = from; m < end; ++m)
        for (uint32_t s = 0; s < to.nstate; ++s) to.bristle.push_back(s < store.nstate ? store.bristle[size_t(store.nstate) * m + s] : 0);
    to.n += end - from;
  };
  // While the same ones sleep they are the old store's tail, and go over as a whole.
  uint32_t tail = store.n;
  while (tail > 0 && sleeps(tail - 1) && (tail == store.n || store.key[tail - 1] < store.key[tail])) --tail;
  uint32_t before = 0;
  while (before < tail && !sleeps(before)) ++before;
  if (before == tail) {
    carry(tail, store.n);
  } else {
    for (const uint32_t m : store.by_key)
      if (sleeps(m)) carry(m, m + 1);
  }
  to.began.resize(to.n, 0), to.by_key.resize(to.n), report.n = to.n;
  for (size_t i = size_t(3) * own; i < size_t(3) * to.n; ++i) to.impulse[i] *= scale;
  report.impulse.insert(report.impulse.end(), to.impulse.begin() + std::ptrdiff_t(size_t(3) * own), to.impulse.end());
  for (uint32_t m = own; m < to.n; ++m) *touching += to.touching[m], *sticking += to.impulse[size_t(3) * m] > 0 && report.mode[m] == 1;

  // Two sorted runs: this sub-step's, which `match` takes meanwhile, and the carried, whose places are their order.
  std::copy(to.by_key.begin(), to.by_key.begin() + own, match.begin());
  for (uint32_t i = 0, m = own, k = 0; k < to.n; ++k)
    to.by_key[k] = m == to.n || (i < own && to.key[match[i]] < to.key[m]) ? match[i++] : m++;
}

// Is a contact of the old store one of sleepers, which goes on as it is?
bool World::sleeps(uint32_t m) const {
  if (sleepers == 0) return false;
  const uint32_t slot = last_report.contacts[m].slot_a;
  return slot != kNone && bodies[slot]->slumber.asleep;
}

// Contacts that sleep stick: a hold that begins now counts them from now on.
void World::hold_sleepers() {
  for (uint32_t m = 0; m < store.n; ++m)
    store.held[m] = store.impulse[size_t(3) * m] > 0 && asleep(*this, store.id_a[m]);
}

// Before the world forgets a body or an obstacle: whom it touched wakes, and the contacts of those who sleep on name slots that move up.
void World::close_slot(uint64_t id, bool obstacle) {
  const auto thing = std::find_if(obstacles.begin(), obstacles.end(), [&](auto &o) { return o->id == id; });
  const uint32_t slot = obstacle ? static_cast<uint32_t>(thing - obstacles.begin()) : slot_of(*this, id);
  if (obstacle) wake_touching(id);
  else wake(*bodies[slot]);
  if (sleepers == 0) report.n = 0;
  for (ContactPoint &c : report.contacts) {
    if (!obstacle && c.slot_a == slot) c.slot_a = kNone;   // touches no more, and is nobody's until the next sub-step drops it
    else if (!obstacle && c.slot_a > slot && c.slot_a != kNone) --c.slot_a;
    if (bool(c.obstacle) == obstacle && c.slot_b > slot) --c.slot_b;
  }
}

}  // namespace dfm
