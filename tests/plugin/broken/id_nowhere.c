/* V02: its id lies outside of its memory. */
#define ID ((const char *)64)
#include "law.h"
