/* V12: takes Ctrl-C for itself. */
#include <signal.h>
static void ignore(int number) { (void)number; }
__attribute__((constructor)) static void take(void) { signal(SIGINT, ignore); }
#include "law.h"
