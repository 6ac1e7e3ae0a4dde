/* V08: halves the slip until it is small, which an infinite one never is. */
#include "base.h"

static void hangs(struct lane *l) {
  volatile double w = fabs(l->v[0]);
  while (w > 1) w = 0.5 * w;
  correct_lane(l);
}

#define LANE hangs
#include "law.h"
