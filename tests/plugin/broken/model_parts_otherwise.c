/* M23: the last point is pulled twice as hard. */
#include "parts.h"
static void give_last(dfm_take_part_fn take, void *user, const uint32_t *point, double *f) {
  for (int k = 0; k < 3; ++k) f[k] *= 2;
  take(user, 1, 1, point, f);
}
