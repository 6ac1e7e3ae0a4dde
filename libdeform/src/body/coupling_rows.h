// What the couplings share: positions about a local origin, the cell that holds a point, and rows
// that sum to one.
#pragma once
#include <optional>

#include "body/coupling.h"
#include "geometry/rest_tree.h"

namespace dfm {

struct RowEntry {
  uint32_t col;
  double weight;
};

// Positions about the first point: differences of neighbors are exact there, so that a body far from the
// world's origin gets the weights that it would have at home.
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
  // The lowest cell that holds x (away 0), else the nearest one (away: how far it is, m; may be null).
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
// Where nothing else determines a row: the cell's, counted in out.outside. Makes the finder
// when first needed.
void append_cell_row(const Memory &memory, const CouplingInput &in, const LocalRest &rest, uint32_t surfel,
                     std::optional<RestCells> &cells, Coupling &out);

}  // namespace dfm
