// Mass moved to the few points that bound explicit sub-steps, from all points (doc/concepts/step.md).
#pragma once
#include <vector>

#include "body/phyxels.h"

namespace dfm {

// What bounds explicit sub-steps at rest, by point. A point allows 4 m / (c + sqrt(c^2 + 4 m k)).
struct RestRows {
  std::vector<double> stiffness, damping;  // [n] N/m, N s/m; a point that is held has none
};

struct MassScaling {
  double requested = 0;  // share of the body's mass that may move; 0: none
  double moved = 0;      // share that has moved
  double frequency = 0;  // its share, that a mode quadratic in the place may change by
  double step = 0;       // s, that the rows allow with these masses
};

inline constexpr double kMaxScaled = 0.1;  // of the body's mass that may move

double step_of_point(const Phyxels &p, const RestRows &rows, uint32_t point);
// The masses for the longest sub-step that moves no more than this share; those of p where no point bounds by
// itself.
MassScaling scale_mass(const Phyxels &p, const RestRows &rows, double share, std::vector<double> &mass);

}  // namespace dfm
