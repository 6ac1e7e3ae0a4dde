/* V03: nparam counts a row that the table does not have. Zeros lie there, to be the same everywhere. */
#define NPARAM 3
#include "law.h"
