/* V03: sets the function that has no type yet. */
static void nobody_calls_this(void) {}
#define FREE_PLACE nobody_calls_this
#include "stepper.h"
