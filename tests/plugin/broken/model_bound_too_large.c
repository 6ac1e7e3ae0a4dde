/* M13: counts every spring a hundred times. */
#define BOUND(k) (100 * (k))
#include "net.h"
