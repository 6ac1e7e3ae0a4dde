// Shared by the couplings: positions about a local origin, the cell that contains a point, rows that sum to
// one.
#pragma once
#include <optional>

#include "body/coupling.h"
#include "geometry/rest_tree.h"

namespace dfm {

struct RowEntry {
  uint32_t col;
  double weight;
};

// Positions relative to the first point: differences of neighbors are exact, so the weights do not depend on
// the distance from the origin of the world.
struct LocalRest {
  Array<Vec3> point, surfel;
  LocalRest(const Memory &memory, const CouplingInput &in);
};

// Barycentric coordinates of x in the tetrahedron c, refined once so that sum w c = x to rounding in
// cells of any shape.
void tet_weights(Vec3 x, const Vec3 c[4], double w[4]);

class RestCells {
 public:
  RestCells(const Memory &memory, const CouplingInput &in, const LocalRest &rest);
  // The lowest cell that contains x (away 0), else the nearest one (away: its distance, m; may be null).
  uint32_t find(Vec3 x, double *away = nullptr) const;
  // The row of a surfel at x, from the cell that find() gives; returns away.
  double row(Vec3 x, RowEntry out[4]) const;

 private:
  const CouplingInput &in_;
  const LocalRest &rest_;
  Array<RestBox> box_;
  RestTree tree_;
};

// Appends a row: entries ascending by column, zeros left out, the last weight moved by the bits that the
// sum lacks of one.
void append_row(Coupling &out, RowEntry *entries, size_t n);
Coupling empty_coupling(const Memory &memory, uint32_t nsurfel);
// The row of the nearest cell, if nothing else determines it; counted in out.outside. Makes the finder at
// first use.
void append_cell_row(const Memory &memory, const CouplingInput &in, const LocalRest &rest, uint32_t surfel,
                     std::optional<RestCells> &cells, Coupling &out);

}  // namespace dfm
