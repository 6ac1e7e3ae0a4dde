/* F04: odd lanes round otherwise, as the tail of a vectorized loop with fused operations would. */
#define LANE(l) (correct_lane(l), (l)->f[0] *= 1 + (i & 1) * 2.3e-16, (l)->f[1] *= 1 + (i & 1) * 2.3e-16)
#include "law.h"
