/* V03: does not say where its equations are from. */
#define SOURCE ""
#include "law.h"
