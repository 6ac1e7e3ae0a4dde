/* V12: files of the program become writable for all. Not for Windows: they are there. */
#define _POSIX_C_SOURCE 200809L
#include <sys/stat.h>
__attribute__((constructor)) static void open_up(void) { umask(0); }
#include "law.h"
