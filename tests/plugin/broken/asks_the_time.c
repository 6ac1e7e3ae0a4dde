/* V05: a seed from the clock, the same for all who ask within a second. */
#include <time.h>
#define STEP in->dt + 0 * (double)time(0)
#include "law.h"
