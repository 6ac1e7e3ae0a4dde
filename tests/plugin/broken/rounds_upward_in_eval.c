/* V11: the same in eval. */
#include <fenv.h>
#define BEFORE_EVAL fesetround(FE_UPWARD);
#include "law.h"
