/* M05: a stiffness that is a little too small. */
#define ALONG_BLOCK(k) (0.99 * (k))
#include "net.h"
