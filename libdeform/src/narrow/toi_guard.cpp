#include "narrow/toi_guard.h"

#include <algorithm>
#include <cmath>

#include "narrow/toi.h"
#include "surfel/contact_set.h"

namespace dfm {
namespace {

constexpr double kSharp = 1e-3;     // share of the margin to which hit times are found
constexpr double kShare = 0.5;      // of the way to the floor that a pair which starts within the margin may go; of its distance, one below the floor

struct PairMotion {
  dfm_motion m[4];
  bool edges;

  ToiHit touch(double distance, double within) const {
    const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, distance, 0};
    return edges ? toi_edge_edge(m, m + 2, options, within) : toi_point_triangle(m[0], m + 1, options, within);
  }
  double distance(double t) const { return edges ? distance_edge_edge(m, m + 2, t) : distance_point_triangle(m[0], m + 1, t); }

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
      const double grown = floor * (1 + 1e-12);   // rounding of the differences: a bit more than the floor
      if (low[0] - high[1] > grown || low[1] - high[0] > grown) return true;
    }
    return false;
  }
};

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

}  // namespace

double guard_pairs(std::span<const BodyView> bodies, std::span<const double *const> end, const Array<Candidate> &candidates, double floor,
                   double margin, Array<GuardHit> &out) {
  out.clear();
  double least = 1;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].obstacle) continue;
    const PairMotion pair = motion_of(candidates[i], bodies, end);
    if (pair.far_apart(floor)) continue;
    ToiHit hit = pair.touch(floor, kSharp * margin);
    if (!(hit.t <= 1)) continue;
    const double start = pair.distance(0);
    double own = floor;
    if (hit.t == 0) {   // it starts at or below the floor: it may rise, or come down to half of what it has
      own = std::min(floor, kShare * start);
      if (start > 0) hit = pair.touch(own, kSharp * std::min(margin, own));
      if (!(hit.t <= 1)) continue;
    }
    const double above = std::min(margin, kShare * (start - own));
    const double safe = above > 0 ? std::min(hit.t, pair.touch(own + above, kSharp * above).t) : 0;
    out.push_back({static_cast<uint32_t>(i), hit.t, safe, start, {hit.at[0], hit.at[1], hit.at[2]}});
    least = std::min(least, safe);
  }
  return least;
}

}  // namespace dfm
