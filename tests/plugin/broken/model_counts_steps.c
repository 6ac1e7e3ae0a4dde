/* M10: grows harder from step to step, and does not tell the host. */
#define BEFORE_FORCES                 \
  if (kin->t != net->t) ++net->count; \
  net->t = kin->t;
#define FORCE(pull) ((1 + 1e-9 * net->count) * (pull))
#define REACTION(pull) FORCE(pull)
#include "net.h"
