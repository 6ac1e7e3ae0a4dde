/* F05: a derivative that lost a factor. */
#include "base.h"

static void half(struct lane *l) {
  correct_lane(l);
  for (int k = 0; k < 4; ++k) l->dv[k] *= 0.5;
}

#define LANE half
#include "law.h"
