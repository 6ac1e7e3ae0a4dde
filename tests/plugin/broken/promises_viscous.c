/* F08: its force is the same at every speed. */
#define EFFECTS "viscous"
#include "law.h"
