/* V11: rounds its forces upward, and leaves it at that. */
#include <fenv.h>
#define AFTER_FORCES fesetround(FE_UPWARD);
#include "net.h"
