/* F03: gives F where -F is wanted. */
#include "base.h"

static void forward(struct lane *l) {
  correct_lane(l);
  l->f[0] = -l->f[0];
  l->f[1] = -l->f[1];
}

#define EFFECTS NULL
#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE forward
#include "law.h"
