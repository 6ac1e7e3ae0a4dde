// What pulls at a body that stands still, without its model and its contacts.
#pragma once
#include <vector>

#include "state/body.h"

namespace dfm {

// Loads, weight and springs at the present positions and w.time, into f [npoint,4] N.
void loads_at_rest(const World &w, const Body &b, double *f);
// [npoint] N/m, row sums: how much of that gives way as the points move.
std::vector<double> softness_of(const Body &b);
bool is_free(const Body &b);  // neither held nor on springs

}  // namespace dfm
