// Converts a query to the form that the finders use. It contains only differences between the two features,
// in an order decided by their coordinates, times a power of two. So the bits of the result do not depend on
// the caller's numbering of vertices, the origin, or the unit of length.
#include "ccd/toi.h"

#include <bit>

#include "ccd/toi_query.h"

namespace dfm {
namespace {

using toi::Query;

double power_of_two(int exponent) { return std::bit_cast<double>(uint64_t(exponent + 1023) << 52); }

// e with 2^(e-1) <= x < 2^e for normal x > 0; -1022 below.
int exponent_of(double x) { return int(std::bit_cast<uint64_t>(x) >> 52 & 0x7ff) - 1022; }

// Largest coordinate, one chain of comparisons per axis.
struct Size {
  double axis[3] = {0, 0, 0};
  void look_at(const double *p) {
    for (int i = 0; i < 3; ++i) axis[i] = std::max(axis[i], std::fabs(p[i]));
  }
  void look_at(const dfm_motion &m) {
    look_at(m.p0);
    look_at(m.p1);
  }
  double largest() const { return std::max({axis[0], axis[1], axis[2]}); }
};

double size_of(const dfm_motion *a, int na, const dfm_motion *b, int nb) {
  Size size;
  for (int k = 0; k < na; ++k) size.look_at(a[k]);
  for (int k = 0; k < nb; ++k) size.look_at(b[k]);
  return size.largest();
}

bool before(const dfm_motion &a, const dfm_motion &b) {
  for (int i = 0; i < 3; ++i)
    if (a.p0[i] != b.p0[i]) return a.p0[i] < b.p0[i];
  for (int i = 0; i < 3; ++i)
    if (a.p1[i] != b.p1[i]) return a.p1[i] < b.p1[i];
  return false;
}

// Differences of numbers above 2^1000 or below 2^-900 could overflow or lose bits: such queries are moved to
// the middle first.
constexpr double kTolerance = 1e-12;
constexpr double kHuge = 0x1p1000, kTiny = 0x1p-900;

// Two factors whose product is 2^exponent; the second is 1 unless the first alone would not be a
// normal number.
void split_power(int exponent, double out[2]) {
  const bool normal = exponent > -1000 && exponent < 1000;
  const int first = normal ? exponent : exponent / 2;
  out[0] = power_of_two(first);
  out[1] = power_of_two(exponent - first);
}
Vec3 times(const double factor[2], Vec3 v) {
  return factor[1] == 1 ? factor[0] * v : factor[1] * (factor[0] * v);
}
double times(const double factor[2], double x) { return factor[1] * (factor[0] * x); }

struct Builder {
  Query query;
  int shift = 0, exponent = 0;

  explicit Builder(double size) {  // of the coordinates
    if (size <= kHuge && (size >= kTiny || size == 0)) return;
    shift = exponent_of(size);
    split_power(-shift, query.before);
  }
  Vec3 difference(const double *a, const double *b) const {
    return shift == 0 ? load3(a) - load3(b) : times(query.before, load3(a)) - times(query.before, load3(b));
  }
  void corner(int k, const dfm_motion &a, const dfm_motion &b) {
    query.w0[k] = difference(a.p0, b.p0);
    query.w1[k] = difference(a.p1, b.p1);
    if (k == 0) {
      query.to[0] = &a;
      query.from[0] = &b;
    }
  }
  void edge(int k, Vec3 out[2], const dfm_motion &to, const dfm_motion &from) {
    out[0] = difference(to.p0, from.p0);
    out[1] = difference(to.p1, from.p1);
    query.to[k] = &to;
    query.from[k] = &from;
  }

  void finish(const dfm_toi_options &options, double margin) {
    Query &q = query;
    Size extent;
    for (int k = 0; k < q.ncorner; ++k) {
      extent.look_at(&q.w0[k].x);
      extent.look_at(&q.w1[k].x);
    }
    const double size = extent.largest();
    exponent = size > 0 ? exponent_of(size) : 0;
    split_power(-exponent, q.after);
    for (int k = 0; k < q.ncorner; ++k) {
      q.w0[k] = times(q.after, q.w0[k]);
      q.w1[k] = times(q.after, q.w1[k]);
    }
    for (Vec3 *v : {q.e1, q.e2})
      for (int end = 0; end < 2; ++end) v[end] = times(q.after, v[end]);
    // of lengths after the shift
    const auto scaled = [&](double x) { return std::min(times(q.after, x), 0x1p100); };
    q.separation = scaled(times(q.before, options.min_separation));
    const bool safe = options.method == DFM_TOI_CONSERVATIVE;
    const double share = options.tolerance > 0 ? options.tolerance : kTolerance;
    q.tolerance = margin > 0 ? scaled(times(q.before, margin)) : safe ? share * scaled(size) : share;
    q.max_iterations = options.max_iterations > 0 ? options.max_iterations : safe ? 512 : 100;
  }
  double unscaled(double x) const {
    double factor[2];
    split_power(exponent, factor);
    x = times(factor, x);
    split_power(shift, factor);
    return times(factor, x);
  }
};

toi::Root solve(const Query &query, int method) {
  return method == DFM_TOI_CONSERVATIVE ? toi::conservative(query) : toi::by_roots(query, method);
}

// Builds the query of a point and a triangle; order: permutation of the caller's vertices.
Builder build(const dfm_motion &p, const dfm_motion tri[3], int order[3]) {
  const auto sort2 = [&](int i, int j) {
    if (before(tri[order[j]], tri[order[i]])) std::swap(order[i], order[j]);
  };
  order[0] = 0;
  order[1] = 1;
  order[2] = 2;
  sort2(0, 1);
  sort2(1, 2);
  sort2(0, 1);
  Builder s(size_of(&p, 1, tri, 3));
  s.query.ncorner = 3;
  for (int k = 0; k < 3; ++k) s.corner(k, p, tri[order[k]]);
  s.edge(1, s.query.e1, tri[order[0]], tri[order[1]]);
  s.edge(2, s.query.e2, tri[order[0]], tri[order[2]]);
  return s;
}

struct EdgeOrder { bool turn_a, turn_b, swap; };
Builder build(const dfm_motion a[2], const dfm_motion b[2], EdgeOrder &order) {
  order.turn_a = before(a[1], a[0]);
  order.turn_b = before(b[1], b[0]);
  const dfm_motion *const ends[2][2] = {{&a[order.turn_a], &a[!order.turn_a]},
                                        {&b[order.turn_b], &b[!order.turn_b]}};
  const bool same_first = !before(*ends[0][0], *ends[1][0]) && !before(*ends[1][0], *ends[0][0]);
  order.swap = same_first ? before(*ends[1][1], *ends[0][1]) : before(*ends[1][0], *ends[0][0]);
  const dfm_motion *const *x = ends[order.swap], *const *y = ends[!order.swap];
  Builder s(size_of(a, 2, b, 2));
  s.query.ncorner = 4;
  s.corner(0, *x[0], *y[0]);
  s.corner(1, *x[1], *y[0]);
  s.corner(2, *x[1], *y[1]);
  s.corner(3, *x[0], *y[1]);
  s.edge(1, s.query.e1, *x[1], *x[0]);
  s.edge(2, s.query.e2, *y[0], *y[1]);
  return s;
}

double distance(Builder &s, double t) {
  s.finish({}, 0);
  return s.unscaled(std::max(0.0, toi::separate(s.query, t).lower));
}

}  // namespace

ToiHit toi_point_triangle(const dfm_motion &p, const dfm_motion tri[3], const dfm_toi_options &options,
                          double margin) {
  int order[3];
  Builder s = build(p, tri, order);
  s.finish(options, margin);
  const toi::Root root = solve(s.query, options.method);
  ToiHit hit{root.t, {}, root.evaluations};
  const double weight[3] = {1 - root.u - root.v, root.u, root.v};
  for (int k = 0; k < 3; ++k) hit.at[order[k]] = weight[k];
  return hit;
}

ToiHit toi_edge_edge(const dfm_motion a[2], const dfm_motion b[2], const dfm_toi_options &options,
                     double margin) {
  EdgeOrder order;
  Builder s = build(a, b, order);
  s.finish(options, margin);
  const toi::Root root = solve(s.query, options.method);
  const double on_a = order.swap ? root.v : root.u, on_b = order.swap ? root.u : root.v;
  return {root.t, {order.turn_a ? 1 - on_a : on_a, order.turn_b ? 1 - on_b : on_b, 0}, root.evaluations};
}

double distance_point_triangle(const dfm_motion &p, const dfm_motion tri[3], double t) {
  int order[3];
  Builder s = build(p, tri, order);
  return distance(s, t);
}

double distance_edge_edge(const dfm_motion a[2], const dfm_motion b[2], double t) {
  EdgeOrder order;
  Builder s = build(a, b, order);
  return distance(s, t);
}

}  // namespace dfm
