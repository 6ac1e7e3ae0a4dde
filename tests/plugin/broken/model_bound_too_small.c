/* M13: forgets one end of each spring. */
#define BOUND(k) (0.15 * (k))
#include "net.h"
