#include "world/queries.h"

#include <algorithm>
#include <limits>

#include "surfel/closest.h"
#include "surfel/views.h"

namespace dfm {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// Moeller and Trumbore 1997: distance along the ray, or infinity. Both sides count.
double ray_triangle(Vec3 o, Vec3 d, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 e1 = b - a, e2 = c - a, p = cross(d, e2);
  const double det = dot(e1, p);
  if (det == 0) return kFar;
  const Vec3 s = o - a, q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(d, q) / det, t = dot(e2, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 ? t : kFar;
}

double ray_sphere(Vec3 o, Vec3 d, Vec3 center, double r) {
  const Vec3 m = o - center;
  const double b = dot(m, d), c = norm2(m) - r * r, disc = b * b - c;
  if (disc < 0) return kFar;
  const double root = std::sqrt(disc), t = -b - root;
  return t >= 0 ? t : c < 0 ? -b + root : kFar;
}

// In the obstacle's own frame. From inside, the surface met first is the one that the ray leaves by.
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

double ray_capsule(Vec3 o, Vec3 d, double r, double half, Vec3 *normal) {
  // A capsule is convex: from outside the first of all crossings of its parts counts, from inside the last.
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

// Voxels answer as the surface that they are made from.
double ray_triangles(const Obstacle &ob, Vec3 o, Vec3 d, Vec3 *normal) {
  double best = kFar;
  for (size_t i = 0; i < ob.triangles.size(); i += 3) {
    const auto x = [&](size_t k) { return load3(&ob.points[size_t(3) * ob.triangles[i + k]]); };
    const double t = ray_triangle(o, d, x(0), x(1), x(2));
    if (t < best) {
      best = t;
      *normal = normalized(cross(x(1) - x(0), x(2) - x(0)));
    }
  }
  return best;
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
    case Shape::sphere:
      t = ray_sphere(o, d, {}, ob.def.radius);
      if (t < kFar) n = normalized(o + t * d);
      break;
    case Shape::box: t = ray_box(o, d, load3(ob.def.half_size), &n); break;
    case Shape::capsule: t = ray_capsule(o, d, ob.def.radius, ob.def.half_length, &n); break;
    case Shape::mesh:
    case Shape::voxels: t = ray_triangles(ob, o, d, &n); break;
    case Shape::none: break;
  }
  *normal = rotate(q, n);
  return t;
}

Vec3 triangle_normal(const Body &b, uint32_t t) {
  const uint32_t *const c = &b.surface.tri[size_t(3) * t];
  const Vec3 a = surfel_vector(b, b.p.x, c[0]);
  return cross(surfel_vector(b, b.p.x, c[1]) - a, surfel_vector(b, b.p.x, c[2]) - a);
}

dfm_ray_hit nothing() {
  dfm_ray_hit hit{};
  hit.distance = kFar;
  hit.triangle = kNone;
  return hit;
}

}  // namespace

Vec3 surfel_vector(const Body &b, const Array<double> &column, uint32_t s) {
  if (b.surface.identity()) return load3(&column[size_t(b.surface.point[s]) * kStride]);
  Vec3 sum;
  b.surface.each_phyxel(s, [&](uint32_t i, double w) { sum += w * load3(&column[size_t(i) * kStride]); });
  return sum;
}

void surface_normals(const Body &b, double *out) {
  std::fill(out, out + size_t(3) * b.surface.nsurfel, 0.0);
  for (uint32_t t = 0; t < b.surface.ntri; ++t) {
    const Vec3 n = triangle_normal(b, t);
    for (int k = 0; k < 3; ++k) {
      double *const to = out + size_t(3) * b.surface.tri[size_t(3) * t + size_t(k)];
      store3(to, load3(to) + n);
    }
  }
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s)
    store3(out + size_t(3) * s, normalized(load3(out + size_t(3) * s)));
}

dfm_ray_hit cast_ray(World &w, Vec3 o, Vec3 d, double max_distance) {
  dfm_ray_hit hit = nothing();
  for (auto &b : w.bodies)
    for (uint32_t t = 0; t < b->surface.ntri; ++t) {
      const uint32_t *const c = &b->surface.tri[size_t(3) * t];
      const double at = ray_triangle(o, d, surfel_vector(*b, b->p.x, c[0]), surfel_vector(*b, b->p.x, c[1]),
                                     surfel_vector(*b, b->p.x, c[2]));
      if (at <= max_distance && at < hit.distance) {
        hit.distance = at;
        hit.body = b->handle;
        hit.triangle = t;
        store3(hit.normal, normalized(triangle_normal(*b, t)));
      }
    }
  for (auto &ob : w.obstacles) {
    Vec3 n;
    const double at = ray_obstacle(*ob, o, d, &n);
    if (at <= max_distance && at < hit.distance) {
      hit.distance = at;
      hit.body = 0;
      hit.obstacle = ob->handle;
      hit.triangle = kNone;
      store3(hit.normal, n);
    }
  }
  if (hit.distance < kFar) store3(hit.point, o + hit.distance * d);
  return hit;
}

dfm_ray_hit closest_surface(World &w, Vec3 p, double max_distance) {
  dfm_ray_hit hit = nothing();
  for (auto &b : w.bodies)
    for (uint32_t t = 0; t < b->surface.ntri; ++t) {
      const uint32_t *const c = &b->surface.tri[size_t(3) * t];
      const TrianglePoint q =
          closest_on_triangle(p, surfel_vector(*b, b->p.x, c[0]), surfel_vector(*b, b->p.x, c[1]),
                              surfel_vector(*b, b->p.x, c[2]));
      const double d = std::sqrt(q.distance2);
      if (d <= max_distance && d < hit.distance) {
        hit.distance = d;
        hit.body = b->handle;
        hit.triangle = t;
        store3(hit.point, q.point);
        store3(hit.normal, normalized(triangle_normal(*b, t)));
      }
    }
  return hit;
}

}  // namespace dfm
