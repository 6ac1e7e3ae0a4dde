/* V08: a force that is no number counts as none, so a body of NaN looks as if it were at rest. */
#define AFTER_FORCES                                      \
  for (uint32_t i = 0; i < net->npoint; ++i)              \
    for (int k = 0; k < 3; ++k) {                         \
      double *const at = f + (size_t)i * kin->stride + k; \
      if (*at != *at) *at = 0;                            \
    }
#include "net.h"
