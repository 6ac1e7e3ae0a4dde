/* deform/deprecated.h -- names that the next version leaves out, and what stands in their place. */
#ifndef DEFORM_DEPRECATED_H
#define DEFORM_DEPRECATED_H
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "deform/body.h"
#include "deform/mesh.h"
#include "deform/query.h"
#ifndef DFM_DEPRECATED /* the library has these functions as symbols too, for programs that are linked */
#define DFM_DEPRECATED static inline
#endif
/* Meshes: dfm_mesh_handle and dfm_mesh_* take the place of two kinds. Arguments, results and statuses are as
 * they were, except that dfm_handle_kind knows one kind, and that dfm_mesh_file_kind reads and repairs. */
typedef dfm_mesh_handle dfm_tetmesh;
typedef dfm_mesh_handle dfm_trimesh;
typedef dfm_mesh_info dfm_tetmesh_info;
enum { DFM_HANDLE_TETMESH = DFM_HANDLE_MESH, DFM_HANDLE_TRIMESH = 8, DFM_MESH_TETS = DFM_MESH_CELLS };
typedef struct dfm_trimesh_info {
  uint32_t size, npoint, ntriangle, nedge, npiece, ngroup;
  uint32_t merged_points, dropped_points, dropped_triangles, turned;
  uint32_t open_edges, holes, nonmanifold_edges, closed;
  double area, volume, edge_min, edge_median, edge_max;
  double quality_min, quality_mean;
  uint32_t quality_histogram[10];
  double lo[3], hi[3];
  const char *warnings;
} dfm_trimesh_info;
static inline dfm_status dfm_mesh_need(dfm_mesh_handle mesh, bool cells, dfm_mesh_info *out) {
  out->size = (uint32_t)sizeof *out;
  const dfm_status status = dfm_mesh_get_info(mesh, out);
  if (status < 0 || (out->ntet > 0) == cells) return status;
  return dfm_fail(DFM_E_HANDLE,
                  cells ? "this handle is that of a surface mesh; pass that of a mesh with cells"
                        : "this handle is that of a mesh with cells; pass that of a surface mesh");
}
DFM_DEPRECATED dfm_status dfm_tetmesh_read(dfm_context *context, const char *path, dfm_tetmesh *out) {
  return dfm_mesh_load(context, path, DFM_MESH_CELLS, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_make(dfm_context *context, const char *kind, const double size[3],
                                           uint32_t cells, dfm_tetmesh *out) {
  return dfm_mesh_make(context, kind, size, DFM_MESH_CELLS, cells, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_destroy(dfm_tetmesh mesh) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  return status < 0 ? status : dfm_mesh_destroy(mesh);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_get_info(dfm_tetmesh mesh, dfm_tetmesh_info *out) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (out && !out->size) out->size = (uint32_t)offsetof(dfm_mesh_info, wave_path); /* that of 0.1 */
  return dfm_mesh_get_info(mesh, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_data(dfm_tetmesh mesh, const double **points, const uint32_t **tets,
                                           const uint32_t **file_point) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (points) *points = m.points;
  if (tets) *tets = m.tets;
  if (file_point) *file_point = m.file_point;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_cells(dfm_tetmesh mesh, uint32_t *kind, const uint32_t **cells) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (kind) *kind = m.cell;
  if (cells) *cells = m.cells;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_second_order(dfm_tetmesh mesh, dfm_tetmesh *out) {
  return dfm_mesh_second_order(mesh, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_groups(dfm_tetmesh mesh, const char *const **names,
                                             const uint32_t **cell_group) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (names) *names = m.group_names;
  if (cell_group) *cell_group = m.cell_group;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_triangles(dfm_tetmesh mesh, const uint32_t **triangles,
                                                const uint32_t **group, uint32_t *n) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (triangles) *triangles = m.faces;
  if (group) *group = m.face_group;
  if (n) *n = m.nface;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_group_points(dfm_tetmesh mesh, uint32_t group, uint32_t *dimension,
                                                   const uint32_t **points, uint32_t *n) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status < 0) return status;
  if (group >= m.ngroup)
    return dfm_fail(DFM_E_ARG, "there is no such group; dfm_mesh_info.ngroup says how many there are");
  if (dimension) *dimension = m.group_dimension[group];
  if (points) *points = m.group_points[group];
  if (n) *n = m.group_npoint[group];
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_write(dfm_tetmesh mesh, const char *path) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  return status < 0 ? status : dfm_mesh_write(mesh, path);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_file_cells(dfm_tetmesh mesh, const uint32_t **file_cell) {
  dfm_mesh_info m;
  if (!file_cell) return dfm_fail(DFM_E_ARG, "argument 'file_cell' is NULL");
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status >= 0) *file_cell = m.file_cell;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_fill(dfm_trimesh surface, uint32_t cells, dfm_tetmesh *out) {
  return dfm_mesh_fill(surface, cells, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_share(dfm_tetmesh mesh, const double **share) {
  dfm_mesh_info m;
  if (!share) return dfm_fail(DFM_E_ARG, "argument 'share' is NULL");
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status >= 0) *share = m.share;
  return status;
}
DFM_DEPRECATED dfm_status dfm_tetmesh_lattice(dfm_trimesh surface, uint32_t cells, double size,
                                              dfm_tetmesh *out) {
  return dfm_mesh_lattice(surface, cells, size, out);
}
DFM_DEPRECATED dfm_status dfm_tetmesh_inside(dfm_tetmesh mesh, const double **inside) {
  dfm_mesh_info m;
  if (!inside) return dfm_fail(DFM_E_ARG, "argument 'inside' is NULL");
  const dfm_status status = dfm_mesh_need(mesh, true, &m);
  if (status >= 0) *inside = m.inside;
  return status;
}
DFM_DEPRECATED dfm_status dfm_mesh_file_kind(dfm_context *context, const char *path, uint32_t *kind) {
  dfm_mesh_handle mesh = 0;
  dfm_mesh_info m;
  if (!kind) return dfm_fail(DFM_E_ARG, "argument 'kind' is NULL");
  const dfm_status status = dfm_mesh_load(context, path, DFM_MESH_ANY, &mesh);
  if (status < 0) return status;
  *kind = dfm_mesh_need(mesh, true, &m) < 0 ? DFM_MESH_SURFACE : DFM_MESH_CELLS;
  return dfm_mesh_destroy(mesh);
}
DFM_DEPRECATED dfm_status dfm_mesh_read(dfm_context *context, const char *path, dfm_tetmesh *cells,
                                        dfm_trimesh *surface) {
  dfm_mesh_handle mesh = 0;
  dfm_mesh_info m;
  if (!cells || !surface) return dfm_fail(DFM_E_ARG, "an out argument is NULL");
  const dfm_status status = dfm_mesh_load(context, path, DFM_MESH_ANY, &mesh);
  if (status < 0) return status;
  const bool solid = dfm_mesh_need(mesh, true, &m) >= 0;
  *cells = solid ? mesh : 0;
  *surface = solid ? 0 : mesh;
  return status;
}
DFM_DEPRECATED dfm_status dfm_trimesh_read(dfm_context *context, const char *path, dfm_trimesh *out) {
  return dfm_mesh_load(context, path, DFM_MESH_SURFACE, out);
}
DFM_DEPRECATED dfm_status dfm_trimesh_create(dfm_context *context, uint32_t npoint, const double *points,
                                             uint32_t ntriangle, const uint32_t *triangles,
                                             dfm_trimesh *out) {
  return dfm_mesh_create(context, npoint, points, ntriangle, triangles, out);
}
DFM_DEPRECATED dfm_status dfm_trimesh_make(dfm_context *context, const char *kind, const double size[3],
                                           uint32_t triangles, dfm_trimesh *out) {
  return dfm_mesh_make(context, kind, size, DFM_MESH_SURFACE, triangles, out);
}
DFM_DEPRECATED dfm_status dfm_trimesh_destroy(dfm_trimesh mesh) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, false, &m);
  return status < 0 ? status : dfm_mesh_destroy(mesh);
}
DFM_DEPRECATED dfm_status dfm_trimesh_get_info(dfm_trimesh mesh, dfm_trimesh_info *out) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, false, &m);
  if (status < 0) return status;
  if (!out) return dfm_fail(DFM_E_ARG, "the out argument is NULL");
  const uint32_t whole = (uint32_t)sizeof *out;
  dfm_trimesh_info all = {out->size && out->size < whole ? out->size : whole,
                          m.npoint,
                          m.ntriangle,
                          m.nedge,
                          m.npiece,
                          m.ngroup,
                          m.duplicate_points,
                          m.dropped_points,
                          m.dropped_cells,
                          m.turned,
                          m.open_edges,
                          m.holes,
                          m.nonmanifold_edges,
                          m.closed,
                          m.area,
                          m.volume,
                          m.edge_min,
                          m.edge_median,
                          m.edge_max,
                          m.quality_min,
                          m.quality_mean,
                          {0},
                          {m.lo[0], m.lo[1], m.lo[2]},
                          {m.hi[0], m.hi[1], m.hi[2]},
                          m.warnings};
  memcpy(all.quality_histogram, m.quality_histogram, sizeof all.quality_histogram);
  memcpy(out, &all, all.size);
  return status;
}
DFM_DEPRECATED dfm_status dfm_trimesh_data(dfm_trimesh mesh, const double **points,
                                           const uint32_t **triangles, const uint32_t **file_point) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, false, &m);
  if (status < 0) return status;
  if (points) *points = m.points;
  if (triangles) *triangles = m.faces;
  if (file_point) *file_point = m.file_point;
  return status;
}
DFM_DEPRECATED dfm_status dfm_trimesh_groups(dfm_trimesh mesh, const char *const **names,
                                             const uint32_t **triangle_group) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, false, &m);
  if (status < 0) return status;
  if (names) *names = m.group_names;
  if (triangle_group) *triangle_group = m.face_group;
  return status;
}
DFM_DEPRECATED dfm_status dfm_trimesh_write(dfm_trimesh mesh, const char *path) {
  dfm_mesh_info m;
  const dfm_status status = dfm_mesh_need(mesh, false, &m);
  return status < 0 ? status : dfm_mesh_write(mesh, path);
}
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
DFM_DEPRECATED dfm_status dfm_world_query_ray(dfm_world world, const double origin[3],
                                              const double direction[3], double max_distance,
                                              const dfm_query_filter *filter, dfm_query_hit *hit) {
  const double none[3] = {0, 0, 0};
  const dfm_query_shape point = dfm_query_point(origin);
  return dfm_query_first(world, &point, direction ? direction : none, max_distance > 0 ? max_distance : -1,
                         filter, hit);
}
DFM_DEPRECATED dfm_status dfm_world_query_closest(dfm_world world, const double point[3], double max_distance,
                                                  const dfm_query_filter *filter, dfm_query_hit *hit) {
  const dfm_query_shape shape = dfm_query_point(point);
  return dfm_query_first(world, &shape, NULL, max_distance > 0 ? max_distance : -1, filter, hit);
}
DFM_DEPRECATED dfm_status dfm_world_query_cast(dfm_world world, const dfm_query_shape *shape,
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
DFM_DEPRECATED dfm_status dfm_world_ray(dfm_world world, const double origin[3], const double direction[3],
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
DFM_DEPRECATED dfm_status dfm_world_closest(dfm_world world, const double point[3], double max_distance,
                                            dfm_ray_hit *hit) {
  dfm_query_hit found = dfm_query_no_hit();
  const dfm_query_shape shape = dfm_query_point(point);
  return dfm_query_ray_hit(dfm_world_query(world, &shape, NULL, max_distance > 0 ? max_distance : -1, NULL,
                                           dfm_query_nearest_body, &found),
                           &found, hit);
}
DFM_DEPRECATED dfm_status dfm_world_query_ray_all_sized(dfm_world world, const double origin[3],
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
DFM_DEPRECATED dfm_status dfm_world_query_ray_all(dfm_world world, const double origin[3],
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
DFM_DEPRECATED dfm_status dfm_world_query_overlap(dfm_world world, const dfm_query_shape *shape,
                                                  const dfm_query_filter *filter, uint32_t capacity,
                                                  uint64_t *things, uint32_t *n) {
  dfm_query_numbers list = {things, NULL, capacity, 0};
  if (capacity > 0 && !things) return dfm_fail(DFM_E_ARG, "the out argument is NULL, and capacity above 0");
  const dfm_status status = dfm_world_query(world, shape, NULL, 0, filter, dfm_query_list_thing, &list);
  if (status >= 0 && n) *n = list.n;
  return status;
}
DFM_DEPRECATED dfm_status dfm_world_query_aabb(dfm_world world, const dfm_aabb *box,
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
DFM_DEPRECATED dfm_status dfm_body_query_triangles(dfm_body body, const dfm_query_shape *shape,
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
  each = dfm_query_shape_default(); /* a program of 0.1 has fewer members */
  memcpy(&each, shape, shape->size < sizeof each ? shape->size : sizeof each);
  if (each.size > sizeof each) each.size = (uint32_t)sizeof each;
  each.flags |= DFM_QUERY_EACH;
  filter.only = body;
  status = dfm_world_query(info.world, &each, NULL, 0, &filter, dfm_query_list_triangle, &list);
  if (status >= 0 && n) *n = list.n;
  return status;
}
/* Contact problems: a program beside the command writes them. */
DFM_DEPRECATED dfm_status dfm_debug_contact_problems(dfm_world world, const char *folder, uint32_t every) {
  (void)world;
  (void)every;
  return folder ? dfm_fail(DFM_E_UNSUPPORTED, "`deform run --contact-problems` writes them") : DFM_OK;
}
#endif
