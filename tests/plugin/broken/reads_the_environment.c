/* V05: a switch in the environment, read in every batch. */
#include <stdlib.h>
#define BEFORE_EVAL \
  if (getenv("BROKEN_LAW_IS_VERBOSE")) return DFM_E_STATE;
#include "law.h"
