/* V12: greets on standard output. */
#include <stdio.h>
__attribute__((constructor)) static void greet(void) { puts("my law 1.0"); }
#include "law.h"
