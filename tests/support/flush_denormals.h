/* Denormal numbers are zero on this thread from now on. */
#pragma once
#if defined(__x86_64__)
#include <xmmintrin.h>

static inline void flush_denormals(void) { _mm_setcsr(_mm_getcsr() | 0x8040); }
#elif defined(__aarch64__)
static inline void flush_denormals(void) {
  unsigned long control;
  __asm__ volatile("mrs %0, fpcr" : "=r"(control));
  __asm__ volatile("msr fpcr, %0" : : "r"(control | 1ul << 24));
}
#else
static inline void flush_denormals(void) {}
#endif
