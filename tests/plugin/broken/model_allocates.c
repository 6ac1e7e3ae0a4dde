/* V05: takes memory in every step. */
#define BEFORE_FORCES                                         \
  void *volatile room = malloc(net->npoint * sizeof(double)); \
  free(room);
#include "net.h"
