/* M03: action is more than reaction, at the heavier end of each edge. */
#define CAPS (DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#define MASS(net, end) ((net)->rest[(net)->n + (net)->edges[2 * i + (end)]])
#define FORCE(pull) ((1 + 1e-3 * MASS(net, 0) / (MASS(net, 0) + MASS(net, 1))) * (pull))
#define REACTION(pull) ((1 + 1e-3 * MASS(net, 1) / (MASS(net, 0) + MASS(net, 1))) * (pull))
#include "net.h"
