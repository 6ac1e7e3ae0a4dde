/* Nothing is wrong with it, and it takes no first-order tetrahedra. */
#define CELLS DFM_CELL_TET10
#include "net.h"
