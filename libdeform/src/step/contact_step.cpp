#include "step/contact_step.h"

#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "body/rigid_motion.h"
#include "contact/reach.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
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

double speed_of(const Extent &velocity) {  // m/s, at most
  Vec3 fastest;
  for (int k = 0; k < 3; ++k) fastest[k] = std::max(-velocity.lo[k], velocity.hi[k]);
  return norm(fastest);
}

// m/s, of the points of a mesh that are within `place`.
Extent velocity_of(const World &w, const ObstacleView &v, const Extent &place) {
  const Obstacle &o = *w.obstacles[v.slot];
  RigidMotion motion{v.position, v.velocity, v.spin};
  if (is_moved(o)) {
    const dfm_rigid_state &s = o.rigid->state[o.rigid_body];
    motion = RigidMotion{load3(s.position), load3(s.velocity), load3(s.spin)};
  }
  Extent out;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = corner >> k & 1 ? place.hi[k] : place.lo[k];
    out.add(motion.at(p));
  }
  return out;
}

// Of `a` as seen from what has these velocities.
Extent relative(const Motion &a, const Extent &velocity) {
  return {a.velocity.lo - velocity.hi, a.velocity.hi - velocity.lo};
}

// m, the places that it comes to within dt, seen so, and d_c around them.
Extent swept(const Motion &a, const Extent &velocity, double dt, double offset) {
  Extent out = a.place;
  out.add(out.lo + dt * velocity.lo);
  out.add(out.hi + dt * velocity.hi);
  out.grow({offset, offset, offset});
  return out;
}

// 1/s: how many of these edges the reach grows by in a second.
double rate(const Extent &velocity, double edge) {
  return edge > 0 ? contact_reach(1, 0, speed_of(velocity)) / edge : 0;
}

}  // namespace

double contact_step(World &w, StepContext &step, double dt) {
  if (std::isfinite(w.bound.step) || w.prescribed.is_static()) return HUGE_VAL;
  step.rest = step.h = step.left = dt;
  view_obstacles(w, step);
  const auto add = [&](uint32_t slot) { step.surface_motions[slot] = motion_of(*w.bodies[slot]); };
  step.surface_motions.resize(w.bodies.size());
  double fastest = 0, edge = HUGE_VAL;
  for (uint32_t i = 0; i < w.bodies.size(); ++i) {
    edge = std::min(edge, w.bodies[i]->surface.median_edge);
    if (w.bodies[i]->sleep_state.asleep) continue;
    add(i);
    fastest = std::max(fastest, speed_of(step.surface_motions[i].velocity));
  }
  for (const ObstacleView &o : step.obstacle_views) {
    if (o.shape != Shape::mesh) continue;
    ObstacleMesh &mesh = *w.obstacles[o.slot]->mesh;
    edge = std::min(edge, mesh.surface.median_edge);
    fastest = std::max(fastest, speed_of(velocity_of(w, o, mesh.bounds())));
  }
  if (!(contact_reach(dt, 0, 2 * fastest) > edge)) return HUGE_VAL;
  for (uint32_t i = 0; i < w.bodies.size(); ++i)
    if (w.bodies[i]->sleep_state.asleep) add(i);
  double most = 1 / dt;  // what is slower needs no look
  for (const BodyView &va : step.body_views) {
    const Motion &a = step.surface_motions[va.slot];
    for (const BodyView &vb : step.body_views) {
      if (!(va.slot < vb.slot)) continue;
      const Motion &b = step.surface_motions[vb.slot];
      const Extent velocity = relative(a, b.velocity);
      const double needed = rate(velocity, std::min(a.edge, b.edge));
      if (needed > most && swept(a, velocity, dt, w.offset).meets(b.place) &&
          w.pairs.filter.may_touch(va, vb))
        most = needed;
    }
    for (const ObstacleView &o : step.obstacle_views) {
      if (o.shape != Shape::mesh) continue;
      ObstacleMesh &mesh = *w.obstacles[o.slot]->mesh;
      const Extent velocity = relative(a, velocity_of(w, o, a.place));
      const double needed = rate(velocity, std::min(a.edge, mesh.surface.median_edge));
      if (!(needed > most && w.pairs.filter.may_touch(va, o))) continue;
      if (!mesh.tree) mesh.make_tree(w.meters.obstacles.memory());
      const Extent place = swept(a, velocity, dt, w.offset);
      mesh.triangles_near(place.lo, place.hi, step.triangles);
      if (!step.triangles.empty()) most = needed;
    }
  }
  return 1 / most;
}

}  // namespace dfm
