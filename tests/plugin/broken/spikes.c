/* F14: the old state is not projected on the cone of the new normal force. */
#define EFFECTS "presliding", "hysteresis"
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define LANE dahl
#include "law.h"
