/* deform/surface.h -- surfels: the surface of a body, for contact and drawing. */
#ifndef DEFORM_SURFACE_H
#define DEFORM_SURFACE_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Positions of all surfels, m.
 * @param capacity  of xyz in surfels; 0 with xyz NULL only counts
 * @param xyz       out, [n,3]
 * @param n         out, number of surfels
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_ARG capacity too small (xyz untouched, *n set)
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_surface_positions(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n);
/** Velocities of all surfels, m/s, [n,3]; capacity and errors as for dfm_surface_positions.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_surface_velocities(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n);
/** Area-weighted unit normals of all surfels, outward, [n,3]; capacity and errors as for
 * dfm_surface_positions.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_surface_normals(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n);
/** Contact force on each surfel in the last sub-step, N, [n,3]; capacity and errors as for
 * dfm_surface_positions.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_surface_forces(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n);
/** Triangles, [n,3] surfel numbers, counter-clockwise seen from outside. @param capacity of tri in triangles;
 * else as dfm_surface_positions.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_surface_triangles(dfm_body body, uint32_t capacity, uint32_t *tri, uint32_t *n);
/** Phyxel under each surfel, [n]; capacity as for dfm_surface_positions. @return DFM_OK;
 * DFM_E_UNSUPPORTED unless the coupling is identity; DFM_E_ARG; DFM_E_HANDLE. Threads: Any thread. Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_surface_points(dfm_body body, uint32_t capacity, uint32_t *point, uint32_t *n);

#define DFM_VERTEX_NONE UINT32_MAX /* dfm_vertex_layout: this member is not written */
/** Layout of single-precision vertices in the caller's memory: bytes from one vertex to the next, and bytes
 * from the start of a vertex to each member, all multiples of 4. Bytes between the members are not written,
 * so that the host can store texture coordinates there once. */
typedef struct dfm_vertex_layout {
  uint32_t size, stride;
  uint32_t position; /* 3 floats, m: world, minus origin */
  uint32_t normal;   /* 3 floats: as dfm_surface_normals */
  uint32_t velocity; /* 3 floats, m/s */
  /* 3 floats, m: from the rest shape at its pose, as dfm_debug_surface_displacements */
  uint32_t displacement;
  /* 1 float, from the loaded contacts of the last sub-step at this surfel, its edges and its triangles:
   * 1 at least one sticks, 0.5 all slide, 0 there is none */
  uint32_t stick;
  uint32_t reserved;
  double origin[3]; /* m, subtracted before rounding, for precision far from the origin */
  uint64_t cookie;  /* set by the default function */
} dfm_vertex_layout;
/** dfm_vertex_layout_default into a struct of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_vertex_layout_default_sized(uint32_t size, dfm_vertex_layout *out);
/** Position and normal, 24 bytes a vertex, origin 0. Threads: Any thread. Since 0.1. */
static inline dfm_vertex_layout dfm_vertex_layout_default(void) {
  dfm_vertex_layout out;
  dfm_vertex_layout_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Writes one vertex per surfel for drawing; each value is the nearest float to that of the functions above.
 * The triangles of dfm_surface_triangles are the index buffer. Memory is only written, in ascending order
 * except for `stick`, so it may be a mapped vertex buffer. If the surface is the boundary of the cells, the
 * call allocates nothing; otherwise the first call builds the tree of queries.
 * @param layout  NULL: dfm_vertex_layout_default()
 * @param bytes   size of out; 0 with out NULL only counts
 * @param out     aligned to 4
 * @param n       out, vertices, one per surfel; may be NULL
 * @return DFM_OK; DFM_E_ARG members overlap, lie beyond the stride or are not aligned, or bytes is too small
 * (out untouched, *n set); DFM_E_NOMEM; DFM_E_HANDLE; DFM_E_BUSY. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_surface_vertices(dfm_body body, const dfm_vertex_layout *layout, size_t bytes,
                                        void *out, uint32_t *n);
#ifdef __cplusplus
}
#endif
#endif
