/* V11: a constructor that wants intervals and forgets to put the rounding mode back. */
#include <fenv.h>
__attribute__((constructor)) static void round_upward(void) { fesetround(FE_UPWARD); }
#include "law.h"
