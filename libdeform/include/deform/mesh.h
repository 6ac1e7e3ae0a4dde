/* deform/mesh.h -- tetrahedral meshes from files and generators, before they become bodies. */
#ifndef DEFORM_MESH_H
#define DEFORM_MESH_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Reads MSH 2.2 and 4.1 (ASCII, binary) and legacy VTK (ASCII, binary; 2.0 to 5.1) with tetrahedra. Memory is bounded by the file's size.
 * Negative cells are turned, unused points dropped, duplicate cells dropped, each with a count in a warning on the log and in dfm_tetmesh_info.
 * @return DFM_OK; DFM_E_IO; DFM_E_FORMAT (file, line or byte, what was expected); DFM_E_UNSUPPORTED (how to convert); DFM_E_NOMEM
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_read(dfm_context *context, const char *path, dfm_tetmesh *out);
/** Generators, SI units, about `cells` tetrahedra (at least one layer).
 * "cylinder": size = {radius, length, 0}, axis z from 0 to length, base at the origin; "beam": size = {x, y, z} edges from the origin, along x first;
 * "ball": size = {radius, 0, 0}, about the origin. @return DFM_OK; DFM_E_ARG. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_make(dfm_context *context, const char *kind, const double size[3], uint32_t cells, dfm_tetmesh *out);
DFM_API dfm_status dfm_tetmesh_destroy(dfm_tetmesh mesh);

typedef struct dfm_tetmesh_info {
  uint32_t size, npoint, ntet, ntriangle, nedge, npiece;   /* triangles of the boundary; edges of the cells; connected pieces */
  uint32_t turned, dropped_points, dropped_cells, flat_cells, duplicate_points, nonmanifold_edges, ngroup, reserved;
  double volume, edge_min, edge_median, edge_max;          /* m3, m */
  double quality_min, quality_mean; uint32_t quality_histogram[10];   /* mean ratio, 1 for a regular tetrahedron; bins of 0.1 */
  double lo[3], hi[3];
  const char *warnings;                                    /* one sentence a line; valid while the mesh lives */
} dfm_tetmesh_info;
/** Counts, sizes and what reading repaired. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_get_info(dfm_tetmesh mesh, dfm_tetmesh_info *out);
/** Borrowed arrays, valid while the mesh lives: points [npoint,3], tets [ntet,4], file_point [npoint] number of each point in the file's order.
 * Each out may be NULL. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_data(dfm_tetmesh mesh, const double **points, const uint32_t **tets, const uint32_t **file_point);
/** Physical groups: name of group k and, per cell, its group (UINT32_MAX none). Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_groups(dfm_tetmesh mesh, const char *const **names, const uint32_t **cell_group);
/** Writes MSH 4.1 or 2.2 binary ("*.msh"), legacy VTK ("*.vtk") by file name ending; to a temporary name first, so never half a file.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_write(dfm_tetmesh mesh, const char *path);
#ifdef __cplusplus
}
#endif
#endif
