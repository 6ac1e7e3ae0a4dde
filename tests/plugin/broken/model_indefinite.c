/* M05: keeps what makes the stiffness of shortened springs indefinite. */
#define ACROSS_BLOCK(k) (k)
#include "net.h"
