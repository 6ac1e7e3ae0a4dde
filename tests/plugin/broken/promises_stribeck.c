/* F07: its force is the same at every speed. */
#define EFFECTS "stribeck"
#include "law.h"
