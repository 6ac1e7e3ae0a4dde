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
  double t;                // share of the sub-step after which the distance reaches the floor; never late
  double safe;             // up to there the distance stays above the floor by the margin; <= t
  double start;            // m, distance at the start
  double at[3];            // at t: weights of the triangle's corners, or places on edge a and edge b
};

// bodies: by slot; surface->x is the start. end: by slot, [nsurfel,4] positions at the end. Candidates with an obstacle are passed over. out is
// cleared; hits come in the order of the list.
//   floor   m, d_g
//   margin  m, 0.1 (d_c - d_g)
// Returns the least `safe` of all hits, 1 where there are none. Does not allocate once out's capacity has settled.
double guard_pairs(std::span<const BodyView> bodies, std::span<const double *const> end, const Array<Candidate> &candidates, double floor,
                   double margin, Array<GuardHit> &out);

}  // namespace dfm
