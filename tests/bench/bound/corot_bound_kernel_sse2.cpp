#include "model_common/lanes_sse2.h"

#include "corot_bound_lanes.h"

namespace corot_bound {
Kernel plain_sse2() { return corot::plain; }
}  // namespace corot_bound
