// The body-centered cubic lattice for filling surfaces, and the cells of it that a surface needs.
//
// Unit of length is half the pitch h of the grid: grid points have even coordinates, centers of the cubes odd
// ones. A cell spans two neighboring grid points along axis b and two neighboring centers along axis a, at
// distance 1 along axis c; its volume is 2/3 (h^3/12). Its key is twice its center, a vector of integers: 0
// mod 4 along a, 2 mod 4 along b, odd along c. All cells are congruent (mean ratio 0.95).
#pragma once
#include <cstdint>
#include <functional>

#include "geometry/winding.h"
#include "mesh/mesh.h"

namespace dfm {

struct Site { int32_t x = 0, y = 0, z = 0; };
inline Vec3 place_of(Site s) { return {double(s.x), double(s.y), double(s.z)}; }

inline constexpr double kLatticeCell = 2.0 / 3;    // volume
inline constexpr int32_t kLatticeReach = 1 << 20;  // keys and sites lie within
inline uint64_t pack(Site s) {
  return uint64_t(uint32_t(s.x + kLatticeReach)) << 42 | uint64_t(uint32_t(s.y + kLatticeReach)) << 21 |
         uint32_t(s.z + kLatticeReach);
}
inline Site unpack(uint64_t p) {
  constexpr uint64_t kMask = (1u << 21) - 1;
  return {int32_t(p >> 42 & kMask) - kLatticeReach, int32_t(p >> 21 & kMask) - kLatticeReach,
          int32_t(p & kMask) - kLatticeReach};
}

void corners_of(Site key, Site corner[4]);  // two grid points, then two centers; positive volume
Site neighbor(Site key, uint32_t face);     // across the face opposite that corner of corners_of

// A tetrahedron with its planes, for overlaps with triangles.
struct TetShape {
  Vec3 corner[4], normal[4];  // unit normals, outward
  double offset[4];           // of the planes
  explicit TetShape(const Vec3 c[4]);
  // Whether the triangle comes within `tolerance` (below 0: enters deeper than that). Separating axes.
  bool meets(const Vec3 triangle[3], double tolerance) const;
};

// Set of packed keys that remembers the order of insertion; numbers are positions in it.
class KeySet {
 public:
  explicit KeySet(const Memory &memory);
  uint32_t add(uint64_t key, bool *is_new = nullptr);
  uint32_t find(uint64_t key) const;  // UINT32_MAX: not there
  uint32_t size() const { return uint32_t(keys_.size()); }
  uint64_t operator[](uint32_t i) const { return keys_[i]; }

 private:
  size_t slot(uint64_t key) const;
  Array<uint64_t> keys_;
  Array<uint32_t> table_;
};

// mixed: no triangle, yet the winding number passes 1/2 (a hole)
enum class LatticeCell : uint8_t { outside, inside, crossed, mixed };

// Surface in a frame of its own: about the middle of its box, in lengths of the box.
struct FillSurface {
  explicit FillSurface(const RestMesh &surface);
  const Memory &memory;
  // diagonal of the box, m; rounding of a coordinate, in box lengths
  double size = 0, resolution = 0;
  Vec3 middle;                  // of the box, m
  double area = 0, volume = 0;  // by the triangles, in box lengths
  bool closed = true;           // every edge is passed as often forth as back
  // of all openings; longest extent of the widest one. Box lengths
  double opening_area = 0, opening_width = 0;
  uint32_t openings = 0;
  Array<double> points;  // box lengths
  Array<uint32_t> tris;
  WindingTree winding;

 private:
  void measure_openings();
};

// Where the lattice lies: box lengths are half_pitch * (lattice lengths - shift).
struct Lattice {
  double half_pitch = 1;
  Vec3 shift;
  Vec3 to_box(Vec3 x) const { return half_pitch * (x - shift); }
  Vec3 from_box(Vec3 x) const { return (1 / half_pitch) * x + shift; }
};

// Cells that the surface needs: those that a triangle enters, and those inside. A triangle in a face between
// two cells enters neither.
struct FillCover {
  explicit FillCover(const Memory &memory) : cells(memory), kind(memory) {}
  KeySet cells;
  // by number; outside for cells that were only tested
  Array<LatticeCell> kind;
  uint32_t kept = 0;
  // false: stopped, because of more than `limit` cells or too much work
  bool complete = true;
  // stopped because of the work: long triangles in a lattice that is far too fine for them
  bool hopeless = false;
};
// `limit`: largest number of cells. Work is bounded by the triangles and the limit, independent of positions.
FillCover cover(const FillSurface &surface, const Lattice &lattice, uint32_t limit);

// Calls visit(cell's key, triangle, deep) for every cell within the touch tolerance of a triangle, a pair
// perhaps more than once; deep: the triangle enters the cell by more than that. Cells in `skip` are not
// tested. visit returns false to stop. Tests `work` pairs of a triangle's piece and a cell at most, and gives
// back what is left: 0 where that did not suffice.
using VisitCrossing = std::function<bool(uint64_t key, uint32_t triangle, bool deep)>;
uint64_t each_crossing(const FillSurface &surface, const Lattice &lattice, const KeySet *skip, uint64_t work,
                       const VisitCrossing &visit);
// What `cells` cells and the triangles of a surface may cost. A piece of a triangle is no longer than three
// lattice units and is tested against some
// 150 cells; a triangle of ordinary shape has as many pieces as cells, a sliver as many as it is lattice
//     units long: some hundred are granted.
inline uint64_t crossing_work(const FillSurface &surface, uint64_t cells) {
  return 16384 * (surface.tris.size() / 3) + 1024 * cells;
}
double touch_tolerance(const FillSurface &surface, const Lattice &lattice);

// Share of each kept cell that is inside, before any floor. `loose` is the part of the cell that was decided
// by one sample for each of its pieces of `piece` cells: sums of shares have a standard deviation below
// sqrt(piece * sum of loose) / 2.
struct FillShares {
  Array<double> share, loose;
  double piece;
};
FillShares sample_shares(const FillSurface &surface, const FillCover &cover, const Lattice &lattice);

}  // namespace dfm
