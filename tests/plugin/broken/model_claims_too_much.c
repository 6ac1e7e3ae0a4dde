/* V03: claims an energy and has none. */
#define WITH_ENERGY NULL
#include "net.h"
