/* A shared library that is no plugin; its constructor must not run. */
#define _GNU_SOURCE
#include <stdlib.h>

__attribute__((constructor)) static void constructed(void) { setenv("TINY_NOENTRY_RAN", "1", 1); }
