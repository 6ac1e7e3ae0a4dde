// An order of elimination that keeps a factor sparse.
#pragma once
#include "math/block_matrix.h"

namespace dfm {

// order[n]: the point eliminated as the k-th. Approximate minimum degree (Amestoy, Davis and Duff 1996) on
// the graph of the points, as Eigen has it: the three components of a point stay together.
void minimum_degree(const BlockPattern &pattern, uint32_t *order);

}  // namespace dfm
