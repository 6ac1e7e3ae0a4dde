/* M12: each edge looks at every point. */
#define AFTER_FORCES                    \
  volatile double nearest = 0;          \
  for (uint32_t i = 0; i < net->n; ++i) \
    for (uint32_t j = 0; j < net->npoint; ++j) nearest = nearest + kin->x[(size_t)j * kin->stride];
#include "net.h"
