/* V01: a helper that is visible to everybody. Built without the version script of deform_add_plugin. */
#include "law.h"

DFM_EXPORT double broken_helper(double x);
double broken_helper(double x) { return x + 1; }
