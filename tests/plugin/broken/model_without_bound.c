/* V03: adds forces, and nobody knows how long a step may be. */
#define WITH_BOUND NULL
#include "net.h"
