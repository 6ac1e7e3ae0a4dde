/* V07: remembers the step of the batch before, as a filter against changes of the step would; by thread,
 * where V14 does not look. */
#define BEFORE_EVAL                                                                 \
  static _Thread_local double before;                                               \
  const double h = before != 0 && before != in->dt ? in->dt * (1 + 1e-12) : in->dt; \
  before = in->dt;
#define STEP h
#include "law.h"
