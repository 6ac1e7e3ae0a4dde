/* V09: gives a piece of the host's memory back twice. */
#define ON_DESTROY                                                              \
  void *const piece = net->host->alloc(net->host->ctx, 64, 8);                  \
  for (int k = 0; k < 2; ++k) net->host->release(net->host->ctx, piece, 64, 8); \
  free(net->rest);
#include "net.h"
