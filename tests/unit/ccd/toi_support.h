// What the tests of the time of impact share: queries, the reference files, distances in long double,
// random numbers.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "deform/toi.h"
#include "support.h"

namespace test {

constexpr double kNever = std::numeric_limits<double>::infinity();
inline const char *const kFinderNames[4] = {"bisection", "regula_falsi", "brent", "conservative"};

struct ToiQuery {
  bool edges = false;
  dfm_motion m[4];  // vertex, triangle; or edge, edge
  // Labels of the reference files.
  std::string id, category;
  bool hit = false;
  double toi = 0, latest = 0;  // nearest double, next above the exact time
  int multiplicity = 0;
  double miss_distance = 0;  // least distance of a miss as a share of extent
  double extent = 0;         // largest coordinate difference to p0 at t = 0
};

struct ToiResult {
  double t, at[3];
  uint32_t evaluations;
};

inline ToiResult request(const ToiQuery &q, int method, double separation = 0, double tolerance = 0,
                         int max_iterations = 0) {
  const dfm_toi_options options = {sizeof options, method, tolerance, separation, max_iterations};
  ToiResult a = {-1, {}, 0};
  const dfm_status status = q.edges ? dfm_toi_edge_edge(q.m, q.m + 2, &options, &a.t, a.at)
                                    : dfm_toi_point_triangle(q.m, q.m + 1, &options, &a.t, a.at);
  if (status != DFM_OK) a.t = std::nan("");
  a.evaluations = dfm_toi_evaluations();
  return a;
}

// Largest coordinate difference between the two features over the step: what tolerances are shares of.
inline double extent_of(const ToiQuery &q) {
  double extent = 0;
  for (int a = 0; a < (q.edges ? 2 : 1); ++a)
    for (int b = q.edges ? 2 : 1; b < 4; ++b)
      for (int i = 0; i < 3; ++i)
        extent = std::max(
            {extent, std::fabs(q.m[a].p0[i] - q.m[b].p0[i]), std::fabs(q.m[a].p1[i] - q.m[b].p1[i])});
  return extent;
}

// ---- distance at a time, in long double and by brute force: the least over the inside and all sides -------

using Real = long double;
struct Real3 { Real x, y, z; };
inline Real3 operator-(Real3 a, Real3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Real3 operator+(Real3 a, Real3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Real3 operator*(Real k, Real3 a) { return {k * a.x, k * a.y, k * a.z}; }
inline Real dot(Real3 a, Real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Real3 cross(Real3 a, Real3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Real length(Real3 a) { return std::sqrt(dot(a, a)); }
inline Real3 at(const dfm_motion &m, Real t) {
  const auto one = [&](int i) { return (1 - t) * Real(m.p0[i]) + t * Real(m.p1[i]); };
  return {one(0), one(1), one(2)};
}
// Of the origin to a segment.
inline Real to_segment(Real3 a, Real3 b) {
  const Real3 e = b - a;
  const Real ee = dot(e, e), s = ee > 0 ? std::clamp(-dot(a, e) / ee, Real(0), Real(1)) : 0;
  return std::min({length(a + s * e), length(a), length(b)});
}
inline Real distance_at(const ToiQuery &q, Real t) {
  Real3 x[4], w[4];
  for (int k = 0; k < 4; ++k) x[k] = at(q.m[k], t);
  const int n = q.edges ? 4 : 3;
  if (q.edges) {
    w[0] = x[0] - x[2];
    w[1] = x[1] - x[2];
    w[2] = x[1] - x[3];
    w[3] = x[0] - x[3];
  } else {
    for (int k = 0; k < 3; ++k) w[k] = x[0] - x[k + 1];
  }
  Real best = HUGE_VALL;
  for (int k = 0; k < n; ++k) best = std::min(best, to_segment(w[k], w[(k + 1) % n]));
  const Real3 e1 = w[1] - w[0], e2 = w[n - 1] - w[0], across = cross(e1, e2);
  const Real area2 = dot(across, across);
  if (area2 > 0) {
    Real u = 0, v = 0;  // two passes: the second takes the rounding of the first away, which slivers need
    for (int pass = 0; pass < 2; ++pass) {
      const Real3 rest = w[0] + u * e1 + v * e2;
      u += dot(cross(e2, rest), across) / area2;
      v += dot(cross(rest, e1), across) / area2;
    }
    if (u >= 0 && v >= 0 && (q.edges ? u <= 1 && v <= 1 : u + v <= 1))
      best = std::min(best, length(w[0] + u * e1 + v * e2));
  }
  return best;
}
// A bound of how fast the distance can change, per unit of t.
inline double speed_of(const ToiQuery &q) {
  double fastest = 0;
  for (int a = 0; a < (q.edges ? 2 : 1); ++a)
    for (int b = q.edges ? 2 : 1; b < 4; ++b) {
      double square = 0;
      for (int i = 0; i < 3; ++i) {
        const double d = (q.m[a].p1[i] - q.m[a].p0[i]) - (q.m[b].p1[i] - q.m[b].p0[i]);
        square += d * d;
      }
      fastest = std::max(fastest, std::sqrt(square));
    }
  return fastest;
}

// ---- reference files --------------------------------------------------------------------------------------

inline std::vector<ToiQuery> reference_queries() {
  std::vector<ToiQuery> out;
  const std::vector<std::vector<std::string>> rows = read_csv(reference_dir() + "/ccd/queries.csv");
  const auto number = [](const std::string &s) { return std::strtod(s.c_str(), nullptr); };
  for (const std::vector<std::string> &row : rows) {
    if (row[0] == "id") continue;
    ToiQuery q;
    q.id = row[0];
    q.edges = row[1] == "ee";
    q.category = row[2];
    q.hit = row[3] == "1";
    q.toi = number(row[5]);
    q.latest = number(row[6]);
    q.multiplicity = std::atoi(row[8].c_str());
    q.miss_distance = number(row[11]);
    q.extent = number(row[12]);
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < 4; ++k)
        for (int i = 0; i < 3; ++i)
          (end ? q.m[k].p1 : q.m[k].p0)[i] = number(row[13 + 12 * size_t(end) + 3 * size_t(k) + size_t(i)]);
    out.push_back(q);
  }
  return out;
}

// ---- random queries ---------------------------------------------------------------------------------------

class Random {  // splitmix64
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint64_t next() {
    uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ z >> 27) * 0x94d049bb133111ebull;
    return z ^ z >> 31;
  }
  int whole(int lo, int hi) { return lo + int(next() % uint64_t(hi - lo + 1)); }
  double real(double lo, double hi) { return lo + (hi - lo) * double(next() >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

}  // namespace test
