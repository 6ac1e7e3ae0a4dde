#include "ccd/toi_guard.h"

#include <algorithm>
#include <cmath>

#include "ccd/toi_guard_motion.h"
#include "contact/contact_set.h"
#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"
#include "geometry/voxel_grid.h"
#include "narrow/parts.h"

namespace dfm {
namespace {

using narrow::Features;
using narrow::PairMotion;

// A pair that stays above this never triggers, so skipping it does not change the result, whatever is known
// from before.
double clear_of(const GuardScene &scene) {
  return ListMemory::kRounding * (scene.floor + 2 * narrow::kSharp * scene.margin);
}

// Least height of the features over each other along n.
double height(const double *const at[4], int split, Vec3 n) {
  double d[4];
  for (int k = 0; k < 4; ++k) d[k] = n.x * at[k][0] + n.y * at[k][1] + n.z * at[k][2];
  const double far = std::max(d[2], d[3]);
  return split == 2 ? std::min(d[0], d[1]) - far : d[0] - std::max(d[1], far);
}

// From the second feature to the first, as they start; moved: the same sum of these ways of the corners.
Vec3 apart(const Features &f, const Vec3 *way = nullptr, Vec3 *moved = nullptr) {
  Vec3 x[4];
  for (int k = 0; k < 4; ++k) x[k] = load3(f.start[k]);
  double w[4];
  if (f.split == 2) {
    const auto c = closest_segments(x[0], x[1], x[2], x[3]);
    const double weights[4] = {1 - c.s, c.s, c.t - 1, -c.t};
    std::copy(weights, weights + 4, w);
  } else {
    const auto c = closest_on_triangle(x[0], x[1], x[2], x[3]);
    const double weights[4] = {1, -c.weight[0], -c.weight[1], -c.weight[2]};
    std::copy(weights, weights + 4, w);
  }
  if (moved) *moved = w[0] * way[0] + w[1] * way[1] + w[2] * way[2] + w[3] * way[3];
  return w[0] * x[0] + w[1] * x[1] + w[2] * x[2] + w[3] * x[3];
}

// Share of the contact offset: a smaller rest distance is zero but for rounding, and cannot be kept.
constexpr double kMinShare = 1e-6;

// Features beside copies rest at another distance, and the floor is in proportion to it; not above 0: none.
double floor_share(const GuardScene &scene, const Features &f) {
  const GuardSide &a = *f.side[0], &b = *f.side[1];
  if (&a != &b && a.whole && a.whole == b.whole) {
    const size_t split = size_t(f.split);
    const double share = rest_of_parts(*a.surface, {f.corner[0], split}, *b.surface, {f.corner[1], 4 - split},
                                       normalized(apart(f)), scene.offset) /
                         scene.offset;
    return share > kMinShare ? share : 0;
  }
  double copies = HUGE_VAL;
  const double *const place = f.side[0]->surface->place.data();
  each_copies(f, [&](int i, int j) {
    copies = std::min(copies,
                      norm(load3(place + 4 * size_t{f.surfel(i)}) - load3(place + 4 * size_t{f.surfel(j)})));
  });
  if (!(copies < HUGE_VAL)) return 1;
  Vec3 way[4], moved;
  for (int k = 0; k < 4; ++k) way[k] = load3(f.start[k]) - load3(place + 4 * size_t{f.surfel(k)});
  const Vec3 n = normalized(apart(f, way, &moved));
  return rest_beside(dot(n, moved), copies, scene.offset) / scene.offset;
}

// Candidates per block; most end at the first comparison.
constexpr uint32_t kBlock = 192;
constexpr uint32_t kTogether = 4;  // pieces of a block: most runs are short

class Near {
 public:
  // shared: several of them look at blocks of the list at the same time
  Near(GuardScene &scene, const Array<Candidate> &list, ListMemory &memory, Array<uint32_t> &near,
       bool shared)
      : scene_(scene), list_(list), memory_(memory), near_(near), floor_(clear_of(scene)), shared_(shared) {}

  void look(const ListMemory::Run &run, uint32_t begin, uint32_t end) {
    const double now = ListMemory::limit(run.way + run.travel, floor_);
    if (scene_.closed_form(list_[run.begin])) check_obstacle(run, begin, end, now);
    else check_surfaces(run, begin, end, now);
  }

 private:
  void check_surfaces(const ListMemory::Run &run, uint32_t begin, uint32_t end, double now) {
    const double *const apart = memory_.apart.data();
    a_ = &scene_.side(list_[run.begin], false);
    b_ = &scene_.side(list_[run.begin], true);
    const PairAtRest *const own = a_ == b_ && a_->opened ? a_->pairs[run.of.kind == kEdgeEdge] : nullptr;
    for (uint32_t i = begin; i < end; ++i)
      if (!(now < apart[i]) && !(own && held(own[i - run.begin]))) look(i, run.way, now);
  }
  // The height along any direction is a lower bound of the distance, so the value for the start is kept.
  void look(uint32_t i, double way, double now) {
    Features f(*a_, *b_, list_[i]);
    double *const known = &memory_.normal[3 * size_t{i}], &bound = memory_.apart[i];
    Vec3 n = load3(known);
    if (norm2(n) > 0) {
      const double start = height(f.start, f.split, n);
      bound = std::max(bound, way + start);
      if (now < bound || stays_apart(f, n, start)) return;
    }
    const Vec3 v = apart(f);
    const double d = norm(v);
    if (d > 0) {
      n = (1 / d) * v;
      store3(known, n);
      bound = std::max(bound, way + d);
      if (now < bound || stays_apart(f, n, height(f.start, f.split, n))) return;
    }
    near_.push_back(i);
  }
  bool held(const PairAtRest &pair) const {
    for (const uint32_t c : pair.copies)
      if (c != kNone && !a_->held[c]) return false;
    return pair.beside();
  }
  bool stays_apart(Features &f, Vec3 n, double start) {
    if (!(start > floor_)) return false;
    double own[4][4];
    if (shared_) f.find_ends(scene_, own);
    else f.find_ends(scene_);
    return height(f.end, f.split, n) > floor_;
  }

  // A surface and a closed-form shape or voxels, in the frame of the obstacle.
  void check_obstacle(const ListMemory::Run &run, uint32_t begin, uint32_t end, double now) {
    const Candidate &first = list_[run.begin];
    const ObstacleView &view = scene_.obstacles[first.slot_b];
    const narrow::ObstacleFrame frame(view, scene_.poses[first.slot_b]);
    GuardSide &body = scene_.side(first, false);
    for (uint32_t i = begin; i < end; ++i) {
      if (now < memory_.apart[i]) continue;
      const bool away = view.shape == Shape::voxels ? list_[i].kind == 0 && far(frame, body, i, run.way, now)
                                                    : clear(frame, body, i, run.way);
      if (!away) near_.push_back(i);
    }
  }
  // A convex shape lies behind the plane at its point nearest to the feature's middle; a box also behind
  // each of its faces.
  bool clear(const narrow::ObstacleFrame &frame, GuardSide &body, uint32_t i, double way) {
    const Candidate &c = list_[i];
    const uint32_t *const corner = narrow::corners_of(*body.surface, c.kind, c.feature_a);
    Vec3 from[3], middle, normal, on;
    for (int k = 0; k <= c.kind; ++k) {
      from[k] = frame.at_start(load3(&body.surface->x[4 * size_t{corner[k]}]));
      middle += from[k];
    }
    const auto lowest = [&](Vec3 n, Vec3 p) {
      double low = HUGE_VAL;
      for (int k = 0; k <= c.kind; ++k) low = std::min(low, dot(n, from[k] - p));
      return low;
    };
    double start = -HUGE_VAL;
    if (c.kind > 0 && frame.shape.view().shape == Shape::box)
      for (uint32_t f = 0; f < 6; ++f) {
        const Vec3 n = frame.shape.face_normal(f), p = frame.shape.view().half_size[int(f >> 1)] * n;
        if (const double low = lowest(n, p); low > start) {
          start = low;
          normal = n;
          on = p;
        }
      }
    if (!(start > floor_)) {
      const ObstaclePoint p = frame.shape.closest((1.0 / (c.kind + 1)) * middle);
      if (const double low = lowest(p.normal, p.point); low > start) {
        start = low;
        normal = p.normal;
        on = p.point;
      }
    }
    memory_.apart[i] = way + start;
    if (!(start > floor_)) return false;
    double end = HUGE_VAL;
    for (int k = 0; k <= c.kind; ++k)
      end = std::min(end, dot(normal, frame.at_end(end_of(body, corner[k])) - on));
    return end > floor_;
  }
  Vec3 end_of(GuardSide &body, uint32_t surfel) {
    return shared_ ? scene_.end_of(body, surfel) : load3(scene_.end(body, surfel));
  }
  bool far(const narrow::ObstacleFrame &frame, GuardSide &body, uint32_t i, double way, double now) {
    const Vec3 x = frame.at_start(load3(&body.surface->x[4 * size_t{list_[i].feature_a}]));
    memory_.apart[i] = way + frame.shape.view().grid->clearance(x);
    return now < memory_.apart[i];
  }

  GuardScene &scene_;
  const Array<Candidate> &list_;
  ListMemory &memory_;
  Array<uint32_t> &near_;
  const double floor_;
  const bool shared_;
  GuardSide *a_ = nullptr, *b_ = nullptr;  // of the run, of two surfaces
};

}  // namespace

Vec3 GuardScene::end_of(const GuardSide &s, uint32_t surfel) const {
  const Vec3 x = load3(&s.surface->x[4 * size_t{surfel}]);
  if (s.still) return x;
  if (s.stamp[surfel] == round) return load3(&s.end[4 * size_t{surfel}]);
  // its pose is at the fraction already
  if (s.local) return s.pose.position + rotate(s.pose.rotation, load3(&s.local[3 * size_t{surfel}]));
  Vec3 way;
  s.surface->each_phyxel(
      surfel, [&](uint32_t p, double weight) { way += (weight * h) * load3(&s.mean[4 * size_t{p}]); });
  return x + fraction * way;
}

void GuardScene::find_end(GuardSide &s, uint32_t surfel) {
  store3(&s.end[4 * size_t{surfel}], end_of(s, surfel));
  s.stamp[surfel] = round;
}

namespace {

void near_in_blocks(GuardScene &scene, const Array<Candidate> &list, ListMemory &memory,
                    Array<uint32_t> &near, GuardBlocks &blocks, Tasks &tasks) {
  while (blocks.near.size() < blocks.ranges.size()) blocks.near.emplace_back(near.get_allocator());
  each_on(&tasks, blocks.ranges.size(), kTogether, [&](size_t k) {
    const GuardBlocks::Range &p = blocks.ranges[k];
    blocks.near[k].clear();
    Near(scene, list, memory, blocks.near[k], true).look(memory.runs[p.run], p.begin, p.end);
  });
  for (size_t k = 0; k < blocks.ranges.size(); ++k)
    near.insert(near.end(), blocks.near[k].begin(), blocks.near[k].end());
}

}  // namespace

void guard_near(GuardScene &scene, const Array<Candidate> &list, ListMemory &memory, Array<uint32_t> &near,
                GuardBlocks *blocks, Tasks *tasks) {
  near.clear();
  const bool parts = blocks && tasks && tasks->parallel() && list.size() > 2 * kBlock;
  if (parts) blocks->ranges.clear();
  Near alone(scene, list, memory, near, false);
  for (uint32_t r = 0; r < memory.runs.size(); ++r) {
    ListMemory::Run &run = memory.runs[r];
    const Candidate &c = list[run.begin];
    const GuardSide &a = scene.side(c, false), &b = scene.side(c, true);
    run.travel = &a == &b ? 2 * a.deform
                          : std::min(a.travel + b.travel, norm(a.drift - b.drift) + a.spread + b.spread);
    if (a.still && b.still) continue;
    if (!parts) alone.look(run, run.begin, run.end);
    else
      for (uint32_t from = run.begin; from < run.end; from += kBlock)
        blocks->ranges.push_back({r, from, std::min(run.end, from + kBlock)});
  }
  if (parts) near_in_blocks(scene, list, memory, near, *blocks, *tasks);
}

void guard_pairs(GuardScene &scene, const Array<Candidate> &list, std::span<const uint32_t> which,
                 Array<GuardHit> &out) {
  out.clear();
  for (const uint32_t i : which) {
    const Candidate &c = list[i];
    if (scene.closed_form(c)) continue;
    Features f(scene.side(c, false), scene.side(c, true), c);
    f.find_ends(scene);
    const PairMotion pair(f);
    GuardHit hit{i, 0, 0, 0, 0, {}};
    const double share = floor_share(scene, f), floor = share * scene.floor, margin = share * scene.margin;
    if (!(share > 0) || pair.far_apart(floor) || pair.plane_apart(floor)) continue;
    const auto touch = [&](double d, double within) { return pair.touch(d, within); };
    if (narrow::judge(touch, [&] { return pair.start(); }, floor, margin, hit)) out.push_back(hit);
  }
}

}  // namespace dfm
