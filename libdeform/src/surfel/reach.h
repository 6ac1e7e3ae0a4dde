// How near two features must be at the start of a sub-step for a contact between them to be made. Shared by broad/, whose lists must cover
// it, and narrow/, which applies it.
#pragma once
#include "surfel/surface.h"

namespace dfm {

// speed: bound of the relative speed, m/s. Twice the motion, because contact impulses turn and bounce what the prediction saw.
inline double contact_reach(double h, double offset, double speed) { return 2 * offset + 2 * h * speed; }
// What one side adds to it: contact_reach(va + vb) = reach_share(va) + reach_share(vb).
inline double reach_share(double h, double offset, double speed) { return offset + 2 * h * speed; }

// A surfel behind a face is pushed back out from no deeper than this: deeper, the nearest face is no longer the one it came through.
inline double recovery_depth(const Surface &faces) { return 0.25 * faces.median_edge; }
// Edges that have slipped through each other are pushed back from a smaller depth: their cones of normals say less than a face does.
inline double edge_recovery_depth(const Surface &a, const Surface &b) { return 0.02 * (a.median_edge < b.median_edge ? a.median_edge : b.median_edge); }

}  // namespace dfm
