#include "world/queries.h"

#include <algorithm>

#include "geometry/closest.h"
#include "geometry/views.h"
#include "state/obstacle.h"
#include "state/search_tree.h"
#include "state/world.h"

namespace dfm {
namespace {

// In the frame of the obstacle. From inside, the first hit is the point where the ray leaves.
double ray_box(Vec3 o, Vec3 d, Vec3 half, Vec3 *normal) {
  double near = -kFar, far = kFar;
  int axis = 0, exit = 0;
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (std::fabs(o[k]) > half[k]) return kFar;
      continue;
    }
    double t0 = (-half[k] - o[k]) / d[k], t1 = (half[k] - o[k]) / d[k];
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > near) {
      near = t0;
      axis = k;
    }
    if (t1 < far) {
      far = t1;
      exit = k;
    }
  }
  if (near > far || far < 0) return kFar;
  *normal = {};
  if (near >= 0) (*normal)[axis] = d[axis] > 0 ? -1 : 1;
  else (*normal)[exit] = d[exit] > 0 ? 1 : -1;
  return near >= 0 ? near : far;
}

// A sphere is a capsule without length.
double ray_capsule(Vec3 o, Vec3 d, double r, double half, Vec3 *normal) {
  // A capsule is convex: from outside the first crossing of its parts counts, from inside the last.
  const bool inside = norm2(o - Vec3{0, 0, std::clamp(o.z, -half, half)}) < r * r;
  double first = kFar, last = -kFar;
  auto crossing = [&](double t) {
    if (t >= 0) {
      first = std::min(first, t);
      last = std::max(last, t);
    }
  };
  const double a = d.x * d.x + d.y * d.y;
  const double b = o.x * d.x + o.y * d.y;
  const double c = o.x * o.x + o.y * o.y - r * r;
  const double disc = b * b - a * c;
  if (a > 0 && disc >= 0) {
    for (double root : {-std::sqrt(disc), std::sqrt(disc)})
      if (const double t = (-b + root) / a; std::fabs(o.z + t * d.z) <= half) crossing(t);
  }
  for (double s : {-half, half}) {
    const Vec3 m = o - Vec3{0, 0, s};
    const double along = dot(m, d), square = along * along - (norm2(m) - r * r);
    if (square < 0) continue;
    crossing(-along - std::sqrt(square));
    crossing(-along + std::sqrt(square));
  }
  const double best = !inside ? first : last >= 0 ? last : kFar;
  if (best < kFar) {
    const Vec3 p = o + best * d;
    *normal = normalized(p - Vec3{0, 0, std::clamp(p.z, -half, half)});
  }
  return best;
}

}  // namespace

Triangles search(Body &b) {
  return b.search->at(b.x_version, b.surface.tri, b.surface.nsurfel, [&](double *x) {
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      store3(x + 4 * size_t{s}, b.surface.sum(s, b.p.x.data()));
      x[4 * size_t{s} + 3] = 0;
    }
  });
}

Triangles search(Obstacle &ob) {
  const size_t n = ob.points.size() / 3;
  return ob.search->at(1, ob.triangles, n, [&](double *x) {
    for (size_t i = 0; i < n; ++i) {
      store3(x + 4 * i, load3(&ob.points[3 * i]));
      x[4 * i + 3] = 0;
    }
  });
}

Vec3 normal_of(const Triangles &m, uint32_t t) {
  const Vec3 a = m.corner(t, 0);
  return normalized(cross(m.corner(t, 1) - a, m.corner(t, 2) - a));
}

double ray_obstacle(const Obstacle &ob, Vec3 origin, Vec3 direction, Vec3 *normal) {
  const Quat q = ob.pose.rotation;
  const Vec3 o = rotate_back(q, origin - ob.pose.position), d = rotate_back(q, direction);
  double t = kFar;
  Vec3 n{0, 0, 1};
  switch (Shape(ob.def.shape)) {
    case Shape::plane:
      if (d.z != 0 && -o.z / d.z >= 0) t = -o.z / d.z;
      break;
    case Shape::sphere: t = ray_capsule(o, d, ob.def.radius, 0, &n); break;
    case Shape::box: t = ray_box(o, d, load3(ob.def.half_size), &n); break;
    case Shape::capsule: t = ray_capsule(o, d, ob.def.radius, ob.def.half_length, &n); break;
    default: break;
  }
  *normal = rotate(q, n);
  return t;
}

void surface_normals(const Body &b, double *out) {
  std::fill(out, out + size_t(3) * b.surface.nsurfel, 0.0);
  for (uint32_t t = 0; t < b.surface.ntri; ++t) {
    const Vec3 n = b.surface.area2(t, [&](uint32_t s) { return b.surface.sum(s, b.p.x.data()); });
    for (size_t k = 0; k < 3; ++k) add3(out + size_t(3) * b.surface.tri[size_t(3) * t + k], n);
  }
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s)
    store3(out + size_t(3) * s, normalized(load3(out + size_t(3) * s)));
}

TriangleNearPoint closest_on_body(Body &b, Vec3 p) {
  TriangleNearPoint near = closest_to(search(b), p, DistanceKey::squared, kFar);
  if (near.triangle != kNone) return near;
  near.triangle = 0;  // so far away that squared distances overflow and are all equal
  near.at.weight[0] = 1;
  return near;
}

}  // namespace dfm
