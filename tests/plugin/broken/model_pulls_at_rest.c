/* M01: springs that are shorter at rest than the edges of the mesh. */
#define REST_LENGTH(length) (0.995 * (length))
#include "net.h"
