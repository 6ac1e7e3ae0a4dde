// The straight motion of two features, and the decision of the guard. Shared by the parts of ccd/toi_guard.
#pragma once
#include <algorithm>
#include <cmath>

#include "ccd/toi.h"
#include "ccd/toi_guard.h"
#include "contact/contact_set.h"
#include "geometry/obstacle_shape.h"

namespace dfm::narrow {

constexpr double kSharp = 1e-3;  // share of the margin to which hit times are found
// share of the distance to the floor that a pair which starts within the margin may move; share of its
// distance for one below the floor
constexpr double kShare = 0.5;

// kind 0: a surfel, 1: an edge, 2: a triangle.
inline const uint32_t *corners_of(const Surface &s, int kind, const uint32_t &feature) {
  return kind == 2 ? &s.tri[3 * size_t{feature}] : kind == 1 ? &s.edge[2 * size_t{feature}] : &feature;
}

// Start positions of the corners of a pair of features, and their end positions once those are needed. The
// first `split` corners belong to the first feature.
struct Features {
  const double *start[4], *end[4];
  GuardSide *side[2];
  const uint32_t *corner[2];
  int split;

  // Sides a and b as the candidate names them.
  Features(GuardSide &a, GuardSide &b, const Candidate &c) : side{&a, &b} {
    // a vertex of the mesh and a triangle of the body
    if (c.obstacle && c.kind == 2) std::swap(side[0], side[1]);
    split = c.kind == kEdgeEdge ? 2 : 1;
    corner[0] = corners_of(*side[0]->surface, split - 1, c.feature_a);
    corner[1] = corners_of(*side[1]->surface, 3 - split, c.feature_b);
    const double *const x[2] = {side[0]->surface->x.data(), side[1]->surface->x.data()};
    for (int k = 0; k < 4; ++k) start[k] = x[k >= split] + 4 * size_t{surfel(k)};
  }
  uint32_t surfel(int k) const { return k < split ? corner[0][k] : corner[1][k - split]; }
  void find_ends(GuardScene &scene) {
    for (int k = 0; k < 4; ++k) end[k] = scene.end(*side[k >= split], surfel(k));
  }
  // On several threads: the sides do not store ends, which two threads could write.
  void find_ends(const GuardScene &scene, double own[4][4]) {
    for (int k = 0; k < 4; ++k) {
      store3(own[k], scene.end_of(*side[k >= split], surfel(k)));
      end[k] = own[k];
    }
  }
};

// use(i, j): for corners i and j that are copies of one point.
template <class F>
void each_copies(const Features &f, F &&use) {
  const OpenedSurface *const opened = f.side[0]->opened;
  if (f.side[0] != f.side[1] || !opened) return;
  for (int i = 0; i < f.split; ++i)
    for (int j = f.split; j < 4; ++j)
      if (opened->origin[f.surfel(i)] == opened->origin[f.surfel(j)]) use(i, j);
}

// An obstacle in its own frame, in which it does not move.
struct ObstacleFrame {
  ObstacleShape shape;
  GuardPose from, to;
  ObstacleFrame(const ObstacleView &view, const GuardPose &end)
      : shape(at_origin(view)), from{view.position, view.rotation}, to(end) {}
  static ObstacleView at_origin(ObstacleView view) {
    view.position = {};
    view.rotation = {};
    return view;
  }
  Vec3 at_start(Vec3 x) const { return rotate_back(from.rotation, x - from.position); }
  Vec3 at_end(Vec3 x) const { return rotate_back(to.rotation, x - to.position); }
};

// A vertex and a triangle, or two edges; round: what lies around the second feature (a sphere's or
// capsule's radius).
struct PairMotion {
  dfm_motion m[4];
  bool edges;
  double round = 0;

  PairMotion() = default;
  explicit PairMotion(const Features &f) : edges(f.split == 2) {
    for (int k = 0; k < 4; ++k) {
      std::copy_n(f.start[k], 3, m[k].p0);
      std::copy_n(f.end[k], 3, m[k].p1);
    }
  }

  ToiHit touch(double distance, double within) const {
    const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, distance + round, 0};
    return edges ? toi_edge_edge(m, m + 2, options, within)
                 : toi_point_triangle(m[0], m + 1, options, within);
  }
  double distance(double t) const {
    return (edges ? distance_edge_edge(m, m + 2, t) : distance_point_triangle(m[0], m + 1, t)) - round;
  }

  // At the start. What places round to is no distance: features that were laid on each other touch.
  double start() const {
    double most = 0;
    for (const dfm_motion &of : m)
      for (const double x : of.p0) most = std::max(most, std::fabs(x));
    const double found = distance(0);
    return found > 0x1p-50 * most ? found : 0;
  }

  // The plane of the triangle (or along both edges) at the start separates them up to the end: heights over
  // it change linearly.
  bool plane_apart(double floor) const {
    const int split = edges ? 2 : 1;
    Vec3 from[4], to[4];
    for (int k = 0; k < 4; ++k) {
      from[k] = load3(m[k].p0);
      to[k] = load3(m[k].p1);
    }
    Vec3 n =
        edges ? cross(from[1] - from[0], from[3] - from[2]) : cross(from[2] - from[1], from[3] - from[1]);
    if (dot(n, from[0] - from[split]) < 0) n = -n;
    double least = HUGE_VAL;
    for (int i = 0; i < split; ++i)
      for (int k = split; k < 4; ++k)
        least = std::min({least, dot(n, from[i] - from[k]), dot(n, to[i] - to[k])});
    const double grown = (floor + round) * (1 + 1e-9);
    return least > 0 && least * least > grown * grown * norm2(n);
  }

  // The boxes of the two swept features, grown by the floor, do not overlap: nearly all pairs end here.
  bool far_apart(double floor) const {
    const int split = edges ? 2 : 1;
    for (int i = 0; i < 3; ++i) {
      double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
      for (int k = 0; k < 4; ++k) {
        const int side = k >= split;
        low[side] = std::min({low[side], m[k].p0[i], m[k].p1[i]});
        high[side] = std::max({high[side], m[k].p0[i], m[k].p1[i]});
      }
      // rounding of the differences: a bit more than the floor
      const double grown = (floor + round) * (1 + 1e-12);
      if (low[0] - high[1] > grown || low[1] - high[0] > grown) return true;
    }
    return false;
  }
};

// touch(distance, within): when the features come as near as that; start(): their distance at the start.
// False: the guard has nothing against it.
template <class Touch, class Start>
bool judge(Touch &&touch, Start &&start, double floor, double margin, GuardHit &out) {
  ToiHit hit = touch(floor, kSharp * margin);
  if (!(hit.t <= 1)) return false;
  const double distance = start();
  double own = floor;
  if (hit.t == 0) {  // it starts at or below the floor: it may rise, or come down to half of what it has
    if (!(distance > 0)) return false;
    own = std::min(floor, kShare * distance);
    hit = touch(own, kSharp * std::min(margin, own));
    if (!(hit.t <= 1)) return false;
  }
  const double above = std::min(margin, kShare * (distance - own));
  out.t = hit.t;
  out.start = distance;
  out.safe = above > 0 ? std::min(hit.t, touch(own + above, kSharp * above).t) : 0;
  std::copy(hit.at, hit.at + 3, out.at);
  return true;
}

}  // namespace dfm::narrow
