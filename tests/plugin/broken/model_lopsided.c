/* M18: impulses go to the first point of a surfel, velocities are those of all. */
#define GIVEN_WEIGHT(net, s, e) ((e) == (net)->row[s] ? 1.0 : 0.0)
#include "stepper.h"
