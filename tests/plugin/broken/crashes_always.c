/* Never answers: every rule that asks it ends by a signal. */
#define BEFORE_EVAL                           \
  volatile uint32_t *volatile nowhere = NULL; \
  *nowhere = 1;
#include "law.h"
