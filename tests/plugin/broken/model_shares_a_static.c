/* V14: one table for all instances. */
static double shared[4];
#define AFTER_FORCES \
  for (int k = 0; k < 3; ++k) *(volatile double *)&shared[k] = f[k];
#include "net.h"
