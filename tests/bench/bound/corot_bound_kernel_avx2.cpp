#include "model_common/lanes_avx.h"

#include "corot_bound_lanes.h"

namespace corot_bound {
Kernel plain_avx2() { return corot::plain; }
}  // namespace corot_bound
