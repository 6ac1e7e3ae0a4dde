/* M09: springs of points with odd numbers are stiffer. */
#define STIFFNESS(net, edge, e) ((net)->stiffness * (1 + 1e-4 * ((net)->edges[2 * (edge)] & 1)))
#include "net.h"
