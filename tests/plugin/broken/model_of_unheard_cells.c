/* V03: takes a kind of cell that has no name. */
#define CELLS (DFM_CELL_TET | 256)
#include "net.h"
