/* M16: shares springs among the cells and counts some twice. */
#define CELL_ENERGY(sum) (1.2 * (sum))
#include "net.h"
