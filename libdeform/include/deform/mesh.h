/* deform/mesh.h -- meshes from files, generators and triangles, before they become bodies: points with
 * cells, or a surface of triangles alone. */
#ifndef DEFORM_MESH_H
#define DEFORM_MESH_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** What a mesh holds. ANY: cells if there are some, else a surface. */
enum { DFM_MESH_ANY = 0, DFM_MESH_CELLS = 1, DFM_MESH_SURFACE = 2 };
/** Reads MSH 2 and 4, legacy VTK 2.0 to 5.1, VTU, Medit, Abaqus, TetGen, Netgen, surfaces of OBJ, PLY, STL,
 * OFF (doc/reference/mesh_files.md). The first bytes, else the ending, tell the format. Memory is bounded
 * by the size of the file. Each repair is counted in dfm_mesh_info and has a sentence in its warnings and
 * the log.
 * Cells are tetrahedra or hexahedra, both also of second order. Inverted ones are reversed, unused points and
 * duplicate cells removed. A cell without volume is refused: it has no rest shape.
 * A surface is the file's triangles, or the boundary of its cells. Polygons are divided into triangles.
 * Coincident points are merged, triangles without area and duplicates removed, and triangles oriented so
 * that neighbors agree and closed pieces face outward. Holes are counted, not closed.
 * @param what  DFM_MESH_*
 * @return DFM_OK; DFM_E_ARG; DFM_E_IO; DFM_E_FORMAT (file, line or byte, what was expected; there are no
 * cells); DFM_E_UNSUPPORTED (how to convert); DFM_E_NOMEM. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_load(dfm_context *context, const char *path, uint32_t what, dfm_mesh_handle *out);
/** Generators, SI units, with about n cells ("bricks": hexahedra), the nearest number that a lattice allows,
 * more if cells would otherwise be longer than twice their width; of a DFM_MESH_SURFACE, which is closed,
 * with about n near-equilateral triangles.
 * "cylinder": size = {radius, length, 0}, axis z from 0 to length, base at the origin; "beam": size = {x,
 * y, z} edges from the origin; "ball": size = {radius, 0, 0}, about the origin; "tube": size = {inner
 * radius, outer radius, length}, as the cylinder. Cells alone: "bricks": a beam of hexahedra. Surfaces
 * alone: "torus": size = {ring radius, tube radius, 0}, about the origin, axis z.
 * @param what  DFM_MESH_CELLS or DFM_MESH_SURFACE
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_make(dfm_context *context, const char *kind, const double size[3], uint32_t what,
                                 uint32_t n, dfm_mesh_handle *out);
/** A surface of the host's triangles, repaired as a file's: points [npoint,3] m, triangles [ntriangle,3].
 * @return DFM_OK; DFM_E_ARG; DFM_E_FORMAT; DFM_E_NOMEM. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_create(dfm_context *context, uint32_t npoint, const double *points,
                                   uint32_t ntriangle, const uint32_t *triangles, dfm_mesh_handle *out);
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread, while no other thread uses the mesh or its arrays.
 * Since 0.1. */
DFM_API dfm_status dfm_mesh_destroy(dfm_mesh_handle mesh);

/** Counts, sizes, repairs and arrays. Arrays and texts are borrowed, valid while the mesh lives. */
typedef struct dfm_mesh_info {
  /* ntet 0: a surface alone. ntriangle, nedge: of the surface, or boundary triangles and all edges of the
   * cells; npiece: connected pieces */
  uint32_t size, npoint, ntet, ntriangle, nedge, npiece;
  /* dropped_cells: of a surface its triangles; duplicate_points: at the place of another, of a surface
   * merged */
  uint32_t turned, dropped_points, dropped_cells, flat_cells, duplicate_points, nonmanifold_edges,
      overlapping_faces, ngroup;
  /* m3, of an open surface without meaning; m */
  double volume, edge_min, edge_median, edge_max;
  /* mean ratio of the cells, at the worst node of each: 1 for a regular tetrahedron or a cube; of triangles
   * 4 sqrt(3) area / sum l2; bins of 0.1 */
  double quality_min, quality_mean;
  uint32_t quality_histogram[10];
  double lo[3], hi[3];
  /* one sentence a line */
  const char *warnings;
  /* m: distance that a wave travels in the largest stable explicit step of the wave equation on these
   * cells, by row sums: the least 2 sqrt(m/k) of the points, m a quarter of the cells' volumes, k = sum of
   * V |g_i| |g_j| over cells and their corners, g the gradients of the shape functions */
  double wave_path;
  /* DFM_CELL_* of plugin.h, and how many of these; each is several of the ntet tetrahedra if they are not
   * tetrahedra of first order */
  uint32_t cell, ncell;
  /* of a surface alone, but nface. closed: 1 if every edge has two triangles of consistent orientation;
   * m2 */
  uint32_t open_edges, holes, closed, nface;
  double area;
  const double *points; /* [npoint,3] */
  const uint32_t *tets; /* [ntet,4] */
  /* [ncell,k] points in the order of plugin.h, for dfm_body_def.cells; each cell is then 8 (TET10), 6 (HEX8),
   * 22 (HEX20) or 48 (HEX27) consecutive ones of tets. NULL where the cells are the tets */
  const uint32_t *cells;
  /* [nface,3], [nface]: triangles and the group of each (UINT32_MAX: none), of a surface all, outward;
   * beside cells those of the file that belong to a group, some perhaps inside, for dfm_body_def.groups */
  const uint32_t *faces, *face_group;
  const uint32_t *cell_group; /* [ntet] likewise */
  /* [npoint], [ntet] index in the file, from 0. file_cell NULL: in the file's order, none removed */
  const uint32_t *file_point, *file_cell;
  /* [ntet] fraction of each cell that is material, in (0,1]; NULL if not filled. VTK and VTU files store
   * it */
  const double *share;
  /* [ncell,27] material of the cells of a lattice: weights w of the 3 x 3 x 3 Gauss points xi of each cell,
   * the first coordinate running fastest, so that the mean over a whole cell of f, counted where there is
   * material, is sum w f(xi), for every f at most quadratic in each of the cell's coordinates. Their sum
   * is the fraction that is material; some may be negative. NULL for other meshes; VTU files store it */
  const double *inside;
  /* [ngroup] physical groups of all dimensions, OBJ groups or materials, PLY and STL solids: name (its
   * number if it has none); dimension of its elements, 0 points, 1 lines, 2 triangles, 3 cells; their
   * points, [group_npoint] ascending, for holding or loading a named surface */
  const char *const *group_names;
  const uint32_t *group_dimension, *group_npoint;
  const uint32_t *const *group_points;
} dfm_mesh_info;
/** out->size bytes at most. @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_get_info(dfm_mesh_handle mesh, dfm_mesh_info *out);
/** Writes by file name ending, to a temporary file that is then renamed. Cells: binary MSH 4.1 ("*.msh"),
 * MSH 2.2 ("*.msh2"), legacy VTK ("*.vtk"), VTU ("*.vtu") or Medit ("*.mesh", groups by number alone),
 * with groups of cells and triangles, in MSH also of points; groups of lines are lost. Surfaces: OBJ, PLY,
 * STL (binary, single precision), OFF, VTK or VTU; OBJ, VTK and VTU keep groups, PLY by number.
 * @return DFM_OK; DFM_E_IO; DFM_E_UNSUPPORTED another ending. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_write(dfm_mesh_handle mesh, const char *path);
/** The same shape with second-order tetrahedra, or hexahedra of 27 points: more points in the middles of the
 * edges, of hexahedra of faces and cells too, groups kept. @return DFM_OK; DFM_E_UNSUPPORTED second-order
 * cells, or those of a filled surface or lattice; DFM_E_NOMEM; DFM_E_HANDLE no cells.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_second_order(dfm_mesh_handle mesh, dfm_mesh_handle *out);
/** Fills a closed surface with cells of a lattice. Small holes, flipped and touching triangles are allowed:
 * inside is where the winding number exceeds one half.
 * @param surface  closed except for small holes; else DFM_E_FORMAT, and the error gives the size of the
 * opening
 * @param cells    wanted number of tetrahedra; the result has a number near it. 0: no lattice, cells from
 * one inner point to the triangles, which stay their border, as the model `boundary` takes it;
 * DFM_E_UNSUPPORTED if no point inside sees all triangles
 * @param out      cells that cover the inside; the surface lies within them. dfm_mesh_info.share is the
 *                 fraction of each that is material
 * @return DFM_OK; DFM_E_ARG cells above 1e8; DFM_E_FORMAT; DFM_E_NOMEM; DFM_E_HANDLE also if it has cells
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_fill(dfm_mesh_handle surface, uint32_t cells, dfm_mesh_handle *out);
/** A coarse regular grid of hexahedra over the box of a closed surface, for a body that wears this surface
 * (dfm_body_def.surface, cell_inside). Cells with less than 0.15 of the material of a neighbor are left
 * out: what they have belongs to that neighbor, which reaches beyond its borders.
 * @param cells  wanted number, the nearest that the grid gives; 0: by size
 * @param size   m, edge of the cells, about: each side of the box is divided into equal parts; 0: by cells
 * @return DFM_OK; DFM_E_ARG not one of both, size above the longest side of the box, more than 1e6 cells in
 * the box; DFM_E_FORMAT the surface is open, or crosses itself; DFM_E_NOMEM; DFM_E_HANDLE also if it has
 * cells. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_lattice(dfm_mesh_handle surface, uint32_t cells, double size,
                                    dfm_mesh_handle *out);

#ifdef __cplusplus
}
#endif
#endif
