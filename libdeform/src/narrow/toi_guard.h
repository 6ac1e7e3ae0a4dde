// What the guard asks of detection: which of the listed feature pairs of two bodies come as near as the floor d_g on the way from the start to the end of
// a sub-step, and how far all of them may safely go. Conservative, vertex-face and edge-edge, on the real motion (after the contact solve).
//
// A pair trips the guard only if its distance reaches d_g itself. The margin then decides where the motion stops: at d_g + margin, an absolute
// distance, since one that is relative to the gap trips on every first touch. A pair that starts nearer than twice the margin stops half way to the
// floor, so it always moves; one that starts at or below the floor may rise, or come down to half of the distance that it has.
#pragma once
#include <cstdint>
#include <span>

#include "core/memory.h"
#include "surfel/views.h"

namespace dfm {

struct GuardHit {
  uint32_t candidate;      // number in the list
  uint32_t part;           // of an obstacle: which of its points or edges (as contacts number them); else 0
  double t;                // share of the sub-step after which the distance reaches the floor; never late
  double safe;             // up to there the distance stays above the floor by the margin; <= t
  double start;            // m, distance at the start
  double at[3];            // at t: weights of the triangle's corners, or places on edge a and edge b
};

// Where an obstacle's pose stands at the end of the sub-step.
struct GuardPose { Vec3 position; Quat rotation; };

// The pairs of the list whose features are nearer to each other at the start than `floor` and their bodies' motion allow; all that the other
// functions need to be asked about.
//   travel, way   m, by body slot: bounds of the way of any surfel in this sub-step; in all committed ones since `rest` was cleared
//   rest          m, by place in the list: sum of ways up to which a pair of bodies stays clear of the floor. Distances are taken only where it is
//                 used up. As long as the list and `floor` stand; empty: nothing is known
void guard_near(std::span<const BodyView> bodies, std::span<const double> travel, std::span<const double> way,
                std::span<const ObstacleView> obstacles, double h, const Array<Candidate> &candidates, double floor, Array<double> &rest,
                Array<uint32_t> &near);

// bodies: by slot; surface->x is the start. end: by slot, [nsurfel,4] positions at the end. Only the pairs of the list that `which` names (ascending);
// those with an obstacle are passed over, and those that touch at the start: what is through already cannot be kept out. out is cleared; hits come
// in the order of the list.
//   floor   m, d_g
//   margin  m, 0.1 (d_c - d_g)
// Returns the least `safe` of all hits, 1 where there are none. Does not allocate once out's capacity has settled.
double guard_pairs(std::span<const BodyView> bodies, std::span<const double *const> end, const Array<Candidate> &candidates,
                   std::span<const uint32_t> which, double floor, double margin, Array<GuardHit> &out);

// The same for pairs with an obstacle, appended to out. In the obstacle's own frame, where it stands still and surfels move on the straight line from
// start to end: for a shape that turns that is another path than in the world, but one that has the same ends. Surfels that start inside the shape
// are let out. ends: by obstacle slot.
double guard_obstacles(std::span<const BodyView> bodies, std::span<const double *const> end, std::span<const ObstacleView> obstacles,
                       std::span<const GuardPose> ends, const Array<Candidate> &candidates, std::span<const uint32_t> which, double floor,
                       double margin, Array<GuardHit> &out);

}  // namespace dfm
