#include "step/step_impulses.h"

#include <algorithm>
#include <utility>

#include "state/obstacle.h"
#include "state/world.h"
#include "step/sides.h"

namespace dfm {
namespace {

StepImpulses::Pair &pair_of(Array<StepImpulses::Pair> &pairs, uint64_t a, uint64_t b) {
  const auto before = [](const StepImpulses::Pair &p, const std::pair<uint64_t, uint64_t> &key) {
    return std::pair(p.a, p.b) < key;
  };
  auto at = std::lower_bound(pairs.begin(), pairs.end(), std::pair(a, b), before);
  if (at == pairs.end() || at->a != a || at->b != b) {
    StepImpulses::Pair fresh{};
    fresh.a = a;
    fresh.b = b;
    at = pairs.insert(at, fresh);
  }
  return *at;
}

void begin(Array<StepImpulses::Pair> &pairs) {
  for (StepImpulses::Pair &p : pairs) {
    p.now = {};
    p.now_normal = 0;
  }
}

// Spreads the impulse over the parts of the step from `at` to at + time.
void share(const StepImpulses &s, double at, double time, StepImpulses::Pair &p) {
  const double each = s.length / StepImpulses::kParts;
  double from = 0;  // share of the time before the part
  for (int k = 0; k < StepImpulses::kParts; ++k) {
    const bool last = k + 1 == StepImpulses::kParts;
    const double to = last ? 1 : std::clamp((s.start + (k + 1) * each - at) / time, from, 1.0);
    p.part[k] += (to - from) * p.now_normal;
    from = to;
  }
}

void end(const StepImpulses &s, double at, double time, Array<StepImpulses::Pair> &pairs) {
  for (StepImpulses::Pair &p : pairs) {
    if (!(p.now_normal > 0)) continue;
    p.impulse += p.now;
    p.normal += p.now_normal;
    p.touching += time;
    share(s, at, time, p);
    p.peak_normal = std::max(p.peak_normal, p.now_normal / time);
    p.peak_force = std::max(p.peak_force, norm(p.now) / time);
  }
}

// The forces of contacts for `time`, s, from `at` on, added to pairs; a peak is the mean over this time.
void add(const World &w, const ContactStore &s, double at, double time, Array<StepImpulses::Pair> &pairs) {
  const double scale = s.h > 0 ? time / s.h : 0;
  begin(pairs);
  StepImpulses::Pair *pair = nullptr;
  uint32_t last = kNone;  // contacts of an awake pair are adjacent
  bool turned = false;
  for (uint32_t i = 0; i < s.n; ++i) {
    if (!s.bears(i)) continue;
    if (last == kNone || s.id_a[i] != s.id_a[last] || s.id_b[i] != s.id_b[last]) {
      const PairSides sides = pair_sides(w, s, i);
      pair = &pair_of(pairs, sides.a, sides.b);
      turned = sides.turned;
    }
    last = i;
    const double normal = scale * s.impulse[size_t(3) * i];
    if (s.id_a[i] != s.id_b[i]) pair->now += (turned ? -scale : scale) * s.world_impulse(i);
    pair->now_normal += normal;
    pair->place += normal * load3(&s.point[size_t(3) * i]);
  }
  end(w.step_impulses, at, time, pairs);
}

}  // namespace

void begin_impulses(StepImpulses &s, double start, double length) {
  s.pairs.clear();
  s.start = start;
  s.length = length;
  s.idle = 0;
}

void reserve_impulses(StepImpulses &impulses, const WorldState &state, size_t most, size_t contacts,
                      size_t pairs) {
  if (impulses.idle > 0) contacts += state.store.n;
  impulses.pairs.reserve(impulses.pairs.size() + std::min(contacts, most) + pairs);
}

void add_impulses(World &w, const ContactStore &s) { add(w, s, w.time, s.h, w.step_impulses.pairs); }

void end_idle(World &w) {
  StepImpulses &s = w.step_impulses;
  if (!(s.idle > 0)) return;
  reserve_impulses(s, w, w.bodies.size() * (w.bodies.size() + w.obstacles.size()), 0, 0);
  add(w, w.store, w.time - s.idle, s.idle, s.pairs);
  s.idle = 0;
}

void list_impulses(const World &w, Array<StepImpulses::Pair> &out) {
  out = w.step_impulses.pairs;
  const StepImpulses &s = w.step_impulses;
  if (s.idle > 0) add(w, w.store, s.start + s.length - s.idle, s.idle, out);
}

}  // namespace dfm
