// dfm_world_query in one line.
#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "world.h"

namespace test {

using Where = std::array<double, 3>;

inline dfm_query_shape sphere(Where at, double radius) {
  dfm_query_shape s = dfm_query_shape_default();
  s.radius = radius;
  std::copy(at.begin(), at.end(), s.pose.position);
  return s;
}
inline dfm_query_shape point(Where at, uint32_t flags = 0) {
  dfm_query_shape s = sphere(at, 0);
  s.shape = DFM_SHAPE_POINT;
  s.flags = flags;
  return s;
}

// The nearest hits, `capacity` at most.
inline std::vector<dfm_query_hit> query(dfm_world w, const dfm_query_shape &s, const double *path = nullptr,
                                        double reach = 0, const dfm_query_filter *filter = nullptr,
                                        uint32_t capacity = 64) {
  std::vector<dfm_query_hit> out(capacity);
  dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), capacity, 0, out.data()};
  ok(dfm_world_query(w, &s, path, reach, filter, nullptr, &hits));
  out.resize(hits.n);
  return out;
}
// The nearest one; its thing is 0 and its distance infinite where there is none.
inline dfm_query_hit nearest(dfm_world w, const dfm_query_shape &s, const double *path = nullptr,
                             double reach = 0, const dfm_query_filter *filter = nullptr) {
  dfm_query_hit hit{};
  hit.distance = INFINITY;
  dfm_query_hits hits{sizeof hits, sizeof hit, 1, 0, &hit};
  ok(dfm_world_query(w, &s, path, reach, filter, nullptr, &hits));
  return hit;
}
inline dfm_query_hit ray(dfm_world w, Where from, Where along, double most) {
  return nearest(w, point(from), along.data(), most);
}

}  // namespace test
