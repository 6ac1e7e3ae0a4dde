/* V06: cleans its inputs up where they lie. */
#define BEFORE_EVAL \
  for (uint32_t k = 0; k < in->n; ++k) ((double *)in->fn)[k] = in->fn[k] > 0 ? in->fn[k] : 0.0 * in->fn[k];
#include "law.h"
