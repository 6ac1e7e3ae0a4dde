/* V03: nothing to call. */
#define EVAL NULL
#include "law.h"
