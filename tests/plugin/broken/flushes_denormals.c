/* V11: what -ffast-math does to the program that loads it (crtfastmath.o). */
#if defined(__x86_64__)
#include <xmmintrin.h>
__attribute__((constructor)) static void flush(void) { _mm_setcsr(_mm_getcsr() | 0x8040); }
#endif
#include "law.h"
