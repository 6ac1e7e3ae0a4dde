/* deform/query.h -- one query of the present positions: what a shape, a ray or a point meets on a path,
 * within a distance or where it is. doc/concepts/queries.md.
 *
 * Queries use the surfaces themselves, without the rest distance of contacts: triangles of bodies, meshes and
 * voxels, closed formulas for the other shapes. Results do not depend on the number of threads or on earlier
 * queries. Any number of threads may query while no step runs. Triangles are searched through trees of boxes
 * (about 150 bytes a triangle), which are built when they are first needed. The first query of a body after
 * its points have moved updates its tree; later ones allocate nothing. */
#ifndef DEFORM_QUERY_H
#define DEFORM_QUERY_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#include "deform/obstacle.h"
#ifdef __cplusplus
extern "C" {
#endif

/** For dfm_query_shape: the convex hull of points. Since 0.1. */
#define DFM_SHAPE_CONVEX 7u
/** For dfm_query_shape: a point to which only surfaces count, seen from both sides, and not what encloses it.
 * On a path it is a ray. Since 0.1. */
#define DFM_SHAPE_POINT 8u

/** dfm_query_shape.flags. EACH: all hits of a thing, in place of its nearest: one for each triangle, and one
 * without a triangle if the shape lies inside a closed surface; of other shapes where a ray enters and where
 * it leaves. COUNT: n of a dfm_query_hits counts all hits, also those for which out has no room. */
enum { DFM_QUERY_EACH = 1, DFM_QUERY_COUNT = 2 };
/** A convex shape for a query. The radius of a box or a hull rounds it: the shape extends by the radius
 * beyond the box or the points. Sizes may be zero: a sphere of radius 0 is a point. */
typedef struct dfm_query_shape {
  uint32_t size, shape;   /* DFM_SHAPE_SPHERE, BOX, CAPSULE, CONVEX or POINT */
  dfm_pose pose;          /* world */
  double half_size[3];    /* box, m */
  double radius;          /* m; sphere, capsule; box and hull: 0 if not rounded */
  double half_length;     /* capsule: half of the axis between the centers of its caps, along local z, m */
  uint32_t npoint, flags; /* flags: sum of DFM_QUERY_EACH and COUNT */
  const double *points;   /* CONVEX: [npoint,3] m, in the shape's frame; borrowed during the call */
  uint64_t cookie;        /* set by the default function */
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
  /* the one thing to ask, whatever its kind and masks, without accept; 0: all that pass. Not of this world:
   * DFM_E_HANDLE; a body without cells: DFM_E_STATE */
  uint64_t only;
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

/** dfm_query_hit.flags. INSIDE: the shape overlaps the thing where it is, or at the start of its path; never
 * of a POINT. */
enum { DFM_QUERY_INSIDE = 1 };
typedef struct dfm_query_hit {
  uint32_t size, flags;
  uint64_t thing;              /* dfm_body, dfm_obstacle or dfm_rigid */
  uint32_t triangle, reserved; /* of the surface, as in dfm_surface_triangles; UINT32_MAX: none */
  double distance;             /* m, along the path, or between shape and thing */
  double point[3];             /* m, world; on the thing */
  double normal[3];            /* unit; POINT: outward from the surface; else from the thing to the shape */
} dfm_query_hit;
/** Gets one hit; valid during the call. It may query, but may not change the world (DFM_E_BUSY).
 * @return how far the query is to go on, m: INFINITY as far as before, hit->distance for hits no farther
 * than this one, -1 to end it */
typedef double (*dfm_query_hit_fn)(void *user, const dfm_query_hit *hit);

/** The nearest hits, nearest first; at equal distance bodies, then obstacles and rigid bodies, each in order
 * of creation, then the lower triangle. */
typedef struct dfm_query_hits {
  uint32_t size, row_size; /* sizeof(dfm_query_hits), sizeof(dfm_query_hit) */
  uint32_t capacity, n;    /* of out; out, how many it has got; with COUNT or capacity 0 how many there are */
  dfm_query_hit *out;
} dfm_query_hits;

/** What a shape meets.
 * - On a path, which it follows without rotation: what it hits, and at which distance along the path. There
 *   it is at most 1e-9 of the largest length involved (path, shape, thing) away from touching, and it has not
 *   passed through anything before. What it overlaps at the start it hits at distance 0, with the flag
 *   INSIDE, its own position as point and a normal opposite to the path. A path of length 0 finds overlaps
 *   only.
 * - Without a path: what is within `reach`; with reach 0 what it overlaps. A thing that it overlaps has
 *   distance 0, the flag INSIDE, the shape's position as point and no normal, and a triangle only with EACH.
 * It overlaps a thing if it touches its surface or lies inside: in the space that a closed surface encloses,
 * or in the half-space below a plane. An open surface encloses nothing; of a surface that faces inward (a
 * room) only the triangles count. Of a POINT on a path, a ray, the hits are those of the surfaces; from
 * inside, where it leaves a thing; through an edge, the lower triangle or with EACH both. Without a path they
 * are the closest points of surfaces, also where the point lies inside.
 * @param path    [3] m, of any length if reach is given; NULL: none
 * @param reach   m, largest distance, INFINITY for any; 0: the whole path; without a path, overlaps
 * @param filter  NULL: all but sensors
 * @param hit     called on this thread, for things in their order (as of dfm_query_hits), each with its
 *                nearest hit (with EACH: in no order), the lowest triangle of several. NULL: user is a
 *                dfm_query_hits, which gets the nearest ones
 * @param user    first argument of hit
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM no memory for a tree; DFM_E_HANDLE; DFM_E_STATE filter.only has no
 * cells; DFM_E_BUSY. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_query(dfm_world world, const dfm_query_shape *shape, const double path[3],
                                   double reach, const dfm_query_filter *filter, dfm_query_hit_fn hit,
                                   void *user);
#ifdef __cplusplus
}
#endif
#endif
