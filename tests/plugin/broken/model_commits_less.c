/* M14: commit gives less than respond has said. */
#define COMMITTED 0.999
#include "stepper.h"
