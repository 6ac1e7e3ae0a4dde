// The guard against closed forms and voxels. For a surfel that moves on a straight line relative to a convex
// shape at rest, the distance is a convex function of time, its slope is the motion along the normal, and
// Newton's steps from the left never pass its first root. Edges and triangles meet the shape's edges, axis,
// corners and centers as features that do not move. Interpolated distances of voxels are cubic along a line
// from cell to cell; a face is tested at its end, and its lowest place, if that is below the floor, is
// treated as a surfel.
#include <optional>

#include "ccd/toi_guard_motion.h"
#include "narrow/detail.h"

namespace dfm {
namespace {

using narrow::ObstacleFrame;

constexpr int kNewton = 60;  // far more than it takes; each step is safe, so stopping early stops early

dfm_motion still(Vec3 p) {
  dfm_motion m;
  store3(m.p0, p);
  store3(m.p1, p);
  return m;
}

ToiHit surfel_touch(const ObstacleShape &shape, Vec3 from, Vec3 way, double distance, double within) {
  if (shape.view().shape == Shape::voxels)
    return {shape.view().grid->touch(from, way, distance + within), {1, 0, 0}, 0};
  double t = 0;
  for (int i = 0; i < kNewton; ++i) {
    const ObstaclePoint p = shape.closest(from + t * way);
    if (p.distance <= distance + within) break;
    const double rate = dot(p.normal, way), left = distance - p.distance;  // left < 0
    if (!(rate < 0) || left < rate * (1 - t)) return {HUGE_VAL, {}, 0};
    t = std::min(1.0, t + left / rate);
  }
  return {t, {1, 0, 0}, 0};
}

// Whether an edge or a triangle reaches into a box in its pose at the start: no axis separates the two.
bool reaches_in(const ObstacleShape &box, std::span<const dfm_motion> corners) {
  const Vec3 half = box.view().half_size;
  const size_t n = corners.size();
  Vec3 p[3];
  for (size_t k = 0; k < n; ++k) p[k] = box.local(load3(corners[k].p0));
  const auto apart = [&](Vec3 axis) {
    double low = HUGE_VAL, high = -HUGE_VAL, reach = 0;
    for (int i = 0; i < 3; ++i) reach += half[i] * std::fabs(axis[i]);
    for (size_t k = 0; k < n; ++k) {
      low = std::min(low, dot(axis, p[k]));
      high = std::max(high, dot(axis, p[k]));
    }
    return low >= reach || high <= -reach;
  };
  const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const Vec3 &axis : unit) {
    if (apart(axis)) return false;
    for (size_t k = 0; k < (n == 3 ? 3 : 1); ++k)
      if (const Vec3 across = cross(axis, p[(k + 1) % n] - p[k]); norm2(across) > 0 && apart(across))
        return false;
  }
  return n < 3 || !apart(cross(p[1] - p[0], p[2] - p[0]));
}

class Judge {
 public:
  Judge(GuardScene &scene, Array<GuardHit> &out) : scene_(scene), out_(out) {}

  void pair(uint32_t candidate, const Candidate &c) {
    if (c.slot_b != slot_) {
      frame_.emplace(scene_.obstacles[c.slot_b], scene_.poses[c.slot_b]);
      slot_ = c.slot_b;
    }
    const ObstacleFrame &frame = *frame_;
    GuardSide &body = scene_.side(c, false);
    const uint32_t *const corner = narrow::corners_of(*body.surface, c.kind, c.feature_a);
    dfm_motion path[3];
    for (int k = 0; k <= c.kind; ++k) {
      store3(path[k].p0, frame.at_start(load3(&body.surface->x[4 * size_t{corner[k]}])));
      store3(path[k].p1, frame.at_end(load3(scene_.end(body, corner[k]))));
    }
    if (c.kind == 0) surfel({candidate, 0, 0, 0, 0, {}}, frame.shape, load3(path[0].p0), load3(path[0].p1));
    else if (frame.shape.view().shape == Shape::voxels) voxel_face(candidate, frame.shape, path);
    else if (c.kind == 1) edge(candidate, frame.shape, path);
    else triangle(candidate, frame.shape, path);
  }

 private:
  bool surfel(GuardHit hit, const ObstacleShape &shape, Vec3 from, Vec3 to) {
    return surfel(hit, shape, from, to, scene_.floor, scene_.margin);
  }
  bool surfel(GuardHit hit, const ObstacleShape &shape, Vec3 from, Vec3 to, double floor, double margin) {
    const double start = shape.closest(from).distance;
    if (!(start > 0)) return false;
    const auto touch = [&](double d, double within) {
      return surfel_touch(shape, from, to - from, d, within);
    };
    return keep(narrow::judge(touch, [&] { return start; }, floor, margin, hit), hit);
  }
  // The lowest place jumps from cell to cell as the face slides, and its contact with it: a face is kept out
  // of the surface, not out of the floor.
  void voxel_face(uint32_t candidate, const ObstacleShape &shape, const dfm_motion path[3]) {
    const double floor = scene_.margin, margin = 0.1 * floor;
    Vec3 end[3], p, q;
    for (int k = 0; k < 3; ++k) end[k] = load3(path[k].p1);
    double w[3], distance;
    if (!narrow::dips(*shape.view().grid, end, floor, 2 * narrow::kMinDip * scene_.floor, w, distance) ||
        !(distance < floor))
      return;
    for (int k = 0; k < 3; ++k) {
      p += w[k] * load3(path[k].p0);
      q += w[k] * end[k];
    }
    if (surfel({candidate, 0, 0, 0, 0, {}}, shape, p, q, floor, margin)) std::copy_n(w, 3, out_.back().at);
  }
  void edge(uint32_t candidate, const ObstacleShape &shape, const dfm_motion path[2]) {
    narrow::PairMotion m;
    m.edges = true;
    m.m[0] = path[0];
    m.m[1] = path[1];
    if (shape.view().shape == Shape::box) {
      for (uint32_t k = 0; k < 12; ++k) {
        Vec3 p, q;
        uint32_t faces[2];
        shape.edge(k, p, q, faces);
        m.m[2] = still(p);
        m.m[3] = still(q);
        feature(candidate, k, m);
      }
    } else if (shape.view().shape == Shape::capsule) {
      m.round = shape.view().radius;
      m.m[2] = still(shape.end(0));
      m.m[3] = still(shape.end(1));
      feature(candidate, 2, m);
    }
  }
  void triangle(uint32_t candidate, const ObstacleShape &shape, const dfm_motion path[3]) {
    narrow::PairMotion m;
    m.edges = false;
    std::copy_n(path, 3, m.m + 1);
    m.round = shape.view().radius;
    for (uint32_t k = 0; k < shape.points(); ++k) {
      m.m[0] = still(shape.point(k));
      feature(candidate, shape.view().shape == Shape::box ? 12 + k : k, m);
    }
  }
  void feature(uint32_t candidate, uint32_t part, const narrow::PairMotion &m) {
    if (m.far_apart(scene_.floor) || !(m.start() > 0)) return;
    GuardHit hit{candidate, part, 0, 0, 0, {}};
    const auto touch = [&](double d, double within) { return m.touch(d, within); };
    const bool trips = narrow::judge(touch, [&] { return m.distance(0); }, scene_.floor, scene_.margin, hit);
    // A feature inside the box must leave it past the edges and corners of the box: a guard at these would
    // hold it inside, against the contacts that lead it out.
    const bool box = frame_->shape.view().shape == Shape::box;
    if (trips && box && reaches_in(frame_->shape, {m.m + (m.edges ? 0 : 1), m.edges ? 2u : 3u})) return;
    keep(trips, hit);
  }
  bool keep(bool trips, const GuardHit &hit) {
    if (trips) out_.push_back(hit);
    return trips;
  }

  GuardScene &scene_;
  std::optional<ObstacleFrame> frame_;  // of the obstacle of the last query
  uint32_t slot_ = kNone;
  Array<GuardHit> &out_;
};

}  // namespace

void guard_obstacles(GuardScene &scene, const Array<Candidate> &list, std::span<const uint32_t> which,
                     Array<GuardHit> &out) {
  Judge judge(scene, out);
  for (const uint32_t i : which)
    if (scene.closed_form(list[i])) judge.pair(i, list[i]);
}

}  // namespace dfm
