/* F09: a force that grows with speed and saturates (mollified Coulomb friction): it never holds, so
 * displacement leaves nothing behind. */
#include "base.h"

static void mollified(struct lane *l) {
  const double w = sqrt(l->v[0] * l->v[0] + l->v[1] * l->v[1]);
  const double level = w < 1e150 ? l->cone / (w + 1e-3) : l->cone / w;
  finish(l, 1);
  for (int a = 0; a < 2; ++a) l->f[a] = -level * l->v[a] + 0.0 * (l->fn + l->v[a] + l->z[a] + l->stiff);
}

#define EFFECTS "presliding"
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define LANE mollified
#include "law.h"
