// Faces of a body against a grid of distances. Surfels answer for a face wherever the distance falls toward
// one of its corners; where it falls from the lowest corner into the face, something there is sharper than
// the face, and the face gets one contact of its own at the lowest place.
//
// Limits: one such contact to a face, and what the grid rounds off (everything smaller than a
// cell) is not there.
#include <algorithm>

#include "narrow/detail.h"

namespace dfm::narrow {
namespace {

// of the longest edge: no place of a triangle is further from its nearest corner (1 / sqrt(3))
constexpr double kFarthest = 0.58;
constexpr double kFinest = 0.25;  // of a cell: the grid does not resolve the lowest place better

struct Face {  // in the grid's frame
  const VoxelGrid &grid;
  Vec3 x[3];
  double longest;  // edge
  VoxelGrid::Value at(const double w[3]) const { return grid.at(w[0] * x[0] + w[1] * x[1] + w[2] * x[2]); }
};

// Compass search from a corner: steps along the edges' directions, halved where none leads down. Grids have
// kinks, so no derivative is used.
double lowest_place(const Face &face, double finest, double weight[3], double distance) {
  double best[3] = {weight[0], weight[1], weight[2]};
  for (double step = 0.5; step * face.longest >= finest; step *= 0.5) {
    for (bool moved = true; moved;) {
      moved = false;
      double next[3] = {best[0], best[1], best[2]}, lowest = distance;
      for (int from = 0; from < 3; ++from)
        for (int to = 0; to < 3; ++to) {
          if (from == to || best[from] < step) continue;
          double w[3] = {best[0], best[1], best[2]};
          w[from] -= step;
          w[to] += step;  // sums of powers of two: exact
          const double d = face.at(w).distance;
          if (d < lowest) {
            lowest = d;
            std::copy(w, w + 3, next);
            moved = true;
          }
        }
      std::copy(next, next + 3, best);
      distance = lowest;
    }
  }
  std::copy(best, best + 3, weight);
  return distance;
}

// On an edge, two faces find the same place: it belongs to the one that owns the edge.
bool owned(const Surface &s, uint32_t t, const double w[3]) {
  for (int k = 0; k < 3; ++k)
    if (w[(k + 2) % 3] == 0 && !(s.tri_owns[t] >> (3 + k) & 1)) return false;
  return true;
}

}  // namespace

bool dips(const VoxelGrid &grid, const Vec3 x[3], double most, double dip, double weight[3],
          double &distance) {
  const double longest = std::sqrt(std::max({norm2(x[0] - x[1]), norm2(x[1] - x[2]), norm2(x[2] - x[0])}));
  const Face face{grid, {x[0], x[1], x[2]}, longest};
  int low = 0;
  VoxelGrid::Value at[3];
  for (int k = 0; k < 3; ++k) {
    at[k] = grid.at(x[k]);
    if (at[k].distance < at[low].distance) low = k;
  }
  if (at[low].distance - kFarthest * longest - 0.25 * grid.cell() > most) return false;
  // Linear from the corner on, the distance would fall by so much within the face.
  double fall = 0;
  for (int k = 0; k < 3; ++k) fall = std::min(fall, dot(at[low].gradient, x[k] - x[low]));
  if (fall > -dip) return false;
  std::fill_n(weight, 3, 0.0);
  weight[low] = 1;
  distance = lowest_place(face, kFinest * grid.cell(), weight, at[low].distance);
  return distance < at[low].distance - dip;
}

void voxel_triangle(const Pair &pair, Run run, Array<ContactPoint> &out) {
  const ObstacleShape &shape = *pair.shape;
  const ObstacleView &view = shape.view();
  const double dip = kMinDip * pair.offset;
  const double widest =
      contact_reach(pair.h, pair.offset,
                    largest_speed(*pair.a.surface) + norm(view.velocity) + norm(view.spin) * view.extent);
  for (const Candidate &candidate : run) {
    const std::span<const uint32_t> corner(&pair.a.surface->tri[3 * size_t{candidate.feature_a}], 3);
    const Vec3 x[3] = {pair.xa(corner[0]), pair.xa(corner[1]), pair.xa(corner[2])};
    const Vec3 local[3] = {shape.local(x[0]), shape.local(x[1]), shape.local(x[2])};
    double w[3], distance;
    if (!dips(*view.grid, local, widest, dip, w, distance) || !owned(*pair.a.surface, candidate.feature_a, w))
      continue;
    const Vec3 q = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
    const ObstaclePoint o = shape.closest(q);
    if (!(o.distance < reach_of(pair, corner, o.point))) continue;
    ContactPoint c = blank(pair, kPrimitive, 2, candidate.feature_a, o.face);
    for (int k = 0; k < 3; ++k) add_node(c, pair.a.first_node + corner[k], w[k]);
    finish(pair, c, q, o.point, o.normal, o.distance, o.face, out);
  }
}

}  // namespace dfm::narrow
