/* V06: sets the step that the host allows to its own limit, where another one may be shorter. */
#define BOUND(k) (*dt = 1, (k))
#include "net.h"
