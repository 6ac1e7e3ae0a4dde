// What goes so far in a sub-step that its rows, made where two things are nearest at the start, may not keep
// it apart from what it meets: fast things, and what an impulse makes fast. Once the ends of the sub-step are
// known, the paths of corners and edges are followed by the guard's conservative advancement (ccd/). If they
// meet the other thing, the sub-step is repeated shorter: it ends before that, and rows are made there.
#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "ccd/toi_guard_motion.h"
#include "dynamics/rigid/rigid_set.h"
#include "geometry/area.h"
#include "geometry/closest.h"
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
constexpr double kDeep = 2;      // of d_c, by which a sub-step may make a gap smaller than at its start
constexpr double kMeet = 0.5;    // of d_c: what comes as near has met
constexpr double kWithin = 0.1;  // of that: it may be found this far above
constexpr double kMinCut = 0.1;  // of a sub-step, by which it is repeated
constexpr double kMinSubstep = 1.0 / 4096;  // of a planned sub-step

// The motion of a shape in the sub-step.
struct Way {
  Pose from, to;
  Way(const Obstacle &o, const ObstacleView &v, double h)
      : from{v.position, v.rotation},
        to(is_moved(o) ? shape_pose(o, o.rigid->next[o.rigid_body])
                       : Pose{v.position + h * v.velocity, turned(v.rotation, h * v.spin)}) {}
};

// rad; a sphere does not look turned
double turn_of(const Way &way, const ObstacleView &v) {
  return v.shape == Shape::sphere ? 0 : norm(rotation_vector(way.to.rotation * conjugate(way.from.rotation)));
}

// m, the longest path of its points
double longest(const Way &way, const ObstacleView &v, double turn) {
  return norm(way.to.position - way.from.position) +
         (turn > 0 && v.shape != Shape::plane ? turn * ball_around(v) : 0);
}

// How two things move against each other: as seen from the second one, which stays where it is at the start.
struct Sight {
  const ToolShape &own, &other;
  const Way &way, &still;
  double offset, thin;

  Vec3 end(Vec3 p) const {
    const Vec3 at =
        way.to.position + rotate(way.to.rotation, rotate_back(way.from.rotation, p - way.from.position));
    return still.from.position +
           rotate(still.from.rotation, rotate_back(still.to.rotation, at - still.to.position));
  }
  // By how much features that start with this gap are moved apart, so that it may become smaller by kDeep.
  double lift(double gap) const { return std::max(0.0, (kDeep + kMeet) * offset - gap); }
  double met(const narrow::PairMotion &m) const {
    const double near = std::min(kMeet * offset, narrow::kShare * m.distance(0));
    return near > 0 ? m.touch(near, kWithin * near).t : HUGE_VAL;
  }
  double corners() const;
  double edges() const;
};

void put(dfm_motion &m, Vec3 from, Vec3 to) {
  store3(m.p0, from);
  store3(m.p1, to);
}

// The smallest fraction of the motion after which a corner meets the other shape; above 1: none does.
double Sight::corners() const {
  double first = HUGE_VAL;
  narrow::PairMotion m;
  m.edges = false;
  m.round = own.round() + other.round();
  for (const ToolShape::Corner &corner : own.corners()) {
    Vec3 p = corner.at, q = end(p);
    ObstaclePoint from, to;
    if (other.closest(p, own.round() + thin, from)) {
      const double gap = from.distance - own.round(), most = std::max(gap, 0.0) + kDeep * offset;
      if (other.closest(q, own.round() + thin, to) && from.distance - to.distance > most)
        first = std::min(first, most / (from.distance - to.distance));
      const Vec3 apart = lift(gap) * from.normal;
      p += apart;
      q += apart;
    }
    put(m.m[0], p, q);
    other.each_triangle([&](Vec3 a, Vec3 b, Vec3 c) {
      if (!other.round() && !(dot(cross(b - a, c - a), p - a) > 0)) return;
      put(m.m[1], a, a);
      put(m.m[2], b, b);
      put(m.m[3], c, c);
      if (!m.far_apart(kMeet * offset)) first = std::min(first, met(m));
    });
  }
  return first;
}

double Sight::edges() const {
  double first = HUGE_VAL;
  narrow::PairMotion m;
  m.edges = true;
  m.round = own.round() + other.round();
  for (const ToolShape::Edge &e : own.edges()) {
    const Vec3 p = end(e.from), q = end(e.to);
    for (const ToolShape::Edge &f : other.edges()) {
      put(m.m[0], e.from, p);
      put(m.m[1], e.to, q);
      put(m.m[2], f.from, f.from);
      put(m.m[3], f.to, f.to);
      if (m.far_apart(kMeet * offset)) continue;
      const SegmentPoints near = closest_segments(e.from, e.to, f.from, f.to);
      const Vec3 on_e = e.from + near.s * (e.to - e.from), on_f = f.from + near.t * (f.to - f.from);
      if (Vec3 n; between(e, f, on_e - on_f, kAlong, n)) {
        const Vec3 apart = lift(dot(n, on_e - on_f) - m.round) * n;
        put(m.m[0], e.from + apart, p + apart);
        put(m.m[1], e.to + apart, q + apart);
      }
      first = std::min(first, met(m));
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
    const auto at = [&](uint32_t k) { return load3(&o.mesh->local[3 * size_t{k}]); };
    const Array<uint32_t> &tri = o.mesh->surface.tri;
    double area = 0;
    for (size_t t = 0; t < tri.size(); t += 3)
      area += 0.5 * norm(cross(at(tri[t + 1]) - at(tri[t]), at(tri[t + 2]) - at(tri[t])));
    return area > 0 ? 2 * std::fabs(signed_volume(tri, at)) / area : HUGE_VAL;
  }
  if (o.grid) return HUGE_VAL;
  if (d.shape == DFM_SHAPE_BOX) return 2 * std::min({d.half_size[0], d.half_size[1], d.half_size[2]});
  return d.shape == DFM_SHAPE_SPHERE || d.shape == DFM_SHAPE_CAPSULE ? 2 * d.radius : HUGE_VAL;
}

// Whether the two go further than any rows keep them apart. Rows hold to first order; what turning adds is at
// most the way times the angle.
bool ToolTouch::goes_far_for_size(const Pair &pair) const {
  const double way = ways_[pair.a] + ways_[pair.b], turn = turns_[pair.a] + turns_[pair.b];
  return way > kFar * pair.thin || way * turn > pair.dent;
}

// The same, or turn by more, than those of this sub-step do.
bool ToolTouch::goes_far(const Pair &pair) const {
  return goes_far_for_size(pair) || ways_[pair.a] + ways_[pair.b] > pair.reach ||
         turns_[pair.a] + turns_[pair.b] > pair.turn;
}

// The fraction of the sub-step after which the two meet; above 1: they do not.
double ToolTouch::meeting(const Entities &entities, const Views &views, const Pair &pair, ToolShape &a,
                          ToolShape &b) const {
  if (!cull_facing(a, b, ways_[pair.a] + ways_[pair.b] + offset_, true)) return HUGE_VAL;
  const auto way_of = [&](uint32_t i) {
    return Way(*entities.obstacles[i], views.obstacle_views[entities.obstacles[i]->slot], h_);
  };
  const Way at_a = way_of(pair.a), at_b = way_of(pair.b);
  const Sight from_b{a, b, at_a, at_b, offset_, pair.thin}, from_a{b, a, at_b, at_a, offset_, pair.thin};
  return std::min({from_b.corners(), from_a.corners(), from_b.edges()});
}

bool ToolTouch::stays_out(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                          const Derived &derived, const Awake &awake, const Views &views, SubStepTimes &times,
                          Budget &budget) {
  if (pairs_.empty()) return true;
  ways_.clear();
  turns_.clear();
  for (const auto &o : entities.obstacles) {
    const ObstacleView &v = views.obstacle_views[o->slot];
    const Way way(*o, v, h_);
    const bool moves = is_moved(*o) || v.moves();
    turns_.push_back(moves ? turn_of(way, v) : 0);
    ways_.push_back(moves ? longest(way, v, turns_.back()) : 0);
    reach_[o->slot] = ways_.back() + offset_;
  }
  find_near(views);
  double first = HUGE_VAL;
  const auto far = [&](const Pair &pair) { return !pair.jaw && goes_far(pair); };
  const auto meet = [&](const Pair &pair, ToolShape &a, ToolShape &b, Side, Side) {
    if (far(pair)) first = std::min(first, meeting(entities, views, pair, a, b));
  };
  if (std::ranges::any_of(near_, [&](uint32_t k) { return far(pairs_[k]); }))
    each_pair(entities, views, std::ref(meet));
  if (!(first <= 1) || !(times.h > kMinSubstep * times.length.planned) ||
      !may_repeat(entities, derived, awake, budget)) {
    warn_passing(memory, state, entities, views);
    return true;
  }
  times.length.repeat_grown(std::max(kMinCut, kAims * first));
  return false;
}

}  // namespace dfm
