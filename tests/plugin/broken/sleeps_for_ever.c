/* Waits for a lock that nobody gives back. Not for Windows: pause() */
#define _POSIX_C_SOURCE 200809L
#include <unistd.h>
#define BEFORE_EVAL pause();
#include "law.h"
