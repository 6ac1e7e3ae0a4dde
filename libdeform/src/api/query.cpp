#include "deform/query.h"

#include <cmath>

#include "api/objects.h"
#include "geometry/convex_search.h"
#include "world/find.h"
#include "world/queries.h"

using namespace dfm;

void dfm_query_shape_default_sized(uint32_t size, dfm_query_shape *out) {
  dfm_query_shape d{};
  d.shape = DFM_SHAPE_SPHERE;
  give_default(size, out, d);
}

void dfm_query_filter_default_sized(uint32_t size, dfm_query_filter *out) {
  dfm_query_filter d{};
  d.what = DFM_QUERY_BODIES | DFM_QUERY_OBSTACLES | DFM_QUERY_RIGIDS;
  d.category = d.collides_with = ~0u;
  give_default(size, out, d);
}

namespace {

// The filter of a call, in the full size of this library.
struct Given {
  dfm_query_filter taken;
  bool any;
  explicit Given(const dfm_query_filter *filter)
      : taken(take_def(filter, dfm_query_filter_default())), any(filter != nullptr) {
    constexpr uint32_t known = DFM_QUERY_BODIES | DFM_QUERY_OBSTACLES | DFM_QUERY_RIGIDS | DFM_QUERY_SENSORS;
    if (taken.what & ~known)
      fail(DFM_E_ARG, "filter.what is %u; expected a sum of DFM_QUERY_* (at most %u)", taken.what, known);
  }
  ThingFilter filter() const { return ThingFilter(any ? &taken : nullptr); }
};

Vec3 finite(const double *v, const char *name) {
  need(v, name);
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(v[k])) fail(DFM_E_ARG, "%s[%d] is %g; it must be finite", name, k, v[k]);
  return load3(v);
}

double size_of(double value, const char *name) {
  if (!(value >= 0 && value < HUGE_VAL))
    fail(DFM_E_ARG, "the shape's %s is %g m; it must be finite and not negative", name, value);
  return value;
}

Convex taken_shape(const dfm_query_shape *given) {
  need(given, "shape");
  const dfm_query_shape def = take_def(given, dfm_query_shape_default());
  Convex c;
  c.position = finite(def.pose.position, "shape.pose.position");
  if (!all_finite(def.pose.rotation, 4)) fail(DFM_E_ARG, "the shape's rotation is not finite");
  c.rotation = unit_quat(def.pose.rotation);
  c.turned = c.rotation.w != 1;
  c.radius = size_of(def.radius, "radius");
  switch (def.shape) {
    case DFM_SHAPE_SPHERE: break;
    case DFM_SHAPE_CAPSULE:
      c.npoint = 2;
      c.own[5] = size_of(def.half_length, "half_length");
      c.own[2] = -c.own[5];
      break;
    case DFM_SHAPE_BOX:
      c.box = true;
      for (int k = 0; k < 3; ++k) c.half[k] = size_of(def.half_size[k], "half_size");
      break;
    case DFM_SHAPE_CONVEX:
      if (def.npoint == 0) fail(DFM_E_ARG, "the shape is the hull of no points; npoint must be at least 1");
      need(def.points, "shape.points");
      for (size_t i = 0; i < 3 * size_t{def.npoint}; ++i)
        if (!std::isfinite(def.points[i])) fail(DFM_E_ARG, "point %zu of the shape is not finite", i / 3);
      c.points = def.points;
      c.npoint = def.npoint;
      break;
    default:
      fail(DFM_E_ARG,
           "a query cannot use shape %u; expected DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE or "
           "DFM_SHAPE_CONVEX",
           def.shape);
  }
  return c;
}

struct Ray {
  Vec3 origin, unit;
  double limit;
};
Ray taken_ray(const double *origin, const double *direction, double max_distance) {
  Ray r{finite(origin, "origin"), normalized(finite(direction, "direction")), max_distance};
  if (!(norm2(r.unit) > 0.5))
    fail(DFM_E_ARG, "the direction of the ray is zero, or its length is too large for a double");
  if (!(max_distance > 0)) fail(DFM_E_ARG, "max_distance is %g m; it must be above 0", max_distance);
  return r;
}

void need_room(const void *out, uint32_t capacity) {
  if (capacity > 0 && !out) fail(DFM_E_ARG, "the out argument is NULL, with a capacity of %u", capacity);
}

void list_overlaps(World &w, const Given &given, const Convex &shape, uint32_t capacity, uint64_t *things,
                   uint32_t *n) {
  need_room(things, capacity);
  uint32_t count = 0;
  each_thing(w, given.filter(), [&](const Thing &thing) {
    if (!overlaps(shape, thing)) return true;
    if (count < capacity) things[count] = thing.handle();
    ++count;
    return true;
  });
  if (n) *n = count;
}

}  // namespace

dfm_status dfm_world_query_ray(dfm_world world, const double origin[3], const double direction[3],
                               double max_distance, const dfm_query_filter *filter, dfm_query_hit *hit) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    const Ray ray = taken_ray(origin, direction, max_distance);
    const Given given(filter);
    give(hit, find_first_on_ray(w, given.filter(), ray.origin, ray.unit, ray.limit));
  });
}

dfm_status dfm_world_query_ray_all_sized(dfm_world world, const double origin[3], const double direction[3],
                                         double max_distance, const dfm_query_filter *filter,
                                         uint32_t row_size, uint32_t capacity, dfm_query_hit *out,
                                         uint32_t *n) {
  return as_status([&] {
    if (row_size < sizeof(dfm_query_hit) || row_size % 8 != 0)
      fail(DFM_E_ARG,
           "row_size %u is not the size of a dfm_query_hit: expected a multiple of 8, at least %zu; pass "
           "sizeof(dfm_query_hit)",
           row_size, sizeof(dfm_query_hit));
    World &w = settled(world_of(world));
    const Ray ray = taken_ray(origin, direction, max_distance);
    const Given given(filter);
    need_room(out, capacity);
    HitRows rows(out, row_size, capacity);
    find_all_on_ray(w, given.filter(), ray.origin, ray.unit, ray.limit, rows);
    if (n) *n = rows.count();
  });
}

dfm_status dfm_world_query_closest(dfm_world world, const double point[3], double max_distance,
                                   const dfm_query_filter *filter, dfm_query_hit *hit) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    const Vec3 p = finite(point, "point");
    if (!(max_distance > 0)) fail(DFM_E_ARG, "max_distance is %g m; it must be above 0", max_distance);
    const Given given(filter);
    give(hit, find_closest(w, given.filter(), p, max_distance));
  });
}

dfm_status dfm_world_query_overlap(dfm_world world, const dfm_query_shape *shape,
                                   const dfm_query_filter *filter, uint32_t capacity, uint64_t *things,
                                   uint32_t *n) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    const Convex asked = taken_shape(shape);
    list_overlaps(w, Given(filter), asked, capacity, things, n);
  });
}

dfm_status dfm_world_query_aabb(dfm_world world, const dfm_aabb *box, const dfm_query_filter *filter,
                                uint32_t capacity, uint64_t *things, uint32_t *n) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    need(box, "box");
    const Vec3 lo = finite(box->lo, "box.lo"), hi = finite(box->hi, "box.hi");
    Convex asked;
    asked.box = true;
    asked.position = 0.5 * (lo + hi);
    asked.half = 0.5 * (hi - lo);
    for (int k = 0; k < 3; ++k)
      if (!(asked.half[k] >= 0))
        fail(DFM_E_ARG, "box: lo[%d] is %g m, above hi[%d], %g m", k, lo[k], k, hi[k]);
    list_overlaps(w, Given(filter), asked, capacity, things, n);
  });
}

dfm_status dfm_body_query_triangles(dfm_body body, const dfm_query_shape *shape, uint32_t capacity,
                                    uint32_t *triangles, uint32_t *n) {
  return as_status(to_read<shown_body_of>, body, [&](Body &b) {
    const Convex asked = taken_shape(shape);
    need_room(triangles, capacity);
    const uint32_t count = triangles_touched(search(b), asked, capacity, triangles);
    if (n) *n = count;
  });
}

dfm_status dfm_world_query_cast(dfm_world world, const dfm_query_shape *shape, const double path[3],
                                const dfm_query_filter *filter, dfm_query_hit *hit) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    const Convex asked = taken_shape(shape);
    const Vec3 way = finite(path, "path");
    if (!std::isfinite(norm(way))) fail(DFM_E_ARG, "the length of the path is too large for a double");
    const Given given(filter);
    give(hit, find_first_on_path(w, given.filter(), asked, way));
  });
}
