// The functions of deprecated.h as symbols, for programs that were linked when a header declared them.
// Compiled apart from other files, in which they are inline.
#include "deform/base.h"

#define DFM_DEPRECATED extern "C" DFM_API
#include "deform/deprecated.h"
