/* V09: forgets its rest lengths. */
#define ON_DESTROY
#include "net.h"
