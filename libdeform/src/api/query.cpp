#include "deform/query.h"

#include <cmath>

#include "api/objects.h"
#include "world/find.h"

using namespace dfm;

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

Convex taken_shape(const dfm_query_shape &def) {
  Convex c;
  c.position = finite(def.pose.position, "shape.pose.position");
  if (!all_finite(def.pose.rotation, 4)) fail(DFM_E_ARG, "the shape's rotation is not finite");
  c.rotation = unit_quat(def.pose.rotation);
  c.turned = c.rotation.w != 1;
  c.radius = size_of(def.radius, "radius");
  switch (def.shape) {
    case DFM_SHAPE_SPHERE: break;
    case DFM_SHAPE_POINT: c.radius = 0; break;
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
           "a query cannot use shape %u; expected DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE, "
           "DFM_SHAPE_CONVEX or DFM_SHAPE_POINT",
           def.shape);
  }
  return c;
}

ThingQuery taken_query(const dfm_query_shape &def, const double *path, double reach) {
  if (def.flags & ~uint32_t{DFM_QUERY_EACH | DFM_QUERY_COUNT})
    fail(DFM_E_ARG, "shape.flags is %u; expected a sum of DFM_QUERY_EACH and DFM_QUERY_COUNT", def.flags);
  if (!(reach >= 0)) fail(DFM_E_ARG, "reach is %g m; it must not be negative", reach);
  ThingQuery q;
  q.shape = taken_shape(def);
  q.point = def.shape == DFM_SHAPE_POINT;
  q.each = def.flags & DFM_QUERY_EACH;
  q.limit = reach;
  if (!path) return q;
  const Vec3 way = finite(path, "path");
  q.way = {true, normalized(way)};
  const double length = norm(way);
  if (!std::isfinite(length)) fail(DFM_E_ARG, "the length of the path is too large for a double");
  if (reach == 0) q.limit = length;
  if ((q.point || reach > 0) && !(norm2(q.way.unit) > 0.5))
    fail(DFM_E_ARG, "the path is zero; the direction of a ray, or of a path with a reach, must not be");
  return q;
}

dfm_query_hits taken_hits(const void *user) {
  need(user, "user");
  const auto *const given = static_cast<const dfm_query_hits *>(user);
  if (given->size < kFirstSize<dfm_query_hits>)
    fail(DFM_E_ARG, "the size of the dfm_query_hits is %u; set it to its sizeof", given->size);
  dfm_query_hits hits = take_def(given, dfm_query_hits{});
  hits.n = 0;
  if (hits.row_size < kFirstSize<dfm_query_hit> || hits.row_size % 8 != 0)
    fail(DFM_E_ARG,
         "row_size %u is not the size of a dfm_query_hit: expected a multiple of 8, at least %zu; set it to "
         "sizeof(dfm_query_hit)",
         hits.row_size, size_t{kFirstSize<dfm_query_hit>});
  if (hits.capacity > 0 && !hits.out) fail(DFM_E_ARG, "out is NULL, with a capacity of %u", hits.capacity);
  return hits;
}

// The one thing of a filter.
void need_thing(const World &w, uint64_t thing) {
  if (dfm_handle_kind(thing) == DFM_HANDLE_BODY) shown_body_of(thing);
  id_of(w, thing, "filter.only");
}

}  // namespace

dfm_status dfm_world_query(dfm_world world, const dfm_query_shape *shape, const double path[3], double reach,
                           const dfm_query_filter *filter, dfm_query_hit_fn hit, void *user) {
  return as_status(to_read<world_of>, world, [&](World &w) {
    need(shape, "shape");
    const dfm_query_shape def = take_def(shape, dfm_query_shape_default());
    const ThingQuery query = taken_query(def, path, reach);
    const Given given(filter);
    if (given.taken.only) need_thing(w, given.taken.only);
    if (hit) return find(w, given.filter(), query, hit, user);
    dfm_query_hits kept = taken_hits(user);
    const bool count = kept.capacity == 0 || def.flags & DFM_QUERY_COUNT;
    find(w, given.filter(), query, count ? keep_and_count : keep_nearest, &kept);
    static_cast<dfm_query_hits *>(user)->n = kept.n;
  });
}
