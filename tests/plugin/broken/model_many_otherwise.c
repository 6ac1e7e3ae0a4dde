/* M18: many impulses at once have other answers. */
#define MANY 1.001
#include "stepper.h"
