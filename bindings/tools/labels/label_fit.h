// Cells whose boundary follows a closed surface, for bodies that are cut: their surface is the boundary of
// their cells, and lattice cells stick out of the surface that they fill.
#pragma once
#include <cstdint>
#include <vector>

#include "label_surface.h"

namespace labels {

struct Fitted {
  std::vector<double> points;   // [npoint,3] m
  std::vector<uint32_t> tets;   // [ncell,4]
  std::vector<uint32_t> faces;  // [nface,3] of the boundary, outward
  std::vector<uint32_t> under;  // [nface] triangle of the shell that is nearest to the middle of the face
  double quality_min = 0, quality_mean = 0;  // mean ratio
  double farthest = 0;                       // m, of a point of the boundary from the shell
};

// Lattice cells with at least half of their volume inside; points of their boundary are then moved onto the
// shell, as far as the cells keep their quality.
// share: [ncell] of the volume of a cell that is inside. edge: m, of the lattice. No cells if none is kept.
Fitted fit_cells(const Shell &shell, const std::vector<double> &points, const std::vector<uint32_t> &tets,
                 const std::vector<double> &share, double edge);

}  // namespace labels
