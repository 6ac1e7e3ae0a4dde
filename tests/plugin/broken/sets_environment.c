/* V12: tells a library under it how many threads to use, by the environment.
 * Not for Windows: setenv() */
#define _POSIX_C_SOURCE 200809L
#include <stdlib.h>
__attribute__((constructor)) static void set(void) { setenv("OMP_NUM_THREADS", "1", 1); }
#include "law.h"
