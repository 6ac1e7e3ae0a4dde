/* V13: goes wrong after two hundred thousand contacts. Kept by thread, where V14 does not look. */
#define BEFORE_EVAL                        \
  static _Thread_local unsigned requested; \
  requested += in->n;                      \
  const double h = requested > 200000 ? in->dt * (1 - 1e-9) : in->dt;
#define STEP h
#include "law.h"
