/* M03: brakes a body that nothing touches. */
#define KEPT_SPEED 0.9999
#include "stepper.h"
