#include "narrow/toi_guard.h"

#include <algorithm>
#include <cmath>

#include "narrow/toi_guard_motion.h"
#include "surfel/closest.h"
#include "surfel/contact_set.h"
#include "surfel/obstacle_shape.h"
#include "surfel/voxel_grid.h"

namespace dfm {
namespace {

using narrow::Features;
using narrow::PairMotion;

constexpr double kRounding = 1 + 1e-6;   // bounds hold in spite of rounding; nothing next to the margin

// What stays above this never trips: whether a pair is asked about does not change the answer, whatever is known of it from before.
double clear_of(const GuardScene &scene) { return kRounding * (scene.floor + 2 * narrow::kSharp * scene.margin); }

// Least height of the features over each other along n, at one time.
double height(const Features &f, Vec3 n, const double *(*at)(const Features &, int)) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (int k = 0; k < 4; ++k) {
    const double d = dot(n, load3(at(f, k)));
    if (k < f.split) low = std::min(low, d);
    else high = std::max(high, d);
  }
  return low - high;
}
const double *at_start(const Features &f, int k) { return f.start[k]; }
const double *at_end(const Features &f, int k) { return f.end[k]; }

// From the second feature to the first, as they start.
Vec3 apart(const Features &f) {
  Vec3 x[4];
  for (int k = 0; k < 4; ++k) x[k] = load3(f.start[k]);
  if (f.split == 2) {
    const auto c = closest_segments(x[0], x[1], x[2], x[3]);
    return x[0] + c.s * (x[1] - x[0]) - x[2] - c.t * (x[3] - x[2]);
  }
  const auto c = closest_on_triangle(x[0], x[1], x[2], x[3]);
  return x[0] - c.weight[0] * x[1] - c.weight[1] * x[2] - c.weight[2] * x[3];
}

// Two surfaces.
class NearPairs {
 public:
  NearPairs(GuardScene &scene, const Array<Candidate> &list, GuardMemory &memory, Array<uint32_t> &near)
      : scene_(scene), list_(list), memory_(memory), near_(near), floor_(clear_of(scene)) {}

  void look(const GuardRun &run) {
    const double now = kRounding * (run.way + run.travel);
    for (uint32_t i = run.begin; i < run.end; ++i)
      if (!(now < memory_.rest[i])) look(i, run.way, now);
  }

 private:
  void look(uint32_t i, double way, double now) {
    const Features f(scene_, list_[i]);
    double *const known = &memory_.normal[3 * size_t{i}], &rest = memory_.rest[i];
    const Vec3 last = load3(known);
    if (norm2(last) > 0 && clear(f, last, way, rest)) return;
    const Vec3 v = apart(f);
    const double d = norm(v);
    rest = way + d - floor_;
    if (!(d > 0)) return near_.push_back(i);
    const Vec3 n = (1 / d) * v;
    store3(known, n);
    if (!(now < rest) && !clear(f, n, way, rest)) near_.push_back(i);
  }
  // The height along n is a lower bound of the distance, so what is found for the start is kept.
  bool clear(const Features &f, Vec3 n, double way, double &rest) {
    const double start = height(f, n, at_start);
    rest = std::max(rest, way + start - floor_);
    return start > floor_ && height(f, n, at_end) > floor_;
  }

  GuardScene &scene_;
  const Array<Candidate> &list_;
  GuardMemory &memory_;
  Array<uint32_t> &near_;
  double floor_;
};

// A surface and a closed-form shape or voxels, in the frame of the obstacle.
class NearObstacle {
 public:
  NearObstacle(GuardScene &scene, const Array<Candidate> &list, GuardMemory &memory, Array<uint32_t> &near)
      : scene_(scene), list_(list), memory_(memory), near_(near), floor_(clear_of(scene)) {}

  void look(const GuardRun &run) {
    const Candidate &first = list_[run.begin];
    const ObstacleView &view = scene_.obstacles[first.slot_b];
    const double now = kRounding * (run.way + run.travel);
    const narrow::ObstacleFrame frame(view, scene_.poses[first.slot_b]);
    GuardSide &body = scene_.side(first, false);
    for (uint32_t i = run.begin; i < run.end; ++i) {
      if (now < memory_.rest[i]) continue;
      if (view.shape == Shape::voxels) {
        if (list_[i].kind != 0 || !far(frame, body, i, run.way, now)) near_.push_back(i);
      } else if (!clear(frame, body, i, run.way)) {
        near_.push_back(i);
      }
    }
  }

 private:
  // A convex shape lies behind the plane at its point nearest to the feature's middle.
  bool clear(const narrow::ObstacleFrame &frame, GuardSide &body, uint32_t i, double way) {
    const Candidate &c = list_[i];
    const uint32_t *const corner = narrow::corners_of(*body.surface, c.kind, c.feature_a);
    Vec3 from[3], middle;
    for (int k = 0; k <= c.kind; ++k) from[k] = frame.at_start(load3(&body.surface->x[4 * size_t{corner[k]}])), middle += from[k];
    const ObstaclePoint p = frame.shape.closest((1.0 / (c.kind + 1)) * middle);
    double start = HUGE_VAL, end = HUGE_VAL;
    for (int k = 0; k <= c.kind; ++k) start = std::min(start, dot(p.normal, from[k] - p.point));
    memory_.rest[i] = way + start - floor_;
    if (!(start > floor_)) return false;
    for (int k = 0; k <= c.kind; ++k) end = std::min(end, dot(p.normal, frame.at_end(load3(scene_.end(body, corner[k]))) - p.point));
    return end > floor_;
  }
  bool far(const narrow::ObstacleFrame &frame, GuardSide &body, uint32_t i, double way, double now) {
    const Vec3 x = frame.at_start(load3(&body.surface->x[4 * size_t{list_[i].feature_a}]));
    memory_.rest[i] = way + frame.shape.view().grid->clearance(x) - floor_;
    return now < memory_.rest[i];
  }

  GuardScene &scene_;
  const Array<Candidate> &list_;
  GuardMemory &memory_;
  Array<uint32_t> &near_;
  double floor_;
};

void find_runs(const Array<Candidate> &list, GuardMemory &memory) {
  memory.rest.assign(list.size(), -1.0), memory.normal.assign(3 * list.size(), 0.0);
  for (uint32_t i = 0; i < list.size();) {
    const Candidate &c = list[i];
    uint32_t end = i + 1;
    while (end < list.size() && list[end].slot_a == c.slot_a && list[end].slot_b == c.slot_b && list[end].obstacle == c.obstacle && list[end].kind == c.kind)
      ++end;
    memory.runs.push_back({i, end, 0, 0});
    i = end;
  }
}

}  // namespace

void GuardScene::find_end(GuardSide &s, uint32_t surfel) {
  s.stamp[surfel] = round;
  double *const out = &s.end[4 * size_t{surfel}];
  const Vec3 x = load3(&s.surface->x[4 * size_t{surfel}]);
  if (s.still) return store3(out, x);
  if (s.local) return store3(out, s.pose.position + rotate(s.pose.rotation, load3(&s.local[3 * size_t{surfel}])));   // its pose is at the share already
  Vec3 way;
  s.surface->each_phyxel(surfel, [&](uint32_t p, double weight) {
    const size_t at = 4 * size_t{p};
    if (s.to) way += weight * load3(&s.to[at]);
    else if (!s.impulse) way += (weight * h) * load3(&s.v[at]);
    else
      for (int k = 0; k < 3; ++k) way[k] += (weight * h) * (s.v[at + size_t(k)] + s.inv_mass[at + size_t(k)] * s.impulse[at + size_t(k)]);
  });
  if (s.to) way -= x;
  store3(out, x + share * way);
}

void guard_near(GuardScene &scene, const Array<Candidate> &list, GuardMemory &memory, Array<uint32_t> &near) {
  near.clear();
  if (memory.runs.empty()) find_runs(list, memory);
  NearPairs pairs(scene, list, memory, near);
  NearObstacle obstacles(scene, list, memory, near);
  for (GuardRun &run : memory.runs) {
    const Candidate &c = list[run.begin];
    const GuardSide &a = scene.side(c, false), &b = scene.side(c, true);
    run.travel = a.travel + b.travel;
    if (run.travel == 0) continue;   // both stay where they are
    if (c.obstacle && scene.obstacles[c.slot_b].shape != Shape::mesh) obstacles.look(run);
    else pairs.look(run);
  }
}

double guard_pairs(GuardScene &scene, const Array<Candidate> &list, std::span<const uint32_t> which, Array<GuardHit> &out) {
  out.clear();
  double least = 1;
  for (const uint32_t i : which) {
    const Candidate &c = list[i];
    if (c.obstacle && scene.obstacles[c.slot_b].shape != Shape::mesh) continue;
    const PairMotion pair(Features(scene, c));
    GuardHit hit{i, 0, 0, 0, 0, {}};
    if (pair.far_apart(scene.floor) || pair.plane_apart(scene.floor)) continue;
    const auto touch = [&](double d, double within) { return pair.touch(d, within); };
    if (!narrow::judge(touch, [&] { return pair.distance(0); }, scene.floor, scene.margin, hit)) continue;
    out.push_back(hit);
    least = std::min(least, hit.safe);
  }
  return least;
}

}  // namespace dfm
