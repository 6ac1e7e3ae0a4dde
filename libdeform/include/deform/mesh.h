/* deform/mesh.h -- tetrahedral and triangle meshes from files and generators, before they become bodies. */
#ifndef DEFORM_MESH_H
#define DEFORM_MESH_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Reads tetrahedra, also of second order, or hexahedra: MSH 2.2 and 4.1, legacy VTK 2.0 to 5.1, VTU,
 * Medit, Abaqus, TetGen (doc/reference/mesh_files.md). The first bytes, else the ending, tell the format.
 * Memory is bounded by the size of the file.
 * Inverted cells are reversed, unused points and duplicate cells removed, each with a count in a warning of
 * the log and in dfm_tetmesh_info. A cell without volume is refused: it has no rest shape.
 * @return DFM_OK; DFM_E_IO; DFM_E_FORMAT (file, line or byte, what was expected); DFM_E_UNSUPPORTED (how to
 * convert); DFM_E_NOMEM
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_read(dfm_context *context, const char *path, dfm_tetmesh *out);
/** Generators, SI units, with about `cells` tetrahedra: the nearest number that the shape's lattice allows,
 * more if cells would otherwise be longer than twice their width.
 * "cylinder": size = {radius, length, 0}, axis z from 0 to length, base at the origin; "beam": size = {x, y,
 * z} edges from the origin; "bricks": the same of hexahedra; "ball": size = {radius, 0, 0}, about the origin;
 * "tube": size = {inner radius, outer radius, length}, as the cylinder.
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_make(dfm_context *context, const char *kind, const double size[3],
                                    uint32_t cells, dfm_tetmesh *out);
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread, while no other thread uses the mesh or its arrays.
 * Since 0.1. */
DFM_API dfm_status dfm_tetmesh_destroy(dfm_tetmesh mesh);

typedef struct dfm_tetmesh_info {
  /* triangles of the boundary; edges of the cells; connected pieces */
  uint32_t size, npoint, ntet, ntriangle, nedge, npiece;
  uint32_t turned, dropped_points, dropped_cells, flat_cells, duplicate_points, nonmanifold_edges,
      overlapping_faces, ngroup;
  double volume, edge_min, edge_median, edge_max; /* m3, m */
  /* mean ratio, 1 for a regular tetrahedron; bins of 0.1 */
  double quality_min, quality_mean;
  uint32_t quality_histogram[10];
  double lo[3], hi[3];
  /* one sentence a line; valid while the mesh lives */
  const char *warnings;
  /* m: distance that a wave travels in the largest stable explicit step of the wave equation on these cells,
   * by row sums: the least 2 sqrt(m/k) of the points, m a quarter of the cells' volumes, k = sum of
   * V |g_i| |g_j| over cells and their corners, g the gradients of the shape functions */
  double wave_path;
  /* DFM_CELL_* of plugin.h, and how many of these; each is several of the ntet tetrahedra if they are not
   * tetrahedra of first order */
  uint32_t cell, ncell;
} dfm_tetmesh_info;
/** Counts, sizes and repairs, out->size bytes at most. @return DFM_OK; DFM_E_ARG;
 * DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_get_info(dfm_tetmesh mesh, dfm_tetmesh_info *out);
/** Borrowed arrays, valid while the mesh lives: points [npoint,3], tets [ntet,4], file_point [npoint] index
 * in the file, from 0. Each out may be NULL. A body of such tets where dfm_tetmesh_info.cell is another kind
 * needs dfm_tetmesh_cells too. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_data(dfm_tetmesh mesh, const double **points, const uint32_t **tets,
                                    const uint32_t **file_point);
/** Cells of a kind that a model may take, dfm_body_def.cells: [ncell,k] points in the order of plugin.h. The
 * arrays by tetrahedron have each cell as 8 (second-order tetrahedra) or 6 of them (hexahedra) in turn; NULL
 * where the cells are the tetrahedra. Borrowed. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_cells(dfm_tetmesh mesh, uint32_t *kind, const uint32_t **cells);
/** The same shape with second-order tetrahedra: points in the middles of the edges, groups kept. @return
 * DFM_OK; DFM_E_UNSUPPORTED other cells, or those of a filled surface; DFM_E_NOMEM; DFM_E_HANDLE. Threads:
 * Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_second_order(dfm_tetmesh mesh, dfm_tetmesh *out);
/** Physical groups, [ngroup], of all dimensions: name of group k (its number if it has no name);
 * for each cell, its group (UINT32_MAX: none). Each out may be NULL; valid while the mesh lives. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_groups(dfm_tetmesh mesh, const char *const **names,
                                      const uint32_t **cell_group);
/** Triangles of the file that belong to a group, [n,3] points, and the group of each, [n], for
 * dfm_body_def.groups. Some may lie inside the mesh. Each out may be NULL; borrowed. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_triangles(dfm_tetmesh mesh, const uint32_t **triangles, const uint32_t **group,
                                         uint32_t *n);
/** Points of the elements of a group, ascending, for holding or loading a named surface.
 * @param dimension  out, of the group's elements: 0 points, 1 lines, 2 triangles, 3 cells
 * @param points     out, borrowed, [n]. Each out may be NULL
 * @return DFM_OK; DFM_E_ARG no such group; DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_group_points(dfm_tetmesh mesh, uint32_t group, uint32_t *dimension,
                                            const uint32_t **points, uint32_t *n);
/** Writes binary MSH 4.1 ("*.msh"), MSH 2.2 ("*.msh2"), legacy VTK ("*.vtk"), VTU ("*.vtu") or Medit
 * ("*.mesh", groups by number alone) by file name ending, to a temporary file that is then renamed.
 * All formats keep groups of cells and triangles, MSH also groups of points; groups of lines are lost.
 * @return DFM_OK; DFM_E_IO; DFM_E_UNSUPPORTED another ending. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_write(dfm_tetmesh mesh, const char *path);
/** Index of each cell among the file's tetrahedra, [ntet], from 0; NULL if no cell was removed (the order is
 * that of the file). Borrowed.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_file_cells(dfm_tetmesh mesh, const uint32_t **file_cell);
/** Kind of a mesh file: tells whether a body takes its cells from the file or is filled from its surface. */
enum { DFM_MESH_TETS = 1, DFM_MESH_SURFACE = 2 };
/** Kind of a file in any format of dfm_tetmesh_read or dfm_trimesh_read. @param kind out:
 * DFM_MESH_TETS if it has any tetrahedron, else DFM_MESH_SURFACE. @return DFM_OK; as dfm_tetmesh_read.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_file_kind(dfm_context *context, const char *path, uint32_t *kind);
/** Reads a file of either kind once, while dfm_mesh_file_kind followed by dfm_tetmesh_read or
 * dfm_trimesh_read reads it twice.
 * @param cells    out: as dfm_tetmesh_read, if the file has any tetrahedron; else 0
 * @param surface  out: as dfm_trimesh_read, if it has none; else 0
 * @return DFM_OK; as dfm_tetmesh_read (both untouched). Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_mesh_read(dfm_context *context, const char *path, dfm_tetmesh *cells,
                                 dfm_trimesh *surface);

/** Reads a triangle surface: OBJ, PLY, STL, OFF, and the triangles of files of dfm_tetmesh_read (the
 * boundary if such a file has tetrahedra). Polygons are divided into triangles. Coincident points are merged,
 * triangles without area and duplicates removed, and triangles oriented so that neighbors agree and closed
 * pieces face outward. Holes are counted, not closed. Each repair adds one sentence to warnings.
 * @return as dfm_tetmesh_read. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_read(dfm_context *context, const char *path, dfm_trimesh *out);
/** Applies the same repairs to triangles of the host: points [npoint,3] m, triangles [ntriangle,3]. Threads:
 * Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_create(dfm_context *context, uint32_t npoint, const double *points,
                                      uint32_t ntriangle, const uint32_t *triangles, dfm_trimesh *out);
/** Generators of closed surfaces, SI units, about `triangles` near-equilateral triangles: "cylinder",
 * "beam", "ball" and "tube" as for dfm_tetmesh_make; "torus": size = {ring radius, tube radius, 0}, about
 * the origin, axis z.
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_make(dfm_context *context, const char *kind, const double size[3],
                                    uint32_t triangles, dfm_trimesh *out);
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread, while no other thread uses the mesh or its arrays.
 * Since 0.1. */
DFM_API dfm_status dfm_trimesh_destroy(dfm_trimesh mesh);
typedef struct dfm_trimesh_info {
  uint32_t size, npoint, ntriangle, nedge, npiece, ngroup;
  /* repairs */
  uint32_t merged_points, dropped_points, dropped_triangles, turned;
  /* closed: 1 if every edge has two triangles of consistent orientation */
  uint32_t open_edges, holes, nonmanifold_edges, closed;
  /* m2; m3 (signed sum; meaningful for a closed surface); m */
  double area, volume, edge_min, edge_median, edge_max;
  /* 4 sqrt(3) area / sum l2: 1 for an equilateral triangle */
  double quality_min, quality_mean;
  uint32_t quality_histogram[10];
  double lo[3], hi[3];
  /* one sentence a line; valid while the mesh lives */
  const char *warnings;
} dfm_trimesh_info;
/** Counts, sizes and repairs, out->size bytes at most. @return DFM_OK; DFM_E_ARG;
 * DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_get_info(dfm_trimesh mesh, dfm_trimesh_info *out);
/** Borrowed arrays, valid while the mesh lives: points [npoint,3], triangles [ntriangle,3] outward,
 * file_point [npoint] index in the file, from 0. Each out may be NULL. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_data(dfm_trimesh mesh, const double **points, const uint32_t **triangles,
                                    const uint32_t **file_point);
/** Groups of triangles, [ngroup]: physical groups, OBJ groups or materials, PLY and STL solids; per
 * triangle its group (UINT32_MAX none). Each out may be NULL; valid while the mesh lives. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_groups(dfm_trimesh mesh, const char *const **names,
                                      const uint32_t **triangle_group);
/** Writes OBJ, PLY (binary), STL (binary), OFF, legacy VTK or VTU by file name ending, to a temporary
 * file that is then renamed. OBJ, VTK and VTU keep groups, PLY by number. STL has single precision.
 * @return DFM_OK; DFM_E_IO; DFM_E_UNSUPPORTED another ending. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_trimesh_write(dfm_trimesh mesh, const char *path);

/** Fills a closed surface with cells of a lattice. Small holes, flipped and touching triangles are allowed:
 * inside is where the winding number exceeds one half.
 * @param surface  closed except for small holes; else DFM_E_FORMAT, and the error gives the size of the
 * opening
 * @param cells    wanted number of tetrahedra; the result has a number near it. 0: no lattice, cells from one
 * inner point to the triangles, which stay their border, as the model `boundary` takes it; DFM_E_UNSUPPORTED
 * if no point inside sees all triangles
 * @param out      cells that cover the inside; the surface lies within them. dfm_tetmesh_share gives the
 *                 fraction of each that is material
 * @return DFM_OK; DFM_E_ARG cells above 1e8; DFM_E_FORMAT; DFM_E_NOMEM; DFM_E_HANDLE
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_fill(dfm_trimesh surface, uint32_t cells, dfm_tetmesh *out);
/** Fraction of each cell that is material, [ntet], in (0,1]; NULL for a mesh that was not filled. VTK and VTU
 * files store it. Borrowed.
 * @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_share(dfm_tetmesh mesh, const double **share);
/** A coarse regular grid of hexahedra over the box of a closed surface, for a body that wears this surface
 * (dfm_body_def.surface, cell_inside). Cells with less than 0.15 of the material of a neighbor are left
 * out: what they have belongs to that neighbor, which reaches beyond its borders.
 * @param cells  wanted number, the nearest that the grid gives; 0: by size
 * @param size   m, edge of the cells, about: each side of the box is divided into equal parts; 0: by cells
 * @return DFM_OK; DFM_E_ARG not one of both, size above the longest side of the box, more than 1e6 cells in
 * the box; DFM_E_FORMAT the surface is open, or crosses itself; DFM_E_NOMEM; DFM_E_HANDLE
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_lattice(dfm_trimesh surface, uint32_t cells, double size, dfm_tetmesh *out);
/** Material of the cells of a lattice, [ncell,27]: weights w of the 3 x 3 x 3 Gauss points xi of each cell,
 * the first coordinate running fastest, so that the mean over a whole cell of f, counted where there is
 * material, is sum w f(xi), for every f at most quadratic in each of the cell's coordinates. Their sum is the
 * fraction that is material; some may be negative. NULL for other meshes; VTU files store it. Borrowed.
 * @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_tetmesh_inside(dfm_tetmesh mesh, const double **inside);

#ifdef __cplusplus
}
#endif
#endif
