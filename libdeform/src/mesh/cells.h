// Cells with more nodes than a tetrahedron's corners. Only meshes, the creation of bodies and models know
// them: every such cell is also a few tetrahedra with the same points, and everything else (surface, volume,
// contact, guard, coupling, quality, pictures) works on these.
#pragma once
#include <functional>
#include <span>

#include "math/vec3.h"
#include "mesh/mesh.h"

namespace dfm {

// kind: DFM_CELL_* of plugin.h
struct CellKind {
  uint32_t kind, nodes, tets;
  const char *name;
  uint8_t msh, vtk;   // types of these files
  const char *medit;  // null: not in these files
  // place of each node of an MSH or Medit file in ours; null: the same
  const uint8_t *in_msh, *in_medit;
};
inline constexpr uint32_t kMaxNodes = 27;
// All kinds.
std::span<const CellKind> cell_kinds();
// Throws DFM_E_ARG where the kind is none of these.
const CellKind &cell_kind(uint32_t kind);

// Replaces out[4 tets] by the tetrahedra of one cell. Those of a second-order tetrahedron are four corners
// and four about a diagonal, so that its faces are cut at the middles of the edges; those of a hexahedron
// meet at its least point, and the diagonal of a face starts at the least of its points, so that neighbors
// agree. One of 27 points is eight such hexahedra; of one of 20 points the corners are cut off, and what is
// left is divided likewise.
void tets_of(const CellKind &kind, const uint32_t *cell, uint32_t *out);
Array<uint32_t> tets_of(const Memory &memory, const CellKind &kind, const Array<uint32_t> &cells);

// The order of the nodes of the reflected cell, for kinds other than first-order tetrahedra.
void turn_over(const CellKind &kind, uint32_t *cell);

// Shares of a cell's mass by node, all positive, their sum 1. Of a hexahedron of 8 points the row sums of its
// mass matrix; of one of 27 points what Simpson's rule, whose points are the nodes, gives for these. Those of
// other second-order cells are negative at the corners, so the diagonal is scaled instead (Hinton, Rock,
// Zienkiewicz 1976, A note on mass lumping and related processes).
void mass_shares(const CellKind &kind, const double *points, const uint32_t *cell, double *out);

// Points by which each hexahedron's material is given (dfm_mesh_info.inside), and their place in its
// coordinates.
inline constexpr uint32_t kInsidePoints = 27;
Vec3 inside_place(uint32_t point);
// Shape functions of a cell of 8, 10, 20 or 27 nodes at a place in its coordinates, and their derivatives by
// these: -1 to 1 in a hexahedron; in a tetrahedron 0 to 1 along the edges at its first corner.
void cell_shapes(uint32_t nodes, Vec3 at, double *value, Vec3 *slope);
// Mean ratio of a cell at its worst node: 3 det(T)^(2/3) / |T|^2, negative where it is inverted, T being the
// Jacobian there of the map from a cube or a regular tetrahedron (P. Knupp 2003, Algebraic mesh quality
// metrics for unstructured initial meshes). Of a first-order tetrahedron tet_quality().
double cell_quality(const CellKind &kind, const double *points, const uint32_t *cell);

// Whether a cell that is no first-order tetrahedron is inside out at one of the points by which models
// integrate over it (plugins/model_common/cells.h). Tetrahedra of its points may be while it is not: those at
// a corner, where it is pressed in beyond the middles of its edges.
bool inverted_cell(const CellKind &kind, const double *points, size_t stride, const uint32_t *cell);
// Whether the material of a cell is turned inside out, in its middle.
bool inverted_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside);
// Calls use(volume, place) for each: the sum of volume f(place) is the integral over the material.
void each_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside,
                 const std::function<void(double volume, Vec3 place)> &use);

// The same shape by second-order tetrahedra, or hexahedra of 27 points, whose edges are straight.
RestMesh second_order(const RestMesh &mesh);

}  // namespace dfm
