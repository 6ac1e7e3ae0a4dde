// Loads on a body at rest, without model and contact forces.
#pragma once
#include <vector>

#include "state/body.h"

namespace dfm {

// Time and share of the loads.
struct Station { double time, share; };
inline Station between(const Station &a, const Station &b, double part) {
  return {a.time + part * (b.time - a.time), a.share + part * (b.share - a.share)};
}
// Writes loads, weight and springs at the present positions and w.time into f [npoint,4] N.
void loads_at_rest(const World &w, const Body &b, double *f);
// [npoint] N/m, row sums of the stiffness of these loads.
std::vector<double> softness_of(const Body &b);

// Logs a warning if the weight of a new body presses it flat. The usual causes are a mesh in millimeters and
// a material that was forgotten.
void warn_of_own_weight(const World &w, Body &b);

}  // namespace dfm
