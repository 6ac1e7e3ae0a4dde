// Jaws of tools: they follow their angle, and yield about their hinge to what they touch.
#include <algorithm>

#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "step/context.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr double kJaw = 1e4;  // N/m, of a jaw at its tip

}  // namespace

// The hinge is the origin of part 0, about its y.
void ToolTouch::list_jaws(Moved &m) {
  const dfm_rigid_state &frame = m.set->state[0];
  const Vec3 axis = rotate(load_quat(frame.rotation), {0, 1, 0});
  for (uint32_t i = 1; i < m.set->defs.size(); ++i) {
    const Vec3 arm = load3(m.set->state[i].position) - load3(frame.position);
    const double length = 2 * m.set->defs[i].half_size[2];
    m.jaws.push_back({i, axis, cross(axis, arm), 1 / (h_ * h_ * kJaw * length * length)});
  }
}

// A jaw that has been turned returns to its angle by a large rotation, and what it holds undoes that to first
// order. The displacement along the arc beyond it, h w x (w x r) / 2, would remain as creep, so this part of
// the motion counts to first order. The jaw follows the frame along the whole arc; if the frame yields, by
// the spin at the end of the sub-step, not by the one without contact (bend).
void ToolTouch::straighten(Moved &m) const {
  if (m.jaws.empty()) return;
  const dfm_rigid_state &frame = m.set->state[0];
  for (const Moved::Jaw &jaw : m.jaws) {
    double *const v = &m.free[6 * size_t{jaw.part}];
    const Vec3 spin = load3(&m.free[3]), arm = load3(m.set->state[jaw.part].position) - load3(frame.position);
    // about the hinge, as seen from the frame
    const Quat own = load_quat(m.set->state[jaw.part].rotation), to = turned(own, h_ * load3(v + 3));
    const Quat seen = conjugate(turned(load_quat(frame.rotation), h_ * spin)) * to,
               before = conjugate(load_quat(frame.rotation)) * own;
    const double rate = (1 / h_) * rotation_vector(seen * conjugate(before)).y;
    const Vec3 carried = m.responds ? h_ * cross(spin, arm) : rotate(turned(Quat{}, h_ * spin), arm) - arm;
    store3(v, load3(&m.free[0]) + (1 / h_) * carried + rate * jaw.lever);
    store3(v + 3, spin + rate * jaw.axis);
  }
}

// rad/s, by the impulses of the sub-step.
double ToolTouch::rate_of(const Moved &m, const Moved::Jaw &jaw) {
  const double *const p = &m.set->impulse[6 * size_t{jaw.part}];
  return jaw.softness * (dot(jaw.lever, load3(p)) + dot(jaw.axis, load3(p + 3)));
}

void ToolTouch::turn_jaws() {
  for (const Moved &m : sides_)
    for (const Moved::Jaw &jaw : m.jaws) {
      const double rate = rate_of(m, jaw);
      if (rate == 0) continue;
      const dfm_rigid_state &frame = m.set->next[0];
      dfm_rigid_state &s = m.set->next[jaw.part];
      const Vec3 axis = rotate(load_quat(frame.rotation), {0, 1, 0});
      const Quat by = turned(Quat{}, h_ * rate * axis);
      const Vec3 arm = load3(s.position) - load3(frame.position), now = rotate(by, arm);
      store3(s.position, load3(frame.position) + now);
      store_quat(s.rotation, by * load_quat(s.rotation));
      add3(s.velocity, (1 / h_) * (now - arm));
      add3(s.spin, rate * axis);
    }
}

}  // namespace dfm
