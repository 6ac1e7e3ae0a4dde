/* V04: the table allows mu = 0, where it divides 0 by 0. */
#include "base.h"

static void divides(struct lane *l) {
  correct_lane(l);
  l->f[0] *= l->mu / l->mu;
  l->f[1] *= l->mu / l->mu;
}

#define LANE divides
#include "law.h"
