/* F03: reports less energy as stored than its bristle gives back. */
#include "base.h"

static void stores_less(struct lane *l) {
  correct_lane(l);
  l->stored *= 0.4;
}

#define LANE stores_less
#include "law.h"
