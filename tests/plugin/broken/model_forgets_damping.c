/* M21: has a parameter for damping and claims it, but not the term. */
#define DAMPER_KEY "damping_stiffness"
#define DAMPER 0
#define ON_CREATE net->damper = 0;
#include "net.h"
