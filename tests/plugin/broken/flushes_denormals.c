/* V11: what -ffast-math does to the program that loads it (crtfastmath.o). */
#include "../../support/flush_denormals.h"

__attribute__((constructor)) static void flush(void) { flush_denormals(); }
#include "law.h"
