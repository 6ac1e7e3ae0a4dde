/* V06: reads its own force back, whether it was wanted or not. */
#define LANE correct_lane
#define BEFORE_EVAL \
  if (out->limit && out->ft[0] > 1e300) return DFM_E_FATAL;
#include "law.h"
