// Cells with more nodes than a tetrahedron's corners. Only meshes, the creation of bodies and models know
// them: every such cell is also a few tetrahedra with the same points, and everything else (surface, volume,
// contact, guard, coupling, quality, pictures) works on these.
#pragma once
#include <functional>

#include "math/vec3.h"
#include "mesh/mesh.h"

namespace dfm {

// kind: DFM_CELL_* of plugin.h
struct CellKind {
  uint32_t kind, nodes, tets;
  const char *name;
  uint8_t msh, vtk;  // types of these files
};
// Throws DFM_E_ARG where the kind is none of these.
const CellKind &cell_kind(uint32_t kind);

// Replaces out[4 tets] by the tetrahedra of one cell. Those of a second-order tetrahedron are four corners
// and four about a diagonal, so that its faces are cut at the middles of the edges; those of a hexahedron
// meet at its least point, and the diagonal of a face starts at the least of its points, so that neighbors
// agree.
void tets_of(const CellKind &kind, const uint32_t *cell, uint32_t *out);
Array<uint32_t> tets_of(const Memory &memory, const CellKind &kind, const Array<uint32_t> &cells);

// Shares of a cell's mass by node, all positive, their sum 1. Of a hexahedron the row sums of its mass
// matrix. Those of a second-order tetrahedron are negative at the corners, so its diagonal is scaled instead
// (Hinton, Rock, Zienkiewicz 1976, A note on mass lumping and related processes).
void mass_shares(const CellKind &kind, const double *points, const uint32_t *cell, double *out);

// Points by which each hexahedron's material is given (dfm_mesh_info.inside), and their place in its
// coordinates.
inline constexpr uint32_t kInsidePoints = 27;
Vec3 inside_place(uint32_t point);
// Shape functions there.
void hexahedron_shapes(Vec3 at, double out[8]);
// Derivatives of the place by the three coordinates there; points [n,stride].
void hexahedron_jacobian(const double *points, size_t stride, const uint32_t *cell, Vec3 at, Vec3 along[3]);
// Whether the material of a cell is turned inside out, in its middle.
bool inverted_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside);
// Calls use(volume, place) for each: the sum of volume f(place) is the integral over the material.
void each_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside,
                 const std::function<void(double volume, Vec3 place)> &use);

// The same shape by second-order tetrahedra whose edges are straight.
RestMesh second_order(const RestMesh &mesh);

// Other order of nodes in an MSH file: place of each of ours.
inline constexpr uint32_t kMshTet10[10] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};

}  // namespace dfm
