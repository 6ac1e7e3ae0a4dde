#include "geometry/convex_gap.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr uint32_t kRounds = 96;   // limit of the distance search; polytopes need far fewer
constexpr uint32_t kStrides = 96;  // limit of a cast: a grazing path halves the remainder each time
constexpr double kRounding = 4e-15;
constexpr double kTouch = 1e-10;  // of the largest length

// Points of the Minkowski difference a - b, with the points of a and b that form them.
struct Simplex {
  Vec3 w[4], a[4], b[4];
  double weight[4];
  uint32_t n = 0;

  void add(Vec3 on_a, Vec3 on_b) {
    a[n] = on_a;
    b[n] = on_b;
    w[n++] = on_a - on_b;
  }
  bool has(Vec3 v) const {
    for (uint32_t i = 0; i < n; ++i)
      if (w[i].x == v.x && w[i].y == v.y && w[i].z == v.z) return true;
    return false;
  }
  // Removes the points that do not contribute to the closest one.
  void keep(const double *by_weight, const uint32_t *which, uint32_t count) {
    Simplex old = *this;
    n = 0;
    for (uint32_t k = 0; k < count; ++k) {
      if (!(by_weight[k] > 0)) continue;
      w[n] = old.w[which[k]];
      a[n] = old.a[which[k]];
      b[n] = old.b[which[k]];
      weight[n++] = by_weight[k];
    }
  }
  Vec3 sum(const Vec3 *of) const {
    Vec3 s;
    for (uint32_t i = 0; i < n; ++i) s += weight[i] * of[i];
    return s;
  }
  bool reduce();  // false: the origin is inside
  bool reduce_tetrahedron();
};

bool Simplex::reduce() {
  constexpr uint32_t all[3] = {0, 1, 2};
  if (n == 1) {
    weight[0] = 1;
  } else if (n == 2) {
    const double t = closest_on_segment({}, w[0], w[1]);
    const double by[2] = {1 - t, t};
    keep(by, all, 2);
  } else if (n == 3) {
    const TrianglePoint p = closest_on_triangle({}, w[0], w[1], w[2]);
    keep(p.weight, all, 3);
  } else {
    return reduce_tetrahedron();
  }
  return true;
}

bool Simplex::reduce_tetrahedron() {
  constexpr uint32_t faces[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
  TrianglePoint best{};
  const uint32_t *face = nullptr;
  for (const auto &f : faces) {
    const Vec3 normal = cross(w[f[1]] - w[f[0]], w[f[2]] - w[f[0]]);
    const double other = dot(normal, w[f[3]] - w[f[0]]), origin = dot(normal, -w[f[0]]);
    // a flat tetrahedron has no interior
    const bool flat = std::fabs(other) <= kRounding * norm(normal) * norm(w[f[3]] - w[f[0]]);
    if (!flat && other * origin > 0) continue;
    const TrianglePoint p = closest_on_triangle({}, w[f[0]], w[f[1]], w[f[2]]);
    if (face && !(p.distance2 < best.distance2)) continue;
    best = p;
    face = f;
  }
  if (!face) return false;
  keep(best.weight, face, 3);
  return true;
}

// Largest length in the computation of a gap, relative to the position of a.
double length_of(const Convex &a, const Convex &b, Vec3 shift) {
  return a.reach() + norm(shift) + norm(b.position - a.position) + b.reach();
}

}  // namespace

Vec3 Convex::support(Vec3 d) const {
  const Vec3 local = turned ? rotate_back(rotation, d) : d;
  Vec3 best;
  if (box) {
    for (int k = 0; k < 3; ++k) best[k] = local[k] < 0 ? -half[k] : half[k];
  } else {
    const double *const x = core();
    best = load3(x);
    double most = dot(local, best);
    for (uint32_t i = 1; i < npoint; ++i) {
      const Vec3 p = load3(x + 3 * size_t{i});
      const double along = dot(local, p);
      if (!(along > most)) continue;
      most = along;
      best = p;
    }
  }
  return position + (turned ? rotate(rotation, best) : best);
}

double Convex::reach() const {
  if (box) return norm(half) + radius;
  double most = 0;
  for (uint32_t i = 0; i < npoint; ++i) most = std::max(most, norm2(load3(core() + 3 * size_t{i})));
  return std::sqrt(most) + radius;
}

Vec3 Convex::any() const {
  if (box) return position;
  const Vec3 p = load3(core());
  return position + (turned ? rotate(rotation, p) : p);
}

Convex Convex::in_frame(Vec3 origin, Quat axes) const {
  Convex out = *this;
  out.position = rotate_back(axes, position - origin);
  out.rotation = Quat{-axes.x, -axes.y, -axes.z, axes.w} * rotation;
  out.turned = true;
  return out;
}

void Convex::bounds(Vec3 &lo, Vec3 &hi) const {
  for (int k = 0; k < 3; ++k) {
    Vec3 d;
    d[k] = 1;
    hi[k] = support(d)[k] + radius;
    lo[k] = support(-d)[k] - radius;
  }
}

Convex convex_triangle(Vec3 a, Vec3 b, Vec3 c) {
  Convex out;
  out.npoint = 3;
  out.position = a;  // so that lengths are those of the triangle, wherever it lies
  store3(out.own + 3, b - a);
  store3(out.own + 6, c - a);
  return out;
}

ConvexGap convex_gap(const Convex &a, const Convex &b, Vec3 shift) {
  const double rounding = kRounding * length_of(a, b, shift);
  ConvexGap gap;
  Simplex s;
  s.add(a.any() + shift, b.any());
  s.weight[0] = 1;
  Vec3 v = s.w[0];
  for (uint32_t k = 0; k < kRounds; ++k) {
    const double size = norm(v);
    if (!(size > rounding)) return gap;
    const Vec3 on_a = a.support(-v) + shift, on_b = b.support(v), w = on_a - on_b;
    const double least = dot(v, w) / size;
    if (k == 0 || least > gap.least) {
      gap.least = least;
      gap.normal = (1 / size) * v;
    }
    gap.distance = size;
    if (size - gap.least <= rounding || s.has(w)) break;
    const Simplex before = s;
    s.add(on_a, on_b);
    if (!s.reduce()) return {};
    const Vec3 next = s.sum(s.w);
    if (!(norm2(next) < norm2(v))) {  // rounding: no further improvement is possible
      s = before;
      break;
    }
    v = next;
  }
  gap.apart = true;
  gap.on_a = s.sum(s.a);
  gap.on_b = s.sum(s.b);
  return gap;
}

ConvexHit convex_near(const Convex &a, const Convex &b, double limit) {
  const ConvexGap gap = convex_gap(a, b);
  const double distance = gap.distance - (a.radius + b.radius);
  if (!gap.apart || distance <= 0) return {true, true, 0, {}, a.position};
  return {distance <= limit, false, distance, gap.normal, gap.on_b + b.radius * gap.normal};
}

ConvexHit convex_cast(const Convex &a, const Convex &b, Vec3 unit, double limit) {
  const double radius = a.radius + b.radius;
  ConvexHit out;
  Vec3 normal = -unit, point = a.position;
  double way = 0;
  for (uint32_t k = 0; k < kStrides; ++k) {
    const ConvexGap gap = convex_gap(a, b, way * unit);
    const bool touch = !gap.apart || gap.distance - radius <= kTouch * length_of(a, b, way * unit);
    if (gap.apart) {
      normal = gap.normal;
      point = gap.on_b + b.radius * gap.normal;
    }
    if (touch && k == 0) return {true, true, 0, -unit, a.position};
    if (touch || k + 1 == kStrides) return {true, false, way, normal, point};
    const double closing = -dot(unit, gap.normal);
    if (!(closing > 0)) return out;
    way += std::max(gap.least - radius, 0.5 * kTouch * (gap.distance - radius)) / closing;
    if (!(way <= limit)) return out;
  }
  return out;
}

}  // namespace dfm
