/* F01: a small push along x that is always there. */
#include "base.h"

static void pushes(struct lane *l) {
  correct_lane(l);
  l->f[0] += 1e-4 * l->cone;
}

#define EFFECTS "hysteresis"
#define FLAGS 0
#define LANE pushes
#include "law.h"
