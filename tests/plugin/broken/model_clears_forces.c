/* V06: replaces the forces that others have added. */
#define BEFORE_FORCES \
  for (uint32_t i = 0; i < net->npoint; ++i) memset(f + (size_t)i * kin->stride, 0, 3 * sizeof(double));
#include "net.h"
