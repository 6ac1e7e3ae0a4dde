/* Nothing is wrong with it, as with sound.c. */
#include "stepper.h"
