/* M19: a diagonal below the response. */
#define DIAGONAL 0.9
#include "stepper.h"
