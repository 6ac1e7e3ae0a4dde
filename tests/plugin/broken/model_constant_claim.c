/* M20: claims that a net of springs has a constant stiffness. */
#define CAPS                                                                                               \
  (DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE | \
   DFM_CAP_CONSTANT_STIFFNESS)
#include "net.h"
