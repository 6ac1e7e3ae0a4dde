/* deform/query.h -- queries on the present positions: what overlaps a shape, what a moving shape hits first,
 * all hits of a ray, the closest point; each with a filter. doc/concepts/queries.md.
 *
 * Queries use the surfaces themselves, without the rest distance of contacts: triangles of bodies, meshes and
 * voxels, closed formulas for the other shapes. Results do not depend on the number of threads or on earlier
 * queries. Any number of threads may query while no step runs. The first query of a body after its points
 * have moved updates its tree (dfm_world_ray); later ones allocate nothing. */
#ifndef DEFORM_QUERY_H
#define DEFORM_QUERY_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#include "deform/obstacle.h"
#ifdef __cplusplus
extern "C" {
#endif

/** The convex hull of points, for dfm_query_shape. Since 0.1. */
#define DFM_SHAPE_CONVEX 7u

/** A convex shape for a query. The radius of a box or a hull rounds it: the shape extends by the radius
 * beyond the box or the points. Sizes may be zero: a sphere of radius 0 is a point. */
typedef struct dfm_query_shape {
  uint32_t size, shape; /* DFM_SHAPE_SPHERE, BOX, CAPSULE or CONVEX */
  dfm_pose pose;        /* world */
  double half_size[3];  /* box, m */
  double radius;        /* m; sphere, capsule; box and hull: 0 if not rounded */
  double half_length;   /* capsule: half of the axis between the centers of its caps, along local z, m */
  uint32_t npoint, reserved;
  const double *points; /* CONVEX: [npoint,3] m, in the shape's frame; borrowed during the call */
  uint64_t cookie;      /* set by the default function */
} dfm_query_shape;
/** dfm_query_shape_default into a struct of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_query_shape_default_sized(uint32_t size, dfm_query_shape *out);
/** A point at the origin: a sphere of radius 0. Threads: Any thread. Since 0.1. */
static inline dfm_query_shape dfm_query_shape_default(void) {
  dfm_query_shape out;
  dfm_query_shape_default_sized((uint32_t)sizeof out, &out);
  return out;
}

/** dfm_query_filter.what. OBSTACLES: obstacles that are not rigid bodies. SENSORS: includes sensors of these
 * kinds, which are left out otherwise. */
enum { DFM_QUERY_BODIES = 1, DFM_QUERY_OBSTACLES = 2, DFM_QUERY_RIGIDS = 4, DFM_QUERY_SENSORS = 8 };
/** The things that a query includes: those of the kinds `what` for which (category & thing.collides_with) and
 * (thing.category & collides_with), as for two bodies, and for which accept returns true. */
typedef struct dfm_query_filter {
  uint32_t size;
  uint32_t what;                    /* sum of DFM_QUERY_* */
  uint32_t category, collides_with; /* of the query itself */
  /* called once per query for each thing that passes the masks, bodies first, each kind in order of creation,
   * on the calling thread. It may not change the world (DFM_E_BUSY). NULL: all are accepted. */
  bool (*accept)(void *user, uint64_t thing);
  void *user;      /* first argument of accept */
  uint64_t cookie; /* set by the default function */
} dfm_query_filter;
/** dfm_query_filter_default into a struct of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_query_filter_default_sized(uint32_t size, dfm_query_filter *out);
/** Bodies, obstacles and rigid bodies, all masks set. A thing whose category or collides_with is 0 is left
 * out; a query with filter NULL includes it. Threads: Any thread. Since 0.1. */
static inline dfm_query_filter dfm_query_filter_default(void) {
  dfm_query_filter out;
  dfm_query_filter_default_sized((uint32_t)sizeof out, &out);
  return out;
}

/** dfm_query_hit.flags. INSIDE: for a cast, the shape overlaps the thing at the start. */
enum { DFM_QUERY_INSIDE = 1 };
typedef struct dfm_query_hit {
  uint32_t size, flags;
  uint64_t thing;              /* dfm_body, dfm_obstacle or dfm_rigid; 0: no hit */
  uint32_t triangle, reserved; /* of the surface; UINT32_MAX for shapes in closed form */
  double distance;             /* m, along the ray or the path, or to the closest point; INFINITY: no hit */
  double point[3];             /* m, world; on the thing */
  double normal[3];            /* unit; outward from the surface; for a cast, from the thing to the shape */
} dfm_query_hit;

/** First surface that a ray hits. As dfm_world_ray, with a filter.
 * @param filter  NULL: all but sensors
 * @param hit     out; thing 0: no hit
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM no memory for a tree; DFM_E_HANDLE; DFM_E_BUSY. Threads: Any thread.
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query_ray(dfm_world world, const double origin[3], const double direction[3],
                                       double max_distance, const dfm_query_filter *filter,
                                       dfm_query_hit *hit);
/** dfm_world_query_ray_all with rows of any size that is at least the first one. @param row_size bytes from
 * one row of out to the next (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_query_ray_all_sized(dfm_world world, const double origin[3],
                                                 const double direction[3], double max_distance,
                                                 const dfm_query_filter *filter, uint32_t row_size,
                                                 uint32_t capacity, dfm_query_hit *out, uint32_t *n);
/** All surfaces that a ray hits, where it enters things and where it leaves them, nearest first; at equal
 * distance bodies before obstacles, each in order of creation, then the lower triangle. A ray through an edge
 * hits the triangles on both sides.
 * @param capacity  of out in hits; if there are more hits, out gets the nearest ones
 * @param n         out, number of all hits; out has min(n, capacity) of them. May be NULL
 * @return as dfm_world_query_ray. Threads: Any thread. Not during step. Since 0.1. */
static inline dfm_status dfm_world_query_ray_all(dfm_world world, const double origin[3],
                                                 const double direction[3], double max_distance,
                                                 const dfm_query_filter *filter, uint32_t capacity,
                                                 dfm_query_hit *out, uint32_t *n) {
  return dfm_world_query_ray_all_sized(world, origin, direction, max_distance, filter,
                                       (uint32_t)sizeof(dfm_query_hit), capacity, out, n);
}

/** Closest point of all surfaces within max_distance of a point, which may lie inside of things.
 * @param hit  out; normal: of the surface there, outward
 * @return as dfm_world_query_ray. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query_closest(dfm_world world, const double point[3], double max_distance,
                                           const dfm_query_filter *filter, dfm_query_hit *hit);

/** Things that a shape overlaps: it touches their surface, or lies inside them. Inside is the space that a
 * closed surface encloses, and the half-space below a plane; an open surface encloses nothing. Of a surface
 * that faces inward (a room) only the triangles count.
 * @param capacity  of things; if there are more, it gets the first ones
 * @param things    out, handles: bodies, then obstacles and rigid bodies, each in order of creation
 * @param n         out, number of all; may be NULL
 * @return as dfm_world_query_ray. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query_overlap(dfm_world world, const dfm_query_shape *shape,
                                           const dfm_query_filter *filter, uint32_t capacity,
                                           uint64_t *things, uint32_t *n);
/** The same for an axis-aligned box. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query_aabb(dfm_world world, const dfm_aabb *box, const dfm_query_filter *filter,
                                        uint32_t capacity, uint64_t *things, uint32_t *n);
/** Surface triangles of a body that a shape touches or contains, ascending.
 * @param capacity   of triangles; if there are more, it gets the lowest numbers
 * @param triangles  out, numbers as in dfm_surface_triangles
 * @param n          out, number of all; may be NULL
 * @return as dfm_world_query_ray. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_query_triangles(dfm_body body, const dfm_query_shape *shape, uint32_t capacity,
                                            uint32_t *triangles, uint32_t *n);

/** First thing that a shape hits while it moves along a straight path without rotation. hit->distance is the
 * length along the path. There the shape is at most 1e-9 of the largest length involved (path, shape, thing)
 * away from touching, and it has not passed through anything before. A shape that overlaps a thing at the
 * start hits it at distance 0, with flag DFM_QUERY_INSIDE, the shape's position as point and a normal
 * opposite to the path; use a filter to leave such things out. At equal distance the first thing, then the
 * lower triangle.
 * @param path  m; its length is the largest distance. A path of length 0 finds overlaps only
 * @param hit   out; thing 0: the path is free
 * @return as dfm_world_query_ray. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query_cast(dfm_world world, const dfm_query_shape *shape, const double path[3],
                                        const dfm_query_filter *filter, dfm_query_hit *hit);
#ifdef __cplusplus
}
#endif
#endif
