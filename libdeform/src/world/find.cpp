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

// Where a ray, a point or a shape on its way meets a thing.
struct Met {
  double distance = kFar;
  uint32_t triangle = kNone;
  Vec3 point, normal;
  bool inside = false;
};

dfm_query_hit hit_of(const Thing &thing, const Met &met) {
  dfm_query_hit hit{};
  hit.size = sizeof hit;
  hit.flags = met.inside ? DFM_QUERY_INSIDE : 0;
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
    if (near && first_met(of_b, convex_triangle(x[0], x[1], x[2]), {}, 0).hit.hit) return true;
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

// f(met) for what it meets up to the limit, and perhaps beyond.
template <class F>
void meet_ray(const Thing &thing, const ThingQuery &q, const double &limit, F &&f) {
  const Vec3 o = q.shape.position, d = q.way.unit;
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const Vec3 from = seen_by(thing, o), along = turned_by(thing, d);
    const auto on = [&](double at, uint32_t t) {
      f(Met{at, t, o + at * d, turned_back(thing, normal_of(m, t))});
    };
    if (q.each) return all_on_ray(m, from, along, limit, on);
    const TriangleOnRay first = first_on_ray(m, from, along, limit, q.count);
    if (first.triangle != kNone) on(first.distance, first.triangle);
    return;
  }
  const Obstacle &obstacle = *thing.obstacle;
  Vec3 n;
  const double first = ray_obstacle(obstacle, o, d, &n);
  if (!(first < kFar)) return;
  f(Met{first, kNone, o + first * d, n});
  // The exit point is the entry point of the reversed line.
  if (!q.each || !is_convex(obstacle) || !(dot(n, d) < 0)) return;
  const double beyond = first + 2 * convex_of(obstacle).reach() + 1;
  const double last = beyond - ray_obstacle(obstacle, o + beyond * d, -d, &n);
  if (last >= first) f(Met{last, kNone, o + last * d, n});
}

template <class F>
void meet_point(const Thing &thing, const ThingQuery &q, const double &limit, F &&f) {
  const Vec3 p = q.shape.position;
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const Vec3 seen = seen_by(thing, p);
    const auto on = [&](double distance, uint32_t t, const TrianglePoint &at) {
      f(Met{distance, t, back(thing, at.point), turned_back(thing, normal_of(m, t))});
    };
    if (q.each) {
      if (m.tree.empty()) return;
      const ShapeSearch search(m, seen_by(thing, q.shape), {});
      return near_triangles(
          m.tree, [&](const Box &b) { return search.first(b) <= search.key(limit); },
          [&](uint32_t t) {
            const TrianglePoint at =
                closest_on_triangle(seen, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
            on(std::sqrt(at.distance2), t, at);
          });
    }
    const TriangleNearPoint near = closest_to(m, seen, DistanceKey::root, limit, q.count);
    if (near.triangle != kNone) on(near.key, near.triangle, near.at);
  } else if (shape_of(*thing.obstacle) != Shape::none) {
    const ObstaclePoint near = thing.obstacle->standing().closest(p);
    f(Met{std::fabs(near.distance), kNone, near.point, near.normal});
  }
}

template <class F>
void meet_shape(const Thing &thing, const ThingQuery &q, const double &limit, F &&f) {
  const Vec3 unit = q.way.unit;
  const Met start{0, kNone, q.shape.position, q.way.moves ? -unit : Vec3{}, true};
  if (has_triangles(thing)) {
    const Triangles m = triangles_of(thing);
    const Convex seen = seen_by(thing, q.shape);
    const ShapeWay way{q.way.moves, turned_by(thing, unit)};
    const auto on = [&](const ConvexHit &hit, uint32_t t) {
      f(Met{hit.way, t, back(thing, hit.point), turned_back(thing, hit.normal), hit.inside});
    };
    // a shape inside a closed surface may hit it from inside later
    if (q.each) {
      each_met(m, seen, way, limit, on);
      if (limit >= 0 && encloses(thing, m, seen.any())) f(start);
      return;
    }
    const TriangleMet first = first_met(m, seen, way, limit);
    if (!(first.hit.hit && first.hit.way == 0) && encloses(thing, m, seen.any())) f(start);
    else if (first.hit.hit) on(first.hit, way.moves || !first.hit.inside ? first.triangle : kNone);
    return;
  }
  const Obstacle &obstacle = *thing.obstacle;
  if (shape_of(obstacle) == Shape::plane) {
    Vec3 lowest;
    const Vec3 n = plane_normal(obstacle);
    const double above = above_plane(q.shape, obstacle, &lowest), closing = -dot(unit, n);
    const double way = !q.way.moves ? above : closing > 0 ? above / closing : kFar;
    if (above <= 0) f(start);
    else f(Met{way, kNone, lowest + (q.way.moves ? way * unit : -above * n), n});
  } else if (is_convex(obstacle)) {
    const ConvexHit hit = convex_meet(q.shape, convex_of(obstacle), q.way, limit);
    if (hit.hit) f(Met{hit.way, kNone, hit.point, hit.normal, hit.inside});
  }
}

template <class F>
void meet(const Thing &thing, const ThingQuery &q, const double &limit, F &&f) {
  if (!q.point) meet_shape(thing, q, limit, f);
  else if (q.way.moves) meet_ray(thing, q, limit, f);
  else meet_point(thing, q, limit, f);
}

// The rows of a dfm_query_hits.
class KeptHits {
 public:
  explicit KeptHits(dfm_query_hits &hits)
      : hits_(hits), known_(std::min<size_t>(hits.row_size, sizeof(dfm_query_hit))) {}
  dfm_query_hit at(uint32_t i) const {
    dfm_query_hit hit{};
    std::memcpy(&hit, row(i), known_);
    return hit;
  }
  // Puts a hit at its place among the first `kept`; the last one falls out of a full list.
  void add(uint32_t kept, dfm_query_hit hit) {
    // of equal hits the first one offered, except for triangles of one thing
    const auto before = [&](const dfm_query_hit &other) {
      if (hit.distance != other.distance) return hit.distance < other.distance;
      return hit.thing == other.thing && hit.triangle < other.triangle;
    };
    const bool full = kept == hits_.capacity;
    if (full && (kept == 0 || !before(at(kept - 1)))) return;
    const uint32_t end = full ? kept - 1 : kept;
    uint32_t place = 0;
    for (uint32_t above = end; place < above;) {
      const uint32_t middle = place + (above - place) / 2;
      if (before(at(middle))) above = middle;
      else place = middle + 1;
    }
    const size_t step = hits_.row_size;
    std::memmove(row(place + 1), row(place), step * (end - place));
    hit.size = static_cast<uint32_t>(known_);
    std::memcpy(row(place), &hit, known_);
    std::memset(row(place) + known_, 0, step - known_);
  }

 private:
  unsigned char *row(uint32_t i) const {
    return reinterpret_cast<unsigned char *>(hits_.out) + size_t{hits_.row_size} * i;
  }
  dfm_query_hits &hits_;
  const size_t known_;
};

bool overlaps(const Convex &shape, const Thing &thing) {
  ThingQuery q;
  q.shape = shape;
  bool any = false;
  meet_shape(thing, q, 0, [&](const Met &met) { any = any || met.distance <= 0; });
  return any;
}

}  // namespace

bool ThingFilter::passes(const Thing &thing) const {
  if (!given_) return !thing.sensor();
  const uint32_t kind = thing.body              ? DFM_QUERY_BODIES
                        : thing.obstacle->rigid ? DFM_QUERY_RIGIDS
                                                : DFM_QUERY_OBSTACLES;
  if (given_->only) return given_->only == thing.handle();
  if (!(given_->what & kind) || (thing.sensor() && !(given_->what & DFM_QUERY_SENSORS))) return false;
  if (!(given_->category & thing.collides_with()) || !(thing.category() & given_->collides_with))
    return false;
  return !given_->accept || given_->accept(given_->user, thing.handle());
}

bool overlap(const Thing &a, const Thing &b) {
  const auto is_plane = [](const Thing &t) { return t.obstacle && shape_of(*t.obstacle) == Shape::plane; };
  if (is_plane(a)) return !is_plane(b) && plane_overlaps(*a.obstacle, b);
  if (is_plane(b)) return plane_overlaps(*b.obstacle, a);
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

void find(World &w, const ThingFilter &filter, const ThingQuery &query, dfm_query_hit_fn hit, void *user) {
  double limit = query.limit;
  each_thing(w, filter, [&](const Thing &thing) {
    meet(thing, query, limit, [&](const Met &met) {
      if (!(met.distance <= limit) || !(met.distance < kFar)) return;
      const dfm_query_hit found = hit_of(thing, met);
      limit = std::min(limit, hit(user, &found));
    });
    return limit >= 0;
  });
}

double keep_nearest(void *user, const dfm_query_hit *hit) {
  dfm_query_hits &hits = *static_cast<dfm_query_hits *>(user);
  KeptHits kept(hits);
  kept.add(hits.n, *hit);
  if (hits.n < hits.capacity) ++hits.n;
  return hits.n == hits.capacity ? kept.at(hits.n - 1).distance : kFar;
}

double keep_and_count(void *user, const dfm_query_hit *hit) {
  dfm_query_hits &hits = *static_cast<dfm_query_hits *>(user);
  KeptHits(hits).add(std::min(hits.n, hits.capacity), *hit);
  ++hits.n;
  return kFar;
}

}  // namespace dfm
