// Detection for the guard: which of the listed feature pairs come nearer than the floor d_g between the start
// and the end of a sub-step, and how far all of them may safely move. Conservative, on the real motion (after
// the contact solve): vertex-face and edge-edge between bodies, within one body, and against meshes;
// closed-form shapes and voxels in their own frames.
//
// A pair triggers the guard only if its distance reaches d_g itself. The margin then decides where the motion
// stops: at d_g + margin, an absolute distance, since a distance relative to the gap would trigger at every
// first contact. A pair that starts nearer than twice the margin stops halfway to the floor, so it always
// moves; one that starts at or below the floor may separate, or approach to half of its distance.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "body/self_rest.h"
#include "core/memory.h"
#include "core/tasks.h"
#include "geometry/views.h"
#include "narrow/list_memory.h"

namespace dfm {

struct GuardHit {
  uint32_t candidate;  // number in the list
  // of an obstacle in closed form: which of its points or edges (as contacts number them); else 0
  uint32_t part;
  double t;      // fraction of the sub-step after which the distance reaches the floor; never late
  double safe;   // up to there the distance stays above the floor by the margin; <= t
  double start;  // m, distance at the start
  double at[3];  // at t: weights of the triangle's corners, or places on edge a and edge b
};

// The pose of an obstacle at the end of the sub-step.
struct GuardPose {
  Vec3 position;
  Quat rotation;
};

// One surface and the end positions of its surfels. Few surfels are near anything, so ends are computed at
// first use.
struct GuardSide {
  const Surface *surface = nullptr;
  bool still = false;
  uint64_t whole = 0;            // of a part of a body that was cut: id of that body (narrow/parts.h)
  const double *mean = nullptr;  // [n,4] m/s of the phyxels: end = start + h mean
  // or: [nsurfel,3] a mesh in its frame, which ends at `pose`
  const double *local = nullptr;
  GuardPose pose;
  double travel = 0;  // m, bounds the way of any surfel
  Vec3 drift;         // m, a way common to all surfels, from which
  double spread = 0;  // m, none differs by more
  // m, none moves by more beyond a rigid motion of all; of bodies that may touch themselves
  double deform = 0;
  const OpenedSurface *opened = nullptr;  // of a body with open faces
  // of its vertex-face and edge-edge candidates, in their order
  const PairAtRest *pairs[2] = {nullptr, nullptr};
  std::vector<uint8_t> held;  // [copies] nothing around them comes too near
  // [nsurfel,4], where `stamp` is the scene's round; of surfels that are set back known from the beginning of
  // the round, as they are set back there
  Array<double> end;
  Array<uint32_t> stamp;
};

// Sides: bodies by slot, then obstacles by slot (those that are not meshes only hold their motion).
struct GuardScene {
  std::span<const BodyView> bodies;
  std::span<const ObstacleView> obstacles;
  std::vector<GuardSide> sides;
  std::vector<GuardPose> poses;  // of obstacles, at the end
  double h = 0, fraction = 1;    // s; of the way, that is taken
  double floor = 0, margin = 0;  // m: d_g, 0.1 (d_c - d_g)
  double offset = 0;             // m, d_c
  uint32_t round = 0;            // ends of earlier rounds are out of date

  GuardSide &side(const Candidate &c, bool second) {
    return sides[!second ? c.slot_a : c.obstacle ? bodies.size() + c.slot_b : c.slot_b];
  }
  // Is the second side a closed-form shape or voxels?
  bool closed_form(const Candidate &c) const {
    return c.obstacle && obstacles[c.slot_b].shape != Shape::mesh;
  }
  const double *end(GuardSide &s, uint32_t surfel) {
    if (s.stamp[surfel] != round) find_end(s, surfel);
    return &s.end[4 * size_t{surfel}];
  }
  void find_end(GuardSide &s, uint32_t surfel);
  Vec3 end_of(const GuardSide &s, uint32_t surfel) const;  // the same, without storing it
};

// The list divided into blocks for workers, and their results. The division depends on the list alone.
struct GuardBlocks {
  struct Range { uint32_t run, begin, end; };  // of the list, within a run
  Array<Range> ranges;
  std::vector<Array<uint32_t>> near;  // by piece
};

// The candidates that may come to the floor, ascending: the other functions need no others.
// Nearly all of a list ends at the first comparison (way + travel + floor < apart), nearly all others at a
// plane that keeps the two features apart at the start and at the end. memory follows the list.
//   blocks, tasks   the same for work on several threads; null: none. Throws std::bad_alloc where a block
//                   has no memory
void guard_near(GuardScene &scene, const Array<Candidate> &list, ListMemory &memory, Array<uint32_t> &near,
                GuardBlocks *blocks = nullptr, Tasks *tasks = nullptr);

// Checks those of the candidates that `which` names that are between two surfaces; those that touch at the
// start are passed over: what is through already cannot be kept out. out is cleared; hits come in the order
// of the list. Does not allocate once out's capacity has settled.
void guard_pairs(GuardScene &scene, const Array<Candidate> &list, std::span<const uint32_t> which,
                 Array<GuardHit> &out);

// The same for closed-form shapes and voxels, appended to out. In the obstacle's own frame, where it stands
// still and surfels move on the straight line from start to end: for a shape that turns that is another path
// than in the world, but one that has the same ends. Surfels that start inside the shape are let out.
void guard_obstacles(GuardScene &scene, const Array<Candidate> &list, std::span<const uint32_t> which,
                     Array<GuardHit> &out);

}  // namespace dfm
