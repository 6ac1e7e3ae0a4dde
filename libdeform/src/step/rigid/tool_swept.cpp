// Free bodies so fast that they could pass through something thin within a sub-step. Rows are made where two
// things are nearest at the start of the sub-step; things that turn or slide far meet elsewhere. After a
// solve the paths of corners, edges and centers are tested; if one crosses the other thing, the sub-step is
// repeated shorter, so that it ends before the crossing and rows are made near it.
#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "ccd/toi_guard_motion.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr double kFar = 0.5;     // of the least thickness: what goes less is kept apart by its rows
constexpr double kDeep = 2;      // of d_c, by which a corner may end deeper in the other
constexpr double kCore = 0.5;    // of its radius, that a round thing keeps from the other
constexpr double kAims = 0.9;    // of the way to where it would cross
constexpr double kMinCut = 0.1;  // of a sub-step, by which it is repeated
constexpr double kMinSubstep = 1.0 / 4096;  // of a planned sub-step

// The motion of a shape in the sub-step, and the longest path of its points.
struct Way {
  Pose from, to;
  double most = 0;
};

// In the frame of the other shape, which stays where it is at the start.
Vec3 end_seen(const Way &own, const Way &other, Vec3 p) {
  const Vec3 at =
      own.to.position + rotate(own.to.rotation, rotate_back(own.from.rotation, p - own.from.position));
  return other.from.position +
         rotate(other.from.rotation, rotate_back(other.to.rotation, at - other.to.position));
}

// The fraction of the path from p to q at which it passes through the triangle; above 1: it does not.
double crossing(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c, bool both_ways) {
  const Vec3 n = cross(b - a, c - a);
  const double from = dot(n, p - a), to = dot(n, q - a);
  if (!(from > 0 && to < 0) && !(both_ways && from < 0 && to > 0)) return HUGE_VAL;
  const double t = from / (from - to), least = -1e-9 * norm2(n);
  const Vec3 at = p + t * (q - p);
  for (const auto &[x, y] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
    if (dot(n, cross(y - x, at - x)) < least) return HUGE_VAL;
  return t;
}

// The smallest fraction of its path at which something of `own` passes through the surface of `other`.
double faces_crossed(const ToolShape &own, const Way &way, const ToolShape &other, const Way &still,
                     double deep, double thin) {
  double first = HUGE_VAL;
  for (const ToolShape::Corner &corner : own.corners()) {
    const Vec3 p = corner.at, q = end_seen(way, still, p);
    narrow::PairMotion m;
    m.edges = false;
    store3(m.m[0].p0, p);
    store3(m.m[0].p1, q);
    const double core = kCore * own.round();
    // What is slightly inside already starts at the surface, and may stay as deep.
    ObstaclePoint from, to;
    Vec3 start = p;
    double allowed = deep;
    if (other.closest(p, own.round() + thin, from) && from.distance > -thin) {
      const double gap = from.distance - own.round();
      if (core > 0 && other.closest(q, own.round() + thin, to) &&
          to.distance - own.round() < std::min(gap, 0.0) - deep)
        first = std::min(first, 0.5);
      if (!(core > 0) && gap < 0.5 * deep) {
        start = from.point + 0.5 * deep * from.normal;
        allowed += std::max(0.0, -gap);
      }
    }
    other.each_triangle([&](Vec3 a, Vec3 b, Vec3 c) {
      if (!(core > 0)) {
        const Vec3 n = cross(b - a, c - a);
        if (dot(n, q - a) < -allowed * norm(n)) first = std::min(first, crossing(start, q, a, b, c, false));
        return;
      }
      for (const auto &[k, x] : {std::pair(1, a), std::pair(2, b), std::pair(3, c)}) {
        store3(m.m[k].p0, x);
        store3(m.m[k].p1, x);
      }
      if (m.far_apart(core) || !(m.distance(0) > core)) return;
      first = std::min(first, m.touch(core, 0.1 * core).t);
    });
  }
  return first;
}

double edges_crossed(const ToolShape &own, const Way &way, const ToolShape &other, const Way &still,
                     double deep) {
  double first = HUGE_VAL;
  const double core = kCore * (own.round() + other.round());
  for (const ToolShape::Edge &e : own.edges()) {
    Vec3 p = end_seen(way, still, e.from), q = end_seen(way, still, e.to);
    narrow::PairMotion m;
    m.edges = true;
    for (const auto &[k, from, to] : {std::tuple(0, e.from, p), std::tuple(1, e.to, q)}) {
      store3(m.m[k].p0, from);
      store3(m.m[k].p1, to);
    }
    const auto shorter = [&](Vec3 from, Vec3 to) {
      const double length = norm(to - from);
      return length > deep ? to - (deep / length) * (to - from) : from;
    };
    p = shorter(e.from, p);
    q = shorter(e.to, q);
    for (const ToolShape::Edge &f : other.edges()) {
      store3(m.m[2].p0, f.from);
      store3(m.m[2].p1, f.from);
      store3(m.m[3].p0, f.to);
      store3(m.m[3].p1, f.to);
      if (m.far_apart(core)) continue;
      if (core > 0) {
        if (m.distance(0) > core) first = std::min(first, m.touch(core, 0.1 * core).t);
        continue;
      }
      // the surface that the edge sweeps, as two triangles
      const bool met = crossing(f.from, f.to, e.from, e.to, q, true) <= 1 ||
                       crossing(f.from, f.to, e.from, q, p, true) <= 1;
      if (met) first = std::min(first, 0.5);
    }
  }
  return first;
}

}  // namespace

// m; infinite for an open mesh, which has no inside.
double ToolTouch::thickness(const Obstacle &o) {
  const dfm_obstacle_def &d = o.def;
  if (o.mesh) {
    if (!o.mesh->closed) return HUGE_VAL;
    double volume = 0, area = 0;
    const Surface &s = o.mesh->surface;
    for (uint32_t t = 0; t < s.ntri; ++t) {
      const auto at = [&](uint32_t k) { return load3(&o.mesh->local[3 * size_t{s.tri[3 * size_t{t} + k]}]); };
      const Vec3 n = cross(at(1) - at(0), at(2) - at(0));
      volume += dot(n, at(0)) / 6;
      area += 0.5 * norm(n);
    }
    return area > 0 ? 2 * std::fabs(volume) / area : HUGE_VAL;
  }
  if (o.grid) return HUGE_VAL;
  if (d.shape == DFM_SHAPE_BOX) return 2 * std::min({d.half_size[0], d.half_size[1], d.half_size[2]});
  return d.shape == DFM_SHAPE_SPHERE || d.shape == DFM_SHAPE_CAPSULE ? 2 * d.radius : HUGE_VAL;
}

bool ToolTouch::stays_out(const World &w, StepContext &step) {
  if (!(thinnest_ < HUGE_VAL)) return true;
  const auto way_of = [&](const Obstacle &o) {
    const ObstacleView &v = step.obstacle_views[o.slot];
    Way out;
    out.from = {v.position, v.rotation};
    out.to = is_moved(o) ? shape_pose(o, o.rigid->next[o.rigid_body])
                         : Pose{v.position + step.h * v.velocity, turned(v.rotation, step.h * v.spin)};
    const double turn = norm(rotation_vector(out.to.rotation * conjugate(out.from.rotation)));
    out.most = norm(out.to.position - out.from.position);
    if (turn > 0 && v.shape != Shape::plane && v.shape != Shape::sphere) out.most += turn * ball_around(v);
    return out;
  };
  ways_.resize(w.obstacles.size());
  double most = 0;
  for (size_t i = 0; i < ways_.size(); ++i) {
    const Obstacle &o = *w.obstacles[i];
    const ObstacleView &v = step.obstacle_views[o.slot];
    const bool goes = is_moved(o) || v.moves();
    ways_[i] = goes && ToolShape::takes_part(v) ? way_of(o).most : 0;
    most = std::max(most, ways_[i]);
  }
  if (!(2 * most > kFar * thinnest_)) return true;
  double first = HUGE_VAL;
  for (const Pair &pair : pairs_) {
    const double far = ways_[pair.a] + ways_[pair.b];
    if (!pair.frees || !(far > kFar * pair.thin)) continue;
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    shapes_[0].take(va, a.mesh.get());
    shapes_[1].take(vb, b.mesh.get());
    ToolShape &of_a = shapes_[0], &of_b = shapes_[1];
    if (of_a.endless() || of_b.endless() || !of_a.has_corners() || !of_b.has_corners()) continue;
    const Way at_a = way_of(a), at_b = way_of(b);
    if (!cull_facing(of_a, of_b, far + offset_, true)) continue;
    const double deep = kDeep * offset_;
    first = std::min({first, faces_crossed(of_a, at_a, of_b, at_b, deep, pair.thin),
                      faces_crossed(of_b, at_b, of_a, at_a, deep, pair.thin),
                      edges_crossed(of_a, at_a, of_b, at_b, deep)});
  }
  if (!(first <= 1) || !(step.h > kMinSubstep * step.length.planned) || !may_repeat(w, step)) return true;
  step.length.repeat_grown(std::max(kMinCut, kAims * first));
  return false;
}

}  // namespace dfm
