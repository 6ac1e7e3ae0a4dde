/* F03: LuGre with a constant sigma1 as published (Canudas de Wit et al. 1995), flagged passive. */
#include "base.h"

static void lugre(struct lane *l) {
  const double w = sqrt(l->v[0] * l->v[0] + l->v[1] * l->v[1]), kinetic = l->cone / 1.5, x = w / 1e-3;
  const double g = kinetic + (l->cone - kinetic) * exp(-x * x), sigma1 = 3.16e-3 * l->stiff;
  project(l);
  const double share = g > 0 ? g / (g + l->h * l->stiff * w) : 0;
  for (int a = 0; a < 2; ++a) l->next[a] = share * (l->z[a] + l->h * l->v[a]);
  finish(l, w > 0);
  for (int a = 0; a < 2 && l->cone > 0; ++a) l->f[a] -= sigma1 * (l->next[a] - l->z[a]) / l->h;
}

#define EFFECTS NULL
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define LANE lugre
#include "law.h"
