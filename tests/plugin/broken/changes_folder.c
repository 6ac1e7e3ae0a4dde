/* V12: goes where its tables lie, and stays there. */
#define _POSIX_C_SOURCE 200809L
#include <unistd.h>
__attribute__((constructor)) static void go(void) {
  if (chdir("/")) return;
}
#include "law.h"
