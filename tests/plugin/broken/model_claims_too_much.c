/* V03: claims an energy and has none. */
#define ASKED_ENERGY NULL
#include "net.h"
