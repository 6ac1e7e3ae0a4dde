// Time of impact of two features with straight vertex paths, in world coordinates.
#pragma once
#include <cstdint>

#include "deform/toi.h"

namespace dfm {

struct ToiHit {
  double t;  // +infinity: never
  // weights of the triangle's vertices, or where on a and on b; meaningless for a miss
  double at[3];
  uint32_t evaluations;
};

// Distance of the two features at time t, m: a lower bound, below the true one by rounding alone.
double distance_point_triangle(const dfm_motion &p, const dfm_motion tri[3], double t);
double distance_edge_edge(const dfm_motion a[2], const dfm_motion b[2], double t);

// margin: m, how far apart beyond options.min_separation counts as touching already, in place of
// options.tolerance (conservative only); 0: tolerance.
ToiHit toi_point_triangle(const dfm_motion &p, const dfm_motion tri[3], const dfm_toi_options &options,
                          double margin = 0);
ToiHit toi_edge_edge(const dfm_motion a[2], const dfm_motion b[2], const dfm_toi_options &options,
                     double margin = 0);

}  // namespace dfm
