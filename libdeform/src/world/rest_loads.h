// Loads on a body at rest, without model and contact forces.
#pragma once
#include <vector>

#include "state/body.h"

namespace dfm {

// Writes loads, weight and springs at the present positions and w.time into f [npoint,4] N.
void loads_at_rest(const World &w, const Body &b, double *f);
// [npoint] N/m, row sums of the stiffness of these loads.
std::vector<double> softness_of(const Body &b);
bool is_free(const Body &b);  // no held points and no springs

}  // namespace dfm
