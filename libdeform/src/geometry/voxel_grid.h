// Signed distances of a closed surface on a uniform grid: the distance of a surfel takes constant time for
// structures of any complexity.
//
// Distances at the corners of cells are joined trilinearly; they are kept (as floats, exact at the corners)
// in bricks of 4 x 4 x 4 cells, and only for bricks near the surface, so that memory grows with the
// surface. Elsewhere distances are interpolated between corners of bricks, which is accurate enough far
// outside or deep inside.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

class VoxelGrid {
 public:
  static constexpr uint32_t kBrick = 4, kNodes = (kBrick + 1) * (kBrick + 1) * (kBrick + 1);
  // cells; nearer to the surface than this, distances come from cells, not from bricks
  static constexpr double kBand = 3;

  struct Value {
    double distance;  // m, negative inside
    Vec3 gradient;    // of the interpolation; not a unit vector
  };

  // points [.,3], tris [ntri,3] of a closed surface with an inside, outward. About `cells` cells fill its
  // box. Set-up code.
  VoxelGrid(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris, uint32_t cells);

  Value at(Vec3 p) const;
  // For lists of candidates. False only if no place within `way` of p has a distance below limit - way.
  // Interpolated values change by at most sqrt(3) of a way, since those at corners change by at most a way;
  // their error is at most half the diagonal of the interpolated cell.
  bool near(Vec3 p, double limit) const;

  // Lower bound of the distance near p: no place within `way` of p has a distance below clearance(p) - way.
  double clearance(Vec3 p) const;
  // The first share of the line from `from` at which the distance is not above `limit`; infinity if there is
  // none. Never late.
  double touch(Vec3 from, Vec3 way, double limit) const;

  double cell() const { return cell_; }
  double extent() const;             // m, farthest corner of the surface's box from the frame's origin
  Vec3 low() const { return low_; }  // of the surface, not of the grid
  Vec3 high() const { return high_; }
  uint64_t bytes() const {
    return value_.size() * sizeof(float) + coarse_.size() * sizeof(float) + brick_.size() * sizeof(uint32_t);
  }
  // Largest |distance| at the centers of the surface's triangles, m: if it is far below the size of a cell,
  // the grid resolves the walls.
  double error() const { return error_; }

 private:
  // in: cells within the brick; inside: the nearest place in the grid
  struct Place {
    uint32_t brick[3];
    double in[3];
    Vec3 inside;
  };
  Place place(Vec3 p) const;
  size_t index(const uint32_t b[3]) const { return (size_t{b[2]} * bricks_[1] + b[1]) * bricks_[0] + b[0]; }
  size_t corner(uint32_t i, uint32_t j, uint32_t k) const {
    return (size_t{k} * (bricks_[1] + 1) + j) * (bricks_[0] + 1) + i;
  }
  void build(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris);

  Vec3 origin_, low_, high_;
  // margin: least distance from the surface's box to the grid's border
  double cell_ = 0, per_cell_ = 0, margin_ = 0, error_ = 0;
  uint32_t bricks_[3];
  Array<uint32_t> brick_;  // [bricks] place in value_ over kNodes, or kNone
  Array<float> value_;     // [.,kNodes] x first
  Array<float> coarse_;    // at the corners of bricks
};

}  // namespace dfm
