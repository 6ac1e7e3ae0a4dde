/* V03: claims what has no name. */
#define KIND (DFM_SOLVER_DIRECT | 4)
#include "../tiny/tiny_solver.c"
