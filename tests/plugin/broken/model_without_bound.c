/* V03: adds forces, and nobody knows how long a step may be. */
#define ASKED_BOUND NULL
#include "net.h"
