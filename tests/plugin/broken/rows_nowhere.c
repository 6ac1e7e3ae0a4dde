/* V02: the table lies outside of its memory, as the end of one does whose nparam is far too large. */
#define ROWS ((const dfm_param *)64)
#include "law.h"
