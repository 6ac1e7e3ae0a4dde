/* V06: takes points for four numbers, whatever the stride is. */
#define AFTER_FORCES \
  for (uint32_t i = 0; i < net->npoint; ++i) f[(size_t)i * kin->stride + 3] = 0;
#include "net.h"
