/* V03: a parameter that may change while it runs, and no function for it. */
#define ROW_FLAGS DFM_PARAM_RUNTIME
#include "net.h"
