/* V06: one lane too many. */
#define BEFORE_EVAL \
  if (out->limit) out->limit[(in->n + 7) & ~7u] = 0;
#include "law.h"
