/* F02: a bristle for each axis, each with its own limit: the cone is a square. */
#include "base.h"

static void square(struct lane *l) {
  const double most = l->cone / l->stiff;
  int slips = 0;
  for (int a = 0; a < 2; ++a) {
    const double z = l->z[a] > most ? most : l->z[a] < -most ? -most : l->z[a], t = z + l->h * l->v[a];
    l->next[a] = t > most ? most : t < -most ? -most : t;
    slips |= l->next[a] != t;
  }
  finish(l, slips);
}

#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define LANE square
#include "law.h"
