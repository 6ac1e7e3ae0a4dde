/* V08: a sum over the batch, which one NaN spoils for all. */
#define BEFORE_EVAL \
  double sum = 0;   \
  for (uint32_t k = 0; k < in->n; ++k) sum += 0.0 * in->vt[k];
#define LANE(l) (correct_lane(l), (l)->f[0] += sum)
#include "law.h"
