// The input of the detection stages: plain views of bodies and obstacles, filled by step/ in each sub-step.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

struct BodyView {
  uint32_t slot, first_node;  // body slot in the world; node number of its surfel 0
  uint32_t category, collides_with;
  uint64_t id;  // increases with creation; decides the order, independent of addresses
  // surface->x: start of the sub-step; surface->v: velocity without contact (mean over the sub-step)
  const Surface *surface;
  bool asleep = false;  // x is constant; it can touch only things that are awake or move
  double speed = -1;    // m/s, bound over the surfels; negative: not known
};

enum class Shape : uint8_t { plane = 0, sphere = 1, box = 2, capsule = 3, mesh = 4, voxels = 5, none = 6 };

class VoxelGrid;

struct ObstacleView {
  uint32_t slot;
  uint32_t category, collides_with;
  uint64_t id;
  Shape shape;
  Vec3 position;  // at the start of the sub-step
  Quat rotation;
  Vec3 half_size;                      // box
  double radius = 0, half_length = 0;  // sphere, capsule; capsule axis is local z
  double extent = 0;                   // mesh, voxels: farthest point from position
  const Surface *surface = nullptr;    // mesh: in place, v of the pose alone
  const VoxelGrid *grid = nullptr;     // voxels: in the obstacle's frame
  Vec3 velocity, spin;                 // of the pose over the sub-step, world frame, spin about position
  // the part of `spin` that counts to first order only: what a rigid body's host adds to the spin it
  // starts with. Contact takes most of it back, to first order (its rows are linear); squared it would
  // stay, as creep
  Vec3 linear;
  Vec3 belt;  // velocity_surface: velocity of the surface material, without motion of the shape
  bool moves() const { return norm2(velocity) + norm2(spin) != 0; }
  // Mean over the sub-step, from p to where the turn carries it: (exp(h spin) - 1) r / h to third order. The
  // first term alone is the tangent, and what sticks to a turntable would creep outwards by h spin^2 r / 2.
  Vec3 velocity_at(Vec3 p, double h) const {
    const Vec3 turn = spin - linear;
    const Vec3 first = cross(turn, p - position);
    const Vec3 second = cross(turn, first);
    const Vec3 third = cross(turn, second);
    return velocity + cross(spin, p - position) + (0.5 * h) * second + (h * h / 6) * third + belt;
  }
};

// Feature pairs that may touch while no surfel has moved further than the skin: a superset of all contacts
// until broad/ rebuilds it.
struct Candidate {
  uint32_t slot_a, slot_b;  // slot_b: obstacle slot where obstacle != 0
  // kVertexFace: surfel of a, triangle of b (a may be the higher body); kEdgeEdge: edges, a the lower body id
  uint32_t feature_a, feature_b;
  // obstacle: feature_a is a surfel (kind 0), an edge (kind 1) or a triangle (kind 2); feature_b 0. A mesh:
  // surfel and triangle of the mesh, two edges, vertex of the mesh and triangle of a (kind 2)
  uint8_t kind, obstacle;
};

// One pair of sides, one kind.
inline bool same_run(const Candidate &l, const Candidate &r) {
  return l.slot_a == r.slot_a && l.slot_b == r.slot_b && l.obstacle == r.obstacle && l.kind == r.kind;
}
// Runs are long, and no two have the same sides and kind: steps that double, then halves of the last one.
inline size_t end_of_run(std::span<const Candidate> list, size_t begin) {
  size_t in = begin, step = 1;
  while (in + step < list.size() && same_run(list[in + step], list[begin])) {
    in += step;
    step *= 2;
  }
  const auto first = list.begin() + std::ptrdiff_t(in) + 1;
  const auto last = list.begin() + std::ptrdiff_t(std::min(in + step, list.size()));
  return size_t(
      std::partition_point(first, last, [&](const Candidate &c) { return same_run(c, list[begin]); }) -
      list.begin());
}

// For a Candidate or a ContactPoint: whether a body touches itself.
template <class Pair>
bool of_one_body(const Pair &p) {
  return !p.obstacle && p.slot_a == p.slot_b;
}

}  // namespace dfm
