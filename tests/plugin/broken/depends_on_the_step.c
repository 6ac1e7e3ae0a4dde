/* F17: a friction level that was fitted at one step, with the error divided by dt. */
#include "base.h"

static void fitted(struct lane *l) {
  const double factor = 1 + 1e-4 / l->h;
  l->mu *= factor;
  l->cone *= factor;
  l->stiff *= factor;
  correct_lane(l);
}

#define EFFECTS "hysteresis"
#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE fitted
#include "law.h"
