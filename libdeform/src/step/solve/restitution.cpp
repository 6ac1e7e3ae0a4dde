#include "step/solve/restitution.h"

#include <algorithm>
#include <utility>

#include "body/rigid_motion.h"
#include "dynamics/rigid/rigid_set.h"
#include "friction/laws.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/sides.h"

namespace dfm {
namespace {

// An impact is faster than this many times what gravity makes in the sub-step: what rests does not bounce.
constexpr double kWeights = 2;
// Where the response of a contact is more than this many times that of the bodies as rigid ones, they deform
// within the sub-step and spring back by themselves. Of a ball it is 2 if the impact takes 1.5 sub-steps, and
// 1.6 if it takes one.
constexpr double kStiff = 1.8;
// A body that lands is followed to a distance of this share of an edge, the accuracy of implicit steps times
// ten.
constexpr double kNear = 0.05;
// Share of the planned sub-step that is left to the impact, because in a shorter one bodies deform.
constexpr double kLeft = 0.25;

double restitution(const World &w, const StepContext &step, uint32_t i) {
  return w.pairs.laws[step.state.law[i]]->restitution;
}

double gap_of(const World &w, const ContactPoint &c) { return c.distance - w.offset; }

RigidMotion motion_of(const Body &b) {
  b.dynamics->see_points();
  const auto at = [](const Array<double> &of) {
    return [&of](uint32_t i) { return load3(&of[size_t{kStride} * i]); };
  };
  return rigid_motion(b.p.n, b.p.mass.data(), at(b.p.x), at(b.p.v));
}

// Whether all bodies of a contact are marked.
bool all_marked(const Array<uint8_t> &marked, const ContactPoint &c) {
  return marked[c.slot_a] && (c.obstacle || marked[c.slot_b]);
}

}  // namespace

// Bodies meet as they move as a whole: their points tremble, and stop before the body does where a sub-step
// is short. What gravity makes after the impact is taken off, as in free motion.
void find_throws(const World &w, StepContext &step) {
  step.rebound_speed.clear();
  const auto has = [](const LawInstance *law) { return law->restitution > 0; };
  if (std::ranges::none_of(w.pairs.laws, has)) return;
  const ContactRows &rows = step.rows;
  step.rebound_speed.assign(rows.soft(), 0);
  step.motions.resize(w.bodies.size());
  step.marked.assign(w.bodies.size(), 0);
  const auto motion = [&](uint32_t slot) -> const RigidMotion & {
    if (!std::exchange(step.marked[slot], uint8_t{1})) step.motions[slot] = motion_of(*w.bodies[slot]);
    return step.motions[slot];
  };
  const double falls = step.h * norm(w.gravity.now),
               least = kWeights * step.length.planned * norm(w.gravity.now);
  for (uint32_t i = 0; i < rows.soft(); ++i) {
    const double e = restitution(w, step, i);
    if (!(e > 0)) continue;
    const ContactPoint &c = step.contacts[i];
    const Vec3 at = load3(c.point), normal = load3(c.normal);
    const RigidMotion &own = motion(c.slot_a);
    double whole = own.response(at, normal), speed = -dot(normal, own.at(at));
    if (!c.obstacle) {
      const RigidMotion &other = motion(c.slot_b);
      whole += other.response(at, normal);
      speed += dot(normal, other.at(at));
    } else if (!rows.rigid.empty() && rows.rigid[i] != kNone) {
      const Obstacle &o = *w.obstacles[c.slot_b];
      const dfm_rigid_state &s = o.rigid->state[o.rigid_body];
      speed += dot(normal, load3(s.velocity) + cross(load3(s.spin), load3(&rows.arm[size_t(3) * i])));
      whole += dot(normal, rows.rigid_diagonal(i, normal));
    } else speed += rows.drive[size_t(3) * i];
    const double closing = -rows.velocity(i).x, estimate = rows.whole_response(i);
    // of implicit bodies what contact estimates of the whole is known here
    const double response = estimate > 0 ? rows.wn[i] - estimate + whole : rows.wn[i];
    if (!(speed > least) || response > kStiff * whole || gap_of(w, c) > step.h * std::max(speed, closing))
      continue;
    step.rebound_speed[i] = std::max(0.0, e * speed - std::clamp(closing - speed, 0.0, falls));
  }
}

void bounce(StepContext &step) {
  for (uint32_t i = 0; i < step.rebound_speed.size(); ++i)
    if (step.rebound_speed[i] > 0) step.rows.rate[i] = std::min(step.rows.rate[i], -step.rebound_speed[i]);
}

double lands_at(const World &w, StepContext &step) {
  if (step.rebound_speed.empty()) return 1;
  const ContactRows &rows = step.rows;
  const auto is_near = [&](const ContactPoint &c) {
    double edge = w.bodies[c.slot_a]->surface.median_edge;
    if (!c.obstacle) edge = std::min(edge, w.bodies[c.slot_b]->surface.median_edge);
    return gap_of(w, c) <= kNear * edge;
  };
  step.marked.assign(w.bodies.size(), 0);  // touches, or is about to
  for (uint32_t i = 0; i < rows.soft(); ++i)
    if (rows.impulse[size_t(3) * i] > 0 || (step.rebound_speed[i] > 0 && is_near(step.contacts[i])))
      each_body(step.contacts[i], [&](uint32_t slot) { step.marked[slot] = 1; });
  double first = 1;
  for (uint32_t i = 0; i < rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    if (!(step.rebound_speed[i] > 0) || is_near(c) || all_marked(step.marked, c)) continue;
    const double closing = -rows.velocity(i).x * step.h, gap = gap_of(w, c);
    if (closing > gap) first = std::min(first, gap / closing);
  }
  const double last = 1 - kLeft * step.length.planned / step.h;
  return first < 1 && last > 0 ? std::min(first, last) : 1;
}

bool has_restitution(const World &w, const StepContext &step, const Body &b) {
  bool any = false;
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    if (!is_side(c, b.slot)) continue;
    if (!(step.rows.impulse[size_t(3) * i] > 0)) continue;
    if (restitution(w, step, i) == kNoRestitution) return false;
    any = true;
  }
  return any;
}

}  // namespace dfm
