/* M11: a spring without a length has no direction, and this one does not know. */
#define SHORTEST 0.0
#include "net.h"
