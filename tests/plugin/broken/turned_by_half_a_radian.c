/* F16: the force lies half a radian off the slip, as after a sign lost in a change of axes. */
#include "base.h"

static void turned(struct lane *l) {
  correct_lane(l);
  const double c = cos(0.5), s = sin(0.5), x = l->f[0], y = l->f[1];
  l->f[0] = c * x + s * y;
  l->f[1] = c * y - s * x;
}

#define EFFECTS "presliding"
#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE turned
#include "law.h"
