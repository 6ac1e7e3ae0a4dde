/* A shared library that is no plugin; its constructor must not run. */
#include <stdlib.h>

__attribute__((constructor)) static void constructed(void) { setenv("TINY_NOENTRY_RAN", "1", 1); }
