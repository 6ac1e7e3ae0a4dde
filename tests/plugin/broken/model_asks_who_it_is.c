/* V07: the same within a process, another in each. */
#define _POSIX_C_SOURCE 200809L
#include <unistd.h>
#define ON_CREATE net->stiffness *= 1 + 1e-12 * (double)(getpid() % 1000);
#include "net.h"
