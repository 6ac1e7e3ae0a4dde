/* M04: an energy with a slip of the pen. */
#define ENERGY(sum) (1.001 * (sum))
#define CELL_ENERGY(sum) (1.001 * (sum))
#include "net.h"
