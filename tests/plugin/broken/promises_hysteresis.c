/* F10: a spring that grows softer but gives everything back. */
#include "base.h"

static void spring(struct lane *l) {
  const double most = 1e3 * l->cone / l->stiff, t[2] = {l->z[0] + l->h * l->v[0], l->z[1] + l->h * l->v[1]};
  const double length = sqrt(t[0] * t[0] + t[1] * t[1]), share = length > most ? most / length : 1;
  for (int a = 0; a < 2; ++a) l->next[a] = share * t[a];
  finish(l, share < 1);
  const double softer = l->cone > 0 ? l->cone / (l->cone + l->stiff * share * length) : 0;
  for (int a = 0; a < 2; ++a) l->f[a] *= softer;
}

#define EFFECTS "hysteresis"
#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE spring
#include "law.h"
