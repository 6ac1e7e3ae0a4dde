#include "world/find.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "body/obstacle_mesh.h"
#include "geometry/convex_search.h"
#include "geometry/obstacle_shape.h"
#include "state/obstacle.h"
#include "world/queries.h"

namespace dfm {
namespace {

dfm_query_hit nothing() {
  dfm_query_hit hit{};
  hit.size = sizeof hit;
  hit.triangle = kNone;
  hit.distance = kFar;
  return hit;
}

// Where a ray, a point or a shape on its way meets a thing.
struct Met {
  double distance = kFar;
  uint32_t triangle = kNone;
  Vec3 point, normal;
};

dfm_query_hit hit_of(const Thing &thing, const Met &met) {
  dfm_query_hit hit = nothing();
  hit.thing = thing.handle();
  hit.triangle = met.triangle;
  hit.distance = met.distance;
  store3(hit.point, met.point);
  store3(hit.normal, met.normal);
  return hit;
}

Shape shape_of(const Obstacle &o) { return Shape(o.def.shape); }
bool of_triangles(const Obstacle &o) { return shape_of(o) == Shape::mesh || shape_of(o) == Shape::voxels; }

Vec3 plane_normal(const Obstacle &o) { return rotate(o.pose.rotation, {0, 0, 1}); }
// m, depth of the deepest point of a shape, and that point
double above_plane(const Convex &shape, const Obstacle &o, Vec3 *lowest = nullptr) {
  const Vec3 n = plane_normal(o), p = shape.support(-n);
  if (lowest) *lowest = p - shape.radius * n;
  return dot(n, p - o.pose.position) - shape.radius;
}

bool closed(const Surface &s) {
  return std::find(s.edge_tri.begin(), s.edge_tri.end(), kNone) == s.edge_tri.end();
}
bool closed(const Thing &thing) {
  if (thing.body) return closed(thing.body->surface);
  return thing.obstacle->grid || (thing.obstacle->mesh && thing.obstacle->mesh->closed);
}

// The triangles of a thing, and a shape in their frame.
Triangles triangles_of(const Thing &thing) {
  return thing.body ? search(*thing.body) : search(*thing.obstacle);
}
Convex seen_by(const Thing &thing, const Convex &shape) {
  return thing.body ? shape : shape.in_frame(thing.obstacle->pose.position, thing.obstacle->pose.rotation);
}
Vec3 seen_by(const Thing &thing, Vec3 p) {
  return thing.body ? p : rotate_back(thing.obstacle->pose.rotation, p - thing.obstacle->pose.position);
}
Vec3 turned_by(const Thing &thing, Vec3 d) {
  return thing.body ? d : rotate_back(thing.obstacle->pose.rotation, d);
}
Vec3 turned_back(const Thing &thing, Vec3 d) {
  return thing.body ? d : rotate(thing.obstacle->pose.rotation, d);
}
Vec3 back(const Thing &thing, Vec3 p) { return thing.body ? p : place(thing.obstacle->pose, p); }

// Whether a closed surface encloses `p`, in the frame of the triangles.
bool encloses(const Thing &thing, const Triangles &m, Vec3 p) {
  if (m.tree.empty()) return false;
  const Box &root = m.tree.root();
  for (int k = 0; k < 3; ++k)
    if (!(p[k] >= root.lo[k] && p[k] <= root.hi[k])) return false;
  return closed(thing) && winding_by_ray(m, p) > 0;
}

bool has_triangles(const Thing &thing) { return thing.body || of_triangles(*thing.obstacle); }

// A thing with triangles, and one whose triangles are tested one by one.
bool surfaces_overlap(const Thing &a, const Thing &b) {
  const Triangles of_a = triangles_of(a), of_b = triangles_of(b);
  if (of_a.tree.empty() || of_b.tree.empty()) return false;
  const auto moved = [&](Vec3 p) { return seen_by(b, back(a, p)); };
  const Box &root = of_b.tree.root();
  const uint32_t n = static_cast<uint32_t>(of_a.corners.size() / 3);
  for (uint32_t t = 0; t < n; ++t) {
    const Vec3 x[3] = {moved(of_a.corner(t, 0)), moved(of_a.corner(t, 1)), moved(of_a.corner(t, 2))};
    bool near = true;
    for (int k = 0; near && k < 3; ++k)
      near = std::max({x[0][k], x[1][k], x[2][k]}) >= root.lo[k] &&
             std::min({x[0][k], x[1][k], x[2][k]}) <= root.hi[k];
    if (near && touches_any(of_b, convex_triangle(x[0], x[1], x[2]))) return true;
  }
  return encloses(b, of_b, moved(of_a.corner(0, 0))) ||
         encloses(a, of_a, seen_by(a, back(b, of_b.corner(0, 0))));
}

// A plane and another shape.
bool plane_overlaps(const Obstacle &plane, const Thing &thing) {
  if (!has_triangles(thing))
    return is_convex(*thing.obstacle) && above_plane(convex_of(*thing.obstacle), plane) <= 0;
  const Triangles m = triangles_of(thing);
  const Vec3 n = turned_by(thing, plane_normal(plane)), at = seen_by(thing, plane.pose.position);
  return !m.tree.empty() && !walk(
                                m.tree,
                                [&](const Box &b) {
                                  double least = 0;
                                  for (int k = 0; k < 3; ++k)
                                    least += n[k] * ((n[k] > 0 ? b.lo[k] : b.hi[k]) - at[k]);
                                  return least <= 1e-9 * (norm(at) + norm(load3(b.lo)) + norm(load3(b.hi)));
                                },
                                [&](uint32_t place) {
                                  const uint32_t t = m.tree.triangles()[place];
                                  for (uint32_t k = 0; k < 3; ++k)
                                    if (dot(n, m.corner(t, k) - at) <= 0) return false;
                                  return true;
                                });
}

}  // namespace

bool ThingFilter::passes(const Thing &thing) const {
  if (!given_) return !thing.sensor();
  const uint32_t kind = thing.body              ? DFM_QUERY_BODIES
                        : thing.obstacle->rigid ? DFM_QUERY_RIGIDS
                                                : DFM_QUERY_OBSTACLES;
  if (!(given_->what & kind) || (thing.sensor() && !(given_->what & DFM_QUERY_SENSORS))) return false;
  if (!(given_->category & thing.collides_with()) || !(thing.category() & given_->collides_with))
    return false;
  return !given_->accept || given_->accept(given_->user, thing.handle());
}

bool is_convex(const Obstacle &o) {
  return shape_of(o) == Shape::sphere || shape_of(o) == Shape::box || shape_of(o) == Shape::capsule;
}

Convex convex_of(const Obstacle &o) {
  Convex c;
  c.position = o.pose.position;
  c.rotation = o.pose.rotation;
  c.turned = true;
  if (shape_of(o) == Shape::box) {
    c.box = true;
    c.half = load3(o.def.half_size);
    return c;
  }
  c.radius = o.def.radius;
  if (shape_of(o) == Shape::capsule) {
    c.npoint = 2;
    c.own[2] = -o.def.half_length;
    c.own[5] = o.def.half_length;
  }
  return c;
}

bool overlaps(const Convex &shape, const Thing &thing) {
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const Convex seen = seen_by(thing, shape);
    return touches_any(m, seen) || encloses(thing, m, seen.any());
  }
  if (shape_of(*thing.obstacle) == Shape::plane) return above_plane(shape, *thing.obstacle) <= 0;
  return is_convex(*thing.obstacle) && convex_touch(shape, convex_of(*thing.obstacle));
}

bool overlap(const Thing &a, const Thing &b) {
  if (b.obstacle && shape_of(*b.obstacle) == Shape::plane) return overlap(b, a);
  if (a.obstacle && shape_of(*a.obstacle) == Shape::plane) {
    if (b.obstacle && shape_of(*b.obstacle) == Shape::plane) return false;
    return plane_overlaps(*a.obstacle, b);
  }
  if (a.obstacle && is_convex(*a.obstacle)) return overlaps(convex_of(*a.obstacle), b);
  if (b.obstacle && is_convex(*b.obstacle)) return overlaps(convex_of(*b.obstacle), a);
  if (!has_triangles(a) || !has_triangles(b)) return false;  // a rigid body without shapes
  // the one with fewer triangles is tested one by one
  return triangles_of(a).corners.size() <= triangles_of(b).corners.size() ? surfaces_overlap(a, b)
                                                                          : surfaces_overlap(b, a);
}

double distance_from(Obstacle &o, Vec3 p, double limit) {
  if (!of_triangles(o)) return o.standing().closest(p).distance;
  const Vec3 local = rotate_back(o.pose.rotation, p - o.pose.position);
  return closest_to(search(o), local, DistanceKey::root, limit).key;
}

namespace {

Met first_of(const Thing &thing, Vec3 o, Vec3 d, double limit, SearchCount *count = nullptr) {
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const TriangleOnRay on = first_on_ray(m, seen_by(thing, o), turned_by(thing, d), limit, count);
    if (on.triangle == kNone) return {};
    return {on.distance, on.triangle, o + on.distance * d, turned_back(thing, normal_of(m, on.triangle))};
  }
  Vec3 n;
  const double at = ray_obstacle(*thing.obstacle, o, d, &n);
  return at <= limit && at < kFar ? Met{at, kNone, o + at * d, n} : Met{};
}

Met closest_of(const Thing &thing, Vec3 p, double limit, SearchCount *count = nullptr) {
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const TriangleNearPoint near = closest_to(m, seen_by(thing, p), DistanceKey::root, limit, count);
    if (near.triangle == kNone) return {};
    return {near.key, near.triangle, back(thing, near.at.point),
            turned_back(thing, normal_of(m, near.triangle))};
  }
  if (shape_of(*thing.obstacle) == Shape::none) return {};
  const ObstaclePoint near = thing.obstacle->standing().closest(p);
  const double distance = std::fabs(near.distance);
  return distance <= limit ? Met{distance, kNone, near.point, near.normal} : Met{};
}

// meet(thing, limit): where it meets a thing within the limit.
struct Nearest {
  Thing thing;
  Met met;
  template <class Meet>
  Nearest(World &w, const ThingFilter &filter, double limit, const Meet &meet) {
    each_thing(w, filter, [&](const Thing &other) {
      const Met found = meet(other, std::min(limit, met.distance));
      if (!(found.distance < met.distance)) return true;
      thing = other;
      met = found;
      return true;
    });
  }
  dfm_query_hit hit() const { return met.distance < kFar ? hit_of(thing, met) : nothing(); }
  dfm_ray_hit ray_hit() const {  // of a body's triangles alone
    dfm_ray_hit hit{};
    hit.triangle = thing.body ? met.triangle : kNone;
    hit.distance = met.distance;
    if (thing.body) hit.body = thing.handle();
    else if (thing.obstacle) hit.obstacle = thing.handle();
    store3(hit.point, met.point);
    store3(hit.normal, met.normal);
    return hit;
  }
};

}  // namespace

dfm_query_hit find_first_on_ray(World &w, const ThingFilter &filter, Vec3 o, Vec3 d, double limit) {
  const auto meet = [&](const Thing &thing, double most) { return first_of(thing, o, d, most); };
  return Nearest(w, filter, limit, meet).hit();
}

dfm_query_hit find_closest(World &w, const ThingFilter &filter, Vec3 p, double limit) {
  const auto meet = [&](const Thing &thing, double most) { return closest_of(thing, p, most); };
  return Nearest(w, filter, limit, meet).hit();
}

dfm_ray_hit cast_ray(World &w, Vec3 o, Vec3 d, double max_distance, SearchCount *count) {
  const auto meet = [&](const Thing &thing, double most) { return first_of(thing, o, d, most, count); };
  return Nearest(w, ThingFilter(nullptr), max_distance, meet).ray_hit();
}

dfm_ray_hit closest_surface(World &w, Vec3 p, double max_distance, SearchCount *count) {
  const auto meet = [&](const Thing &thing, double most) {
    return thing.body ? closest_of(thing, p, most, count) : Met{};
  };
  return Nearest(w, ThingFilter(nullptr), max_distance, meet).ray_hit();
}

dfm_query_hit find_first_on_path(World &w, const ThingFilter &filter, const Convex &shape, Vec3 path) {
  dfm_query_hit hit = nothing();
  const double length = norm(path);
  const Vec3 unit = normalized(path);
  const auto take = [&](const Thing &thing, const Met &met, bool inside) {
    if (!(met.distance < hit.distance)) return;
    hit = hit_of(thing, met);
    if (inside) hit.flags = DFM_QUERY_INSIDE;
  };
  const Met start{0, kNone, shape.position, -unit};
  each_thing(w, filter, [&](const Thing &thing) {
    const double most = std::min(length, hit.distance);
    if (has_triangles(thing)) {
      const Triangles m = triangles_of(thing);
      const Convex seen = seen_by(thing, shape);
      const auto [found, triangle] = first_on_path(m, seen, turned_by(thing, unit), most);
      if (found.hit)
        take(thing, {found.way, triangle, back(thing, found.point), turned_back(thing, found.normal)},
             found.inside);
      // a shape inside a closed surface may hit it from inside later
      if (hit.distance > 0 && encloses(thing, m, seen.any())) take(thing, start, true);
      return hit.distance > 0;
    }
    const Obstacle &o = *thing.obstacle;
    if (shape_of(o) == Shape::plane) {
      Vec3 lowest;
      const double above = above_plane(shape, o, &lowest), closing = -dot(unit, plane_normal(o));
      const double way = closing > 0 ? above / closing : kFar;
      if (above <= 0) take(thing, start, true);
      else if (way <= most) take(thing, {way, kNone, lowest + way * unit, plane_normal(o)}, false);
    } else if (is_convex(o)) {
      const ConvexHit found = convex_cast(shape, convex_of(o), unit, most);
      if (found.hit) take(thing, {found.way, kNone, found.point, found.normal}, found.inside);
    }
    return hit.distance > 0;
  });
  return hit;
}

bool HitRows::before(const dfm_query_hit &hit, uint32_t row) const {
  dfm_query_hit other;
  std::memcpy(&other, at_ + size_t{step_} * row, sizeof other);
  if (hit.distance != other.distance) return hit.distance < other.distance;
  // of equal hits the first one offered, except for triangles of one thing
  return hit.thing == other.thing && hit.triangle < other.triangle;
}

void HitRows::offer(const dfm_query_hit &hit) {
  const uint32_t held = std::min(count_++, capacity_);
  if (held == capacity_ && (capacity_ == 0 || !before(hit, held - 1))) return;
  uint32_t at = held == capacity_ ? held - 1 : held;
  const uint32_t end = at;
  while (at > 0 && before(hit, at - 1)) --at;
  unsigned char *const row = at_ + size_t{step_} * at;
  std::memmove(row + step_, row, size_t{step_} * (end - at));
  std::memcpy(row, &hit, sizeof hit);
  std::memset(row + sizeof hit, 0, step_ - sizeof hit);
}

void find_all_on_ray(World &w, const ThingFilter &filter, Vec3 origin, Vec3 unit, double limit,
                     HitRows &rows) {
  each_thing(w, filter, [&](const Thing &thing) {
    if (has_triangles(thing)) {
      const Triangles m = triangles_of(thing);
      all_on_ray(m, seen_by(thing, origin), turned_by(thing, unit), limit, [&](double at, uint32_t t) {
        rows.offer(hit_of(thing, {at, t, origin + at * unit, turned_back(thing, normal_of(m, t))}));
      });
      return true;
    }
    const Obstacle &o = *thing.obstacle;
    Vec3 n;
    const double first = ray_obstacle(o, origin, unit, &n);
    if (!(first < kFar)) return true;
    if (first <= limit) rows.offer(hit_of(thing, {first, kNone, origin + first * unit, n}));
    // The exit point is the entry point of the reversed line.
    if (!is_convex(o) || !(dot(n, unit) < 0)) return true;
    const double beyond = first + 2 * convex_of(o).reach() + 1;
    const double last = beyond - ray_obstacle(o, origin + beyond * unit, -unit, &n);
    if (last >= first && last <= limit) rows.offer(hit_of(thing, {last, kNone, origin + last * unit, n}));
    return true;
  });
}

}  // namespace dfm
