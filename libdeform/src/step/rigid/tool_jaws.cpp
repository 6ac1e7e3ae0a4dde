// Jaws of tools: they follow their angle, and yield about their hinge to what is rigid.
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
void ToolTouch::list_jaws(Moved &m, uint32_t groups) {
  const dfm_rigid_state &frame = m.set->state[0];
  const Vec3 axis = rotate(load_quat(frame.rotation), {0, 1, 0});
  for (uint32_t i = 1; i < m.set->defs.size(); ++i) {
    const Vec3 arm = load3(m.set->state[i].position) - load3(frame.position);
    const double length = 2 * m.set->defs[i].half_size[2];
    uint32_t alone = kNone;
    if (!responds({size_t(&m - sides_.data()), i, {}, {}})) {
      alone = groups + static_cast<uint32_t>(alone_.size());
      alone_.push_back({m.set, i});
    }
    m.jaws.push_back({i, axis, cross(axis, arm), 1 / (h_ * h_ * kJaw * length * length), alone});
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

// N m s about its hinge: of all that touches it, or, of a jaw alone, of what is rigid.
double ToolTouch::moment_of(size_t tool, const Moved::Jaw &jaw) const {
  const auto about = [&](Vec3 p, Vec3 m) { return dot(jaw.lever, p) + dot(jaw.axis, m); };
  const double *const all = &sides_[tool].set->impulse[6 * size_t{jaw.part}];
  if (jaw.alone == kNone) return about(load3(all), load3(all + 3));
  double sum = 0;
  for (const Row &row : rows_)
    for (const Side *side : {&row.a, &row.b}) {
      if (side->tool != tool || side->part != jaw.part) continue;
      const Vec3 p = side == &row.a ? row.given() : -row.given();
      sum += about(p, cross(side->arm, p));
    }
  return sum;
}

void ToolTouch::turn_jaws() {
  for (size_t tool = 0; tool < sides_.size(); ++tool)
    for (const Moved::Jaw &jaw : sides_[tool].jaws) {
      const Moved &m = sides_[tool];
      const double moment = moment_of(tool, jaw);
      if (moment == 0) continue;
      const dfm_rigid_state &frame = m.set->next[0];
      dfm_rigid_state &s = m.set->next[jaw.part];
      const Vec3 axis = rotate(load_quat(frame.rotation), {0, 1, 0});
      const double rate = jaw.softness * moment;
      const Quat by = turned(Quat{}, h_ * rate * axis);
      const Vec3 arm = load3(s.position) - load3(frame.position), now = rotate(by, arm);
      store3(s.position, load3(frame.position) + now);
      store_quat(s.rotation, by * load_quat(s.rotation));
      add3(s.velocity, (1 / h_) * (now - arm));
      add3(s.spin, rate * axis);
    }
}

}  // namespace dfm
