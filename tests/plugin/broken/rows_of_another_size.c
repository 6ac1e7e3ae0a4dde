/* V03: rows are read where none begins. */
#define PARAM_SIZE (sizeof(dfm_param) + 8)
#include "law.h"
