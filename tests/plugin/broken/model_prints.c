/* V12: greets. */
#include <stdio.h>
#define ON_CREATE       \
  puts("my model 1.0"); \
  fflush(stdout);
#include "net.h"
