#include "step/contact_step.h"

#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "contact/reach.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "step/context.h"
#include "step/move_obstacles.h"
#include "step/rigid/rigid.h"

namespace dfm {
namespace {

using Motion = StepContext::Motion;

Motion motion_of(const Body &b) {
  const Surface &s = b.surface;
  Motion m{{}, {}, s.median_edge};
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    m.place.add(s.sum(i, b.p.x.data()));
    m.velocity.add(s.sum(i, b.p.v.data()));
  }
  return m;
}

Motion motion_of(const World &w, const ObstacleView &v) {
  const Obstacle &o = *w.obstacles[v.slot];
  Vec3 velocity = v.velocity, spin = v.spin;
  if (is_moved(o)) {
    const dfm_rigid_state &s = o.rigid->state[o.rigid_body];
    spin = load3(s.spin);
    velocity = load3(s.velocity) + cross(spin, v.position - load3(s.position));
  }
  const Extent &place = o.mesh->bounds();
  Motion m{place, {}, o.mesh->surface.median_edge};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = corner >> k & 1 ? place.hi[k] : place.lo[k];
    m.velocity.add(velocity + cross(spin, p - v.position));
  }
  return m;
}

// 1/s: how many edges the reach grows by in a second, of two that meet within dt; otherwise 0.
double rate(const Motion &a, const Motion &b, double offset, double dt) {
  Vec3 fastest;
  for (int k = 0; k < 3; ++k) {
    const double low = a.velocity.lo[k] - b.velocity.hi[k], high = a.velocity.hi[k] - b.velocity.lo[k];
    if (a.place.lo[k] + std::min(low, 0.0) * dt > b.place.hi[k] + offset) return 0;
    if (a.place.hi[k] + std::max(high, 0.0) * dt < b.place.lo[k] - offset) return 0;
    fastest[k] = std::max(-low, high);
  }
  const double edge = std::min(a.edge, b.edge);
  return edge > 0 ? contact_reach(1, 0, norm(fastest)) / edge : 0;
}

}  // namespace

double contact_step(World &w, StepContext &step, double dt) {
  if (std::isfinite(w.bound.step)) return HUGE_VAL;
  step.rest = step.h = step.left = dt;
  view_obstacles(w, step);
  const auto moves = [&](const ObstacleView &o) {
    return o.shape == Shape::mesh &&
           (is_moved(*w.obstacles[o.slot]) || norm2(o.velocity) + norm2(o.spin) > 0);
  };
  if (w.sleepers == w.bodies.size() && std::ranges::none_of(step.obstacle_views, moves)) return HUGE_VAL;
  step.spans.clear();
  for (const auto &b : w.bodies) step.spans.push_back(motion_of(*b));
  double most = 0;
  const auto meet = [&](const auto &a, const auto &b, const Motion &other) {
    const double needed = rate(step.spans[a.slot], other, w.offset, dt);
    if (needed > most && w.pairs.filter.may_touch(a, b)) most = needed;
  };
  for (const BodyView &a : step.body_views)
    for (const BodyView &b : step.body_views)
      if (a.slot < b.slot) meet(a, b, step.spans[b.slot]);
  for (const ObstacleView &o : step.obstacle_views) {
    if (o.shape != Shape::mesh) continue;
    const Motion motion = motion_of(w, o);
    for (const BodyView &a : step.body_views) meet(a, o, motion);
  }
  return most > 0 ? 1 / most : HUGE_VAL;
}

}  // namespace dfm
