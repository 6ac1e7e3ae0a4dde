/* V05: takes memory in eval. */
#include <stdlib.h>
#define BEFORE_EVAL                                     \
  void *volatile room = malloc(in->n * sizeof(double)); \
  free(room);
#include "law.h"
