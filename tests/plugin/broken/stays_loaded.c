/* V09: linked so that it is never unloaded (-z nodelete), as a library with unique C++ symbols is.
 * Not for Windows: its linker has no such option. */
#include "law.h"
