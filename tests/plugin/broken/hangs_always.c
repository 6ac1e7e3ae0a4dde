/* Never answers: every rule that asks it waits. */
#define BEFORE_EVAL            \
  volatile uint32_t round = 1; \
  while (round) round = round % 1000 + 1;
#include "law.h"
