/* deform/deprecated.h -- names that the next version leaves out, and what stands in their place. */
#ifndef DEFORM_DEPRECATED_H
#define DEFORM_DEPRECATED_H
#include <math.h>

#include "deform/body.h"
#include "deform/query.h"
/* Queries: dfm_world_query takes their place. Arguments, results and statuses are as they were, except that
 * hits have the sizes of this header and that a call during a step is DFM_E_BUSY. */
typedef struct dfm_ray_hit {
  uint32_t size, triangle;
  dfm_body body;
  dfm_obstacle obstacle;
  double distance, point[3], normal[3];
} dfm_ray_hit;
static inline dfm_query_hit dfm_query_no_hit(void) {
  dfm_query_hit hit = {(uint32_t)sizeof(dfm_query_hit), 0, 0, UINT32_MAX, 0, INFINITY, {0, 0, 0}, {0, 0, 0}};
  return hit;
}
static inline dfm_query_shape dfm_query_point(const double p[3]) {
  dfm_query_shape shape = dfm_query_shape_default();
  shape.shape = DFM_SHAPE_POINT;
  for (int k = 0; k < 3; ++k) shape.pose.position[k] = p ? p[k] : NAN;
  return shape;
}
static inline dfm_status dfm_query_first(dfm_world world, const dfm_query_shape *shape, const double path[3],
                                         double reach, const dfm_query_filter *filter, dfm_query_hit *out) {
  dfm_query_hit hit = dfm_query_no_hit();
  dfm_query_hits hits = {(uint32_t)sizeof hits, (uint32_t)sizeof hit, 1, 0, &hit};
  if (!out) return dfm_fail(DFM_E_ARG, "the out argument is NULL");
  const dfm_status status = dfm_world_query(world, shape, path, reach, filter, NULL, &hits);
  if (status >= 0) *out = hit;
  return status;
}
static inline dfm_status dfm_world_query_ray(dfm_world world, const double origin[3],
                                             const double direction[3], double max_distance,
                                             const dfm_query_filter *filter, dfm_query_hit *hit) {
  const double none[3] = {0, 0, 0};
  const dfm_query_shape point = dfm_query_point(origin);
  return dfm_query_first(world, &point, direction ? direction : none, max_distance > 0 ? max_distance : -1,
                         filter, hit);
}
static inline dfm_status dfm_world_query_closest(dfm_world world, const double point[3], double max_distance,
                                                 const dfm_query_filter *filter, dfm_query_hit *hit) {
  const dfm_query_shape shape = dfm_query_point(point);
  return dfm_query_first(world, &shape, NULL, max_distance > 0 ? max_distance : -1, filter, hit);
}
static inline dfm_status dfm_world_query_cast(dfm_world world, const dfm_query_shape *shape,
                                              const double path[3], const dfm_query_filter *filter,
                                              dfm_query_hit *hit) {
  if (!path) return dfm_fail(DFM_E_ARG, "path is NULL");
  return dfm_query_first(world, shape, path, 0, filter, hit);
}
static inline dfm_status dfm_query_ray_hit(dfm_status status, const dfm_query_hit *hit, dfm_ray_hit *out) {
  if (status < 0) return status;
  if (!out) return dfm_fail(DFM_E_ARG, "the out argument is NULL");
  const bool body = dfm_handle_kind(hit->thing) == DFM_HANDLE_BODY;
  out->size = (uint32_t)sizeof *out;
  out->triangle = body ? hit->triangle : UINT32_MAX;
  out->body = body ? hit->thing : 0;
  out->obstacle = body ? 0 : hit->thing;
  out->distance = hit->distance;
  for (int k = 0; k < 3; ++k) out->point[k] = hit->point[k];
  for (int k = 0; k < 3; ++k) out->normal[k] = hit->normal[k];
  return status;
}
static inline dfm_status dfm_world_ray(dfm_world world, const double origin[3], const double direction[3],
                                       double max_distance, dfm_ray_hit *hit) {
  dfm_query_hit found = dfm_query_no_hit();
  return dfm_query_ray_hit(dfm_world_query_ray(world, origin, direction, max_distance, NULL, &found), &found,
                           hit);
}
static inline double dfm_query_nearest_body(void *user, const dfm_query_hit *hit) {
  dfm_query_hit *const nearest = (dfm_query_hit *)user;
  if (dfm_handle_kind(hit->thing) != DFM_HANDLE_BODY) return -1; /* bodies come first */
  if (hit->distance < nearest->distance) *nearest = *hit;
  return nearest->distance;
}
static inline dfm_status dfm_world_closest(dfm_world world, const double point[3], double max_distance,
                                           dfm_ray_hit *hit) {
  dfm_query_hit found = dfm_query_no_hit();
  const dfm_query_shape shape = dfm_query_point(point);
  return dfm_query_ray_hit(dfm_world_query(world, &shape, NULL, max_distance > 0 ? max_distance : -1, NULL,
                                           dfm_query_nearest_body, &found),
                           &found, hit);
}
static inline dfm_status dfm_world_query_ray_all_sized(dfm_world world, const double origin[3],
                                                       const double direction[3], double max_distance,
                                                       const dfm_query_filter *filter, uint32_t row_size,
                                                       uint32_t capacity, dfm_query_hit *out, uint32_t *n) {
  const double none[3] = {0, 0, 0};
  dfm_query_shape point = dfm_query_point(origin);
  dfm_query_hits hits = {(uint32_t)sizeof hits, row_size, capacity, 0, out};
  const double reach = max_distance > 0 ? max_distance : -1;
  point.flags = DFM_QUERY_EACH | DFM_QUERY_COUNT;
  const dfm_status status =
      dfm_world_query(world, &point, direction ? direction : none, reach, filter, NULL, &hits);
  if (status >= 0 && n) *n = hits.n;
  return status;
}
static inline dfm_status dfm_world_query_ray_all(dfm_world world, const double origin[3],
                                                 const double direction[3], double max_distance,
                                                 const dfm_query_filter *filter, uint32_t capacity,
                                                 dfm_query_hit *out, uint32_t *n) {
  return dfm_world_query_ray_all_sized(world, origin, direction, max_distance, filter,
                                       (uint32_t)sizeof(dfm_query_hit), capacity, out, n);
}
typedef struct dfm_query_numbers {
  uint64_t *things;
  uint32_t *triangles, capacity, n;
} dfm_query_numbers;
static inline double dfm_query_list_thing(void *user, const dfm_query_hit *hit) {
  dfm_query_numbers *const list = (dfm_query_numbers *)user;
  if (list->n < list->capacity) list->things[list->n] = hit->thing;
  ++list->n;
  return INFINITY;
}
static inline dfm_status dfm_world_query_overlap(dfm_world world, const dfm_query_shape *shape,
                                                 const dfm_query_filter *filter, uint32_t capacity,
                                                 uint64_t *things, uint32_t *n) {
  dfm_query_numbers list = {things, NULL, capacity, 0};
  if (capacity > 0 && !things) return dfm_fail(DFM_E_ARG, "the out argument is NULL, and capacity above 0");
  const dfm_status status = dfm_world_query(world, shape, NULL, 0, filter, dfm_query_list_thing, &list);
  if (status >= 0 && n) *n = list.n;
  return status;
}
static inline dfm_status dfm_world_query_aabb(dfm_world world, const dfm_aabb *box,
                                              const dfm_query_filter *filter, uint32_t capacity,
                                              uint64_t *things, uint32_t *n) {
  dfm_query_shape shape = dfm_query_shape_default();
  if (!box) return dfm_fail(DFM_E_ARG, "box is NULL");
  shape.shape = DFM_SHAPE_BOX;
  for (int k = 0; k < 3; ++k) {
    shape.pose.position[k] = 0.5 * (box->lo[k] + box->hi[k]);
    shape.half_size[k] = 0.5 * (box->hi[k] - box->lo[k]);
  }
  return dfm_world_query_overlap(world, &shape, filter, capacity, things, n);
}
/* ascending, the lowest kept */
static inline double dfm_query_list_triangle(void *user, const dfm_query_hit *hit) {
  dfm_query_numbers *const list = (dfm_query_numbers *)user;
  if (hit->triangle == UINT32_MAX) return INFINITY;
  const uint32_t kept = list->n < list->capacity ? list->n : list->capacity;
  ++list->n;
  uint32_t at = 0, above = kept;
  while (at < above) {
    const uint32_t middle = at + (above - at) / 2;
    if (list->triangles[middle] < hit->triangle) at = middle + 1;
    else above = middle;
  }
  if (at == list->capacity) return INFINITY;
  for (uint32_t i = kept < list->capacity ? kept : kept - 1; i > at; --i)
    list->triangles[i] = list->triangles[i - 1];
  list->triangles[at] = hit->triangle;
  return INFINITY;
}
static inline dfm_status dfm_body_query_triangles(dfm_body body, const dfm_query_shape *shape,
                                                  uint32_t capacity, uint32_t *triangles, uint32_t *n) {
  dfm_query_numbers list = {NULL, triangles, capacity, 0};
  dfm_query_filter filter = dfm_query_filter_default();
  dfm_body_info info;
  dfm_query_shape each;
  info.size = (uint32_t)sizeof info;
  dfm_status status = dfm_body_get_info(body, &info);
  if (status < 0) return status;
  if (!shape) return dfm_fail(DFM_E_ARG, "shape is NULL");
  if (capacity > 0 && !triangles)
    return dfm_fail(DFM_E_ARG, "the out argument is NULL, and capacity above 0");
  each = *shape;
  each.flags |= DFM_QUERY_EACH;
  filter.only = body;
  status = dfm_world_query(info.world, &each, NULL, 0, &filter, dfm_query_list_triangle, &list);
  if (status >= 0 && n) *n = list.n;
  return status;
}
#endif
