/* Waits for a lock that nobody gives back. */
#define _POSIX_C_SOURCE 200809L
#include <unistd.h>
#define BEFORE_EVAL pause();
#include "law.h"
