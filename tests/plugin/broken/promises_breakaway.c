/* F11: the peak is the kinetic level, at every ramp rate. */
#define EFFECTS "breakaway"
#include "law.h"
