// The guard against closed forms. A convex shape that stands still, seen by a surfel on a straight line: the distance is a convex function of time, its
// slope is the normal's share of the motion, and Newton's steps from the left never pass its first root. Edges and triangles meet the shape's edges,
// axis, corners and centres as features that do not move.
#include "narrow/toi_guard_motion.h"
#include "surfel/contact_set.h"
#include "surfel/obstacle_shape.h"

namespace dfm {
namespace {

constexpr int kNewton = 60;   // far more than it takes; each step is safe, so stopping early stops early

struct Frame {
  ObstacleShape shape;        // in its own frame
  Vec3 start, end;
  Quat turn_start, turn_end;
  Frame(const ObstacleView &view, const GuardPose &pose)
      : shape(at_origin(view)), start(view.position), end(pose.position), turn_start(view.rotation), turn_end(pose.rotation) {}
  static ObstacleView at_origin(ObstacleView view) {
    view.position = {}, view.rotation = {};
    return view;
  }
  dfm_motion path(const BodyView &body, const double *to, uint32_t surfel) const {
    dfm_motion m;
    store3(m.p0, rotate_back(turn_start, load3(&body.surface->x[4 * size_t{surfel}]) - start));
    store3(m.p1, rotate_back(turn_end, load3(&to[4 * size_t{surfel}]) - end));
    return m;
  }
};

dfm_motion still(Vec3 p) {
  dfm_motion m;
  store3(m.p0, p), store3(m.p1, p);
  return m;
}

ToiHit surfel_touch(const ObstacleShape &shape, Vec3 from, Vec3 way, double distance, double within) {
  double t = 0;
  for (int i = 0; i < kNewton; ++i) {
    const ObstaclePoint p = shape.closest(from + t * way);
    if (p.distance <= distance + within) break;
    const double rate = dot(p.normal, way), left = distance - p.distance;   // left < 0
    if (!(rate < 0) || left < rate * (1 - t)) return {HUGE_VAL, {}, 0};
    t = std::min(1.0, t + left / rate);
  }
  return {t, {1, 0, 0}, 0};
}

class Judge {
 public:
  Judge(double floor, double margin, Array<GuardHit> &out) : floor_(floor), margin_(margin), out_(out) {}
  double least() const { return least_; }

  void surfel(uint32_t candidate, const ObstacleShape &shape, const dfm_motion &m) {
    const Vec3 from = load3(m.p0), way = load3(m.p1) - from;
    const double start = shape.closest(from).distance;
    if (!(start > 0)) return;
    GuardHit hit{candidate, 0, 0, 0, 0, {}};
    keep(narrow::judge([&](double d, double within) { return surfel_touch(shape, from, way, d, within); }, [&] { return start; }, floor_, margin_, hit), hit);
  }
  void pair(uint32_t candidate, uint32_t part, const narrow::PairMotion &m) {
    if (m.far_apart(floor_) || !(m.distance(0) > 0)) return;
    GuardHit hit{candidate, part, 0, 0, 0, {}};
    keep(narrow::judge([&](double d, double within) { return m.touch(d, within); }, [&] { return m.distance(0); }, floor_, margin_, hit), hit);
  }

 private:
  void keep(bool trips, const GuardHit &hit) {
    if (!trips) return;
    out_.push_back(hit);
    least_ = std::min(least_, hit.safe);
  }
  double floor_, margin_, least_ = 1;
  Array<GuardHit> &out_;
};

}  // namespace

double guard_obstacles(std::span<const BodyView> bodies, std::span<const double *const> end, std::span<const ObstacleView> obstacles,
                       std::span<const GuardPose> ends, const Array<Candidate> &candidates, std::span<const uint32_t> which, double floor,
                       double margin, Array<GuardHit> &out) {
  Judge judge(floor, margin, out);
  for (const uint32_t i : which) {
    const Candidate &c = candidates[i];
    if (!c.obstacle) continue;
    const BodyView &body = bodies[c.slot_a];
    const double *const to = end[c.slot_a];
    const Frame frame(obstacles[c.slot_b], ends[c.slot_b]);
    const Shape kind = frame.shape.view().shape;
    narrow::PairMotion m;
    if (c.kind == 0) {
      judge.surfel(i, frame.shape, frame.path(body, to, c.feature_a));
    } else if (c.kind == 1) {
      const uint32_t *const ends_of = &body.surface->edge[2 * size_t{c.feature_a}];
      m.edges = true;
      m.m[0] = frame.path(body, to, ends_of[0]), m.m[1] = frame.path(body, to, ends_of[1]);
      if (kind == Shape::box) {
        for (uint32_t k = 0; k < 12; ++k) {
          Vec3 p, q;
          uint32_t faces[2];
          frame.shape.edge(k, p, q, faces);
          m.m[2] = still(p), m.m[3] = still(q);
          judge.pair(i, k, m);
        }
      } else if (kind == Shape::capsule) {
        m.round = frame.shape.view().radius;
        m.m[2] = still(frame.shape.end(0)), m.m[3] = still(frame.shape.end(1));
        judge.pair(i, 2, m);
      }
    } else {
      const uint32_t *const corner = &body.surface->tri[3 * size_t{c.feature_a}];
      m.edges = false;
      for (int k = 0; k < 3; ++k) m.m[1 + k] = frame.path(body, to, corner[k]);
      if (kind != Shape::box) m.round = frame.shape.view().radius;
      const uint32_t points = kind == Shape::box ? 8 : kind == Shape::sphere ? 1 : 2;
      for (uint32_t k = 0; k < points; ++k) {
        m.m[0] = still(kind == Shape::box ? frame.shape.corner(k) : frame.shape.end(int(k)));
        judge.pair(i, kind == Shape::box ? 12 + k : k, m);
      }
    }
  }
  return judge.least();
}

}  // namespace dfm
