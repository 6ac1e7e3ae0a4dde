/* M02: springs that stand upright are stiffer, wherever the body has turned them. */
#define CAPS (DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#define STIFFNESS(net, edge, e) ((net)->stiffness * (1 + 0.1 * (e)[2] * (e)[2]))
#include "net.h"
