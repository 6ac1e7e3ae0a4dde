/* M23: a part is left out, and its points stay where they were. */
#include "parts.h"
static void give_last(dfm_take_part_fn take, void *user, const uint32_t *point, double *f) {
  (void)take;
  (void)user;
  (void)point;
  (void)f;
}
