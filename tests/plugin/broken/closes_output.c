/* V12: closes a stream that it did not open. */
#define _POSIX_C_SOURCE 200809L
#include <unistd.h>
__attribute__((constructor)) static void shut(void) { close(1); }
#include "law.h"
