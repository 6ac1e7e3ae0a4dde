/* M21: dampers that push. */
#define CAPS (DFM_CAP_ENERGY | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#define ON_CREATE net->damper = -net->damper;
#include "net.h"
