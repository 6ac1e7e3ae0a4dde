// Selects the model of a body by contact and distance, between steps:
//
//   touching   it has a contact
//   near       a point of its surface lies within a distance of the place of interest
//   far        else
//
// A finer model (higher in this list) is taken at once. It is kept until it has not been needed for a while,
// and the distance at which near ends is larger than that at which it begins, so that a body that bounces, or
// stays near the limit, does not change back and forth. Sleeping bodies do not change, because a change would
// wake them.
#include <algorithm>

#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "world/model_change.h"

namespace dfm {
namespace {

const ModelChoice &choice_of(const SwitchRule &r, SwitchLevel level) {
  return level == SwitchLevel::touching ? r.touching : level == SwitchLevel::near ? r.near : r.far;
}

void find_touching(World &w, Array<uint8_t> &touching) {
  touching.assign(w.bodies.size(), 0);
  for (uint32_t m = 0; m < w.store.n; ++m)
    for (const uint64_t id : {w.store.id_a[m], w.store.id_b[m]})
      if (const uint32_t i = slot_of(w, id); w.store.touching[m] && i != kNone) touching[i] = 1;
}

bool is_near(const Body &b, const SwitchRule &r) {
  const bool was = r.level == uint32_t(SwitchLevel::near);
  const double limit = r.distance * (was ? 1 + r.hysteresis : 1);
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
    Vec3 x;
    b.surface.each_phyxel(
        s, [&](uint32_t i, double weight) { x += weight * load3(&b.p.x[size_t{kStride} * i]); });
    if (norm2(x - r.point) <= limit * limit) return true;
  }
  return false;
}

SwitchLevel called_for(const Body &b, const SwitchRule &r, bool touches) {
  if (!r.touching.type.empty() && touches) return SwitchLevel::touching;
  return !r.near.type.empty() && is_near(b, r) ? SwitchLevel::near : SwitchLevel::far;
}

void follow(World &w, Body &b, SwitchRule &r, bool touches) {
  const SwitchLevel wanted = called_for(b, r, touches);
  if (uint32_t(wanted) == r.level) {
    r.called = w.time;
    return;
  }
  const bool decided = r.level != uint32_t(SwitchLevel::undecided);
  if (decided && uint32_t(wanted) < r.level && w.time - r.called < r.wait) return;
  const bool again = r.refused >= 0;
  if (again && w.time - r.refused < r.wait) return;
  const ModelChoice &to = choice_of(r, wanted);
  if (!is_made_so(b, to) && !try_change(w, b, to, !again)) {
    r.refused = w.time;
    return;
  }
  r.level = uint32_t(wanted);
  r.called = w.time;
  r.refused = -1;
}

}  // namespace

void follow_rules(World &w) {
  if (std::all_of(w.bodies.begin(), w.bodies.end(), [](const auto &b) { return b->rule.empty(); })) return;
  find_touching(w, w.steps->touching);
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    if (!b.rule.empty() && !b.slumber.asleep) follow(w, b, b.rule[0], w.steps->touching[i]);
  }
}

}  // namespace dfm
