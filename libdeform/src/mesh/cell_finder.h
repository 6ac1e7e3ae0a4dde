// Finds the cell that holds a place at rest, and its shape functions there.
#pragma once
#include <span>

#include "geometry/rest_tree.h"
#include "mesh/cells.h"

namespace dfm {

// Cells at rest. The arrays stay valid as long as the finder.
struct CellsAtRest {
  uint32_t npoint = 0, ntet = 0;
  const double *point = nullptr;    // [npoint,3] m
  const uint32_t *tet = nullptr;    // [ntet,4]
  const uint32_t *cells = nullptr;  // their nodes, where the tetrahedra are those of other cells
  uint32_t kind = 0;                // DFM_CELL_* of these
};

// Places are relative to the first point: differences of neighbors are exact, so that weights do not depend
// on the distance from the origin of the world.
class CellFinder {
 public:
  CellFinder(const Memory &memory, const CellsAtRest &cells);
  Vec3 local(const double *point) const { return load3(point) - origin_; }
  // The lowest tetrahedron that contains x (away 0), else the nearest one (away: its distance, m).
  uint32_t find(Vec3 x, double &away) const;
  // Barycentric coordinates of x in a tetrahedron, also outside.
  void corner_weights(Vec3 x, uint32_t tet, double w[4]) const;
  // Place of x in the coordinates of a cell that is no first-order tetrahedron, and its shape functions
  // there. False where Newton's method does not get there, far outside a distorted cell.
  bool place(Vec3 x, uint32_t cell, Vec3 &at, double *w) const;
  // The nodes of the tetrahedron's cell and their shape functions at x; corners of the tetrahedron where the
  // cell has no such place. w: [kMaxNodes]
  std::span<const uint32_t> weights(Vec3 x, uint32_t tet, double *w) const;
  // Distance of a place from the cell, in halves of the cell's length.
  double beyond(Vec3 at) const;
  double length2(uint32_t cell) const;  // m2, of its diagonal or of the longest edge at its first corner
  // Cells within this distance of x, ascending.
  void near(Vec3 x, double far2, std::vector<uint32_t> &out) const;

 private:
  void corners(uint32_t tet, Vec3 c[4]) const;

  CellsAtRest in_;
  const CellKind &kind_;
  Vec3 origin_;
  Array<Vec3> point_;
  RestTree tree_;
};

}  // namespace dfm
