/* F03 and others: the square root of a number that is below zero from 1 m/s on. */
#include "base.h"

static void fades(struct lane *l) {
  const double w2 = l->v[0] * l->v[0] + l->v[1] * l->v[1];
  correct_lane(l);
  for (int a = 0; a < 2; ++a) l->f[a] *= sqrt(1 - w2);
}

#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE fades
#include "law.h"
