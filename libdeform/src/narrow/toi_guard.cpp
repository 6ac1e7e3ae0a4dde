#include "narrow/toi_guard.h"

#include "narrow/toi_guard_motion.h"
#include "surfel/closest.h"
#include "surfel/contact_set.h"
#include "surfel/obstacle_shape.h"

namespace dfm {
namespace {

using narrow::PairMotion;

dfm_motion path(const BodyView &body, const double *end, uint32_t surfel) {
  dfm_motion m;
  for (int i = 0; i < 3; ++i) m.p0[i] = body.surface->x[4 * size_t{surfel} + size_t(i)], m.p1[i] = end[4 * size_t{surfel} + size_t(i)];
  return m;
}

PairMotion motion_of(const Candidate &c, std::span<const BodyView> bodies, std::span<const double *const> end) {
  const BodyView &a = bodies[c.slot_a], &b = bodies[c.slot_b];
  const double *const end_a = end[c.slot_a], *const end_b = end[c.slot_b];
  PairMotion pair;
  pair.edges = c.kind == kEdgeEdge;
  if (pair.edges) {
    const uint32_t *const ea = &a.surface->edge[2 * size_t{c.feature_a}], *const eb = &b.surface->edge[2 * size_t{c.feature_b}];
    for (int k = 0; k < 2; ++k) pair.m[k] = path(a, end_a, ea[k]), pair.m[2 + k] = path(b, end_b, eb[k]);
  } else {
    const uint32_t *const corner = &b.surface->tri[3 * size_t{c.feature_b}];
    pair.m[0] = path(a, end_a, c.feature_a);
    for (int k = 0; k < 3; ++k) pair.m[1 + k] = path(b, end_b, corner[k]);
  }
  return pair;
}


constexpr double kRounding = 1 + 1e-6;   // bounds hold in spite of rounding; nothing next to the margin

// Boxes around points that lie four doubles apart, half a point at a time: every listed pair passes here in every sub-step.
using Half = double __attribute__((vector_size(16)));
struct Extent {
  Half lo[2], hi[2];
  explicit Extent(const double *p) : lo{load(p), load(p + 2)}, hi{lo[0], lo[1]} {}
  static Half load(const double *p) { return *reinterpret_cast<const Half *>(p); }
  void add(const double *p) {
    for (int k = 0; k < 2; ++k) {
      const Half q = load(p + 2 * k);
      lo[k] = q < lo[k] ? q : lo[k], hi[k] = q > hi[k] ? q : hi[k];
    }
  }
  bool apart(const Extent &b, double by) const {
    const Half far = {by, by};
    const auto any = ((lo[0] - b.hi[0] > far) | (b.lo[0] - hi[0] > far)) | ((lo[1] - b.hi[1] > far) | (b.lo[1] - hi[1] > far));
    return (any[0] | any[1]) != 0;
  }
};

Extent extent_of(const Surface &s, int kind, uint32_t feature) {   // 0: a surfel, 1: an edge, 2: a triangle
  const double *const x = s.x.data();
  const uint32_t *const c = kind == 2 ? &s.tri[3 * size_t{feature}] : kind == 1 ? &s.edge[2 * size_t{feature}] : &feature;
  Extent e(x + 4 * size_t{c[0]});
  for (int k = 1; k <= kind; ++k) e.add(x + 4 * size_t{c[k]});
  return e;
}

double distance_of(const Candidate &c, const Surface &a, const Surface &b) {
  const auto at = [](const Surface &s, uint32_t surfel) { return load3(&s.x[4 * size_t{surfel}]); };
  if (c.kind == kEdgeEdge) {
    const uint32_t *const ea = &a.edge[2 * size_t{c.feature_a}], *const eb = &b.edge[2 * size_t{c.feature_b}];
    return std::sqrt(closest_segments(at(a, ea[0]), at(a, ea[1]), at(b, eb[0]), at(b, eb[1])).distance2);
  }
  const uint32_t *const t = &b.tri[3 * size_t{c.feature_b}];
  return std::sqrt(closest_on_triangle(at(a, c.feature_a), at(b, t[0]), at(b, t[1]), at(b, t[2])).distance2);
}

void near_obstacle(const Surface &a, const ObstacleView &view, double h, const Array<Candidate> &list, size_t begin, size_t end, double reach,
                   Array<uint32_t> &near) {
  const ObstacleShape shape(view);
  if (view.shape == Shape::plane) {
    if (norm2(view.spin) > 0) reach = HUGE_VAL;   // how far it sweeps depends on where one stands
    reach += h * std::fabs(dot(shape.axis(2), view.velocity));
    for (size_t i = begin; i < end; ++i)
      if (dot(shape.axis(2), load3(&a.x[4 * size_t{list[i].feature_a}]) - view.position) <= reach) near.push_back(static_cast<uint32_t>(i));
    return;
  }
  alignas(16) double lo[4] = {}, hi[4] = {};
  shape.bounds(lo, hi);
  Extent bounds(lo);
  bounds.add(hi);
  reach += h * (norm(view.velocity) + norm(view.spin) * shape.extent());
  for (size_t i = begin; i < end; ++i)
    if (!extent_of(a, list[i].kind, list[i].feature_a).apart(bounds, reach)) near.push_back(static_cast<uint32_t>(i));
}

}  // namespace

void guard_near(std::span<const BodyView> bodies, std::span<const double> travel, std::span<const double> way,
                std::span<const ObstacleView> obstacles, double h, const Array<Candidate> &candidates, double floor, Array<double> &rest,
                Array<uint32_t> &near) {
  near.clear();
  if (rest.size() != candidates.size()) rest.assign(candidates.size(), -1.0);
  for (size_t i = 0; i < candidates.size();) {
    const Candidate &c = candidates[i];
    size_t end = i + 1;
    while (end < candidates.size() && candidates[end].slot_a == c.slot_a && candidates[end].slot_b == c.slot_b &&
           candidates[end].obstacle == c.obstacle && candidates[end].kind == c.kind)
      ++end;
    const Surface &a = *bodies[c.slot_a].surface;
    if (c.obstacle) {
      near_obstacle(a, obstacles[c.slot_b], h, candidates, i, end, kRounding * floor + kRounding * travel[c.slot_a], near);
      i = end;
      continue;
    }
    const Surface &b = *bodies[c.slot_b].surface;
    const double before = way[c.slot_a] + way[c.slot_b], now = kRounding * (before + travel[c.slot_a] + travel[c.slot_b]);
    for (; i < end; ++i) {
      if (now <= rest[i]) continue;
      rest[i] = before + distance_of(candidates[i], a, b) - kRounding * floor;
      if (!(now <= rest[i])) near.push_back(static_cast<uint32_t>(i));
    }
  }
}

double guard_pairs(std::span<const BodyView> bodies, std::span<const double *const> end, const Array<Candidate> &candidates,
                   std::span<const uint32_t> which, double floor, double margin, Array<GuardHit> &out) {
  out.clear();
  double least = 1;
  for (const uint32_t i : which) {
    if (candidates[i].obstacle) continue;
    const PairMotion pair = motion_of(candidates[i], bodies, end);
    GuardHit hit{i, 0, 0, 0, 0, {}};
    if (pair.far_apart(floor) || pair.plane_apart(floor)) continue;
    const auto touch = [&](double d, double within) { return pair.touch(d, within); };
    if (!narrow::judge(touch, [&] { return pair.distance(0); }, floor, margin, hit)) continue;
    out.push_back(hit);
    least = std::min(least, hit.safe);
  }
  return least;
}

}  // namespace dfm
