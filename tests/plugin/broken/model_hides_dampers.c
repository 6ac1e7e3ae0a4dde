/* M21: damps and does not say so. */
#define CAPS (DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#include "net.h"
