// The straight motion of two features, and the judgement of the guard on it. Shared by the parts of narrow/toi_guard.
#pragma once
#include <algorithm>
#include <cmath>

#include "narrow/toi.h"
#include "narrow/toi_guard.h"

namespace dfm::narrow {

constexpr double kSharp = 1e-3;     // share of the margin to which hit times are found
constexpr double kShare = 0.5;      // of the way to the floor that a pair which starts within the margin may go; of its distance, one below the floor

// A vertex and a triangle, or two edges; round: what lies around the second feature (a sphere's or capsule's radius).
struct PairMotion {
  dfm_motion m[4];
  bool edges;
  double round = 0;

  ToiHit touch(double distance, double within) const {
    const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, distance + round, 0};
    return edges ? toi_edge_edge(m, m + 2, options, within) : toi_point_triangle(m[0], m + 1, options, within);
  }
  double distance(double t) const { return (edges ? distance_edge_edge(m, m + 2, t) : distance_point_triangle(m[0], m + 1, t)) - round; }

  // The plane of the triangle, or along both edges, as it stands at the start, keeps them apart up to the end: heights over it change linearly.
  bool plane_apart(double floor) const {
    const int split = edges ? 2 : 1;
    Vec3 from[4], to[4];
    for (int k = 0; k < 4; ++k) from[k] = load3(m[k].p0), to[k] = load3(m[k].p1);
    Vec3 n = edges ? cross(from[1] - from[0], from[3] - from[2]) : cross(from[2] - from[1], from[3] - from[1]);
    if (dot(n, from[0] - from[split]) < 0) n = -n;
    double least = HUGE_VAL;
    for (int i = 0; i < split; ++i)
      for (int k = split; k < 4; ++k) least = std::min({least, dot(n, from[i] - from[k]), dot(n, to[i] - to[k])});
    const double grown = (floor + round) * (1 + 1e-9);
    return least > 0 && least * least > grown * grown * norm2(n);
  }

  // The boxes of the two swept features, grown by the floor, do not meet: nearly all pairs of a list end here.
  bool far_apart(double floor) const {
    const int split = edges ? 2 : 1;
    for (int i = 0; i < 3; ++i) {
      double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
      for (int k = 0; k < 4; ++k) {
        const int side = k >= split;
        low[side] = std::min({low[side], m[k].p0[i], m[k].p1[i]});
        high[side] = std::max({high[side], m[k].p0[i], m[k].p1[i]});
      }
      const double grown = (floor + round) * (1 + 1e-12);   // rounding of the differences: a bit more than the floor
      if (low[0] - high[1] > grown || low[1] - high[0] > grown) return true;
    }
    return false;
  }
};

// touch(distance, within): when the features come as near as that; start(): their distance at the start. False: the guard has nothing against it.
template <class Touch, class Start>
bool judge(Touch &&touch, Start &&start, double floor, double margin, GuardHit &out) {
  ToiHit hit = touch(floor, kSharp * margin);
  if (!(hit.t <= 1)) return false;
  const double distance = start();
  double own = floor;
  if (hit.t == 0) {   // it starts at or below the floor: it may rise, or come down to half of what it has
    if (!(distance > 0)) return false;
    own = std::min(floor, kShare * distance);
    hit = touch(own, kSharp * std::min(margin, own));
    if (!(hit.t <= 1)) return false;
  }
  const double above = std::min(margin, kShare * (distance - own));
  out.t = hit.t, out.start = distance;
  out.safe = above > 0 ? std::min(hit.t, touch(own + above, kSharp * above).t) : 0;
  std::copy(hit.at, hit.at + 3, out.at);
  return true;
}

}  // namespace dfm::narrow
