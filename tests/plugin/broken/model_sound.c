/* Nothing is wrong with it, as with sound.c. */
#include "net.h"
