/* What the broken laws are made from: an elastic bristle that yields on the cone (radial return) keeps
 * every rule of `deform plugin check`. A broken law includes this, says what it does otherwise, and ends
 * with law.h. */
#ifndef BROKEN_BASE_H
#define BROKEN_BASE_H
#include <math.h>
#include <stddef.h>

#include "deform/plugin.h"

/* One contact: what goes in and what comes out. stiff: N/m of the whole contact; cone: N. */
struct lane {
  double fn, h, mu, stiff, cone, v[2], z[2], f[2], next[2], dv[4], dn[2], limit, stored;
  int mode;
};

/* Onto the cone of the new normal force first, so that falling fn leaves no spike. */
static void project(struct lane *l) {
  const double held = l->stiff * sqrt(l->z[0] * l->z[0] + l->z[1] * l->z[1]);
  if (held > l->cone) {
    l->z[0] *= l->cone / held;
    l->z[1] *= l->cone / held;
  }
}

/* What every law ends with: force from the new state; NaN where an input was not finite. */
static inline void finish(struct lane *l, int slips) {
  const double nan_flag = 0.0 * (l->fn + l->v[0] + l->v[1] + l->stiff);
  for (int a = 0; a < 2; ++a) l->f[a] = -l->stiff * l->next[a] + nan_flag;
  l->limit = l->cone + nan_flag;
  l->mode = l->fn > 0 ? (slips ? 2 : 1) : 0;
  l->stored = 0.5 * l->stiff * (l->next[0] * l->next[0] + l->next[1] * l->next[1]);
}

static inline void correct_lane(struct lane *l) {
  const double before = l->stiff * sqrt(l->z[0] * l->z[0] + l->z[1] * l->z[1]);
  project(l);
  const int projected = before > l->cone && l->cone > 0;
  const double t[2] = {l->z[0] + l->h * l->v[0], l->z[1] + l->h * l->v[1]};
  const double trial = l->stiff * sqrt(t[0] * t[0] + t[1] * t[1]);
  const int slips = trial > l->cone;
  const double share = slips ? l->cone / trial : 1.0;
  for (int a = 0; a < 2; ++a) {
    l->next[a] = share * t[a];
    l->dn[a] = slips ? -l->mu * t[a] * l->stiff / trial : 0.0;
    for (int b = 0; b < 2; ++b) {
      const double along = slips ? t[a] * t[b] * l->stiff * l->stiff / (trial * trial) : 0.0;
      const double turned = share * ((a == b) - along);
      l->dv[2 * a + b] = -l->stiff * l->h * turned;
      /* the projected state follows the cone */
      if (projected) l->dn[a] -= turned * l->mu * l->z[b] * l->stiff / l->cone;
    }
  }
  finish(l, slips);
}

/* Dahl's law, exponent 1, implicit: every slip moves the state, so it drifts under vibration. No
 * derivatives. */
static inline void dahl(struct lane *l) {
  const double path = l->h * sqrt(l->v[0] * l->v[0] + l->v[1] * l->v[1]);
  const double share = l->cone > 0 ? l->cone / (l->cone + l->stiff * path) : 0.0;
  for (int a = 0; a < 2; ++a) l->next[a] = share * (l->z[a] + l->h * l->v[a]);
  finish(l, path > 0);
}
#endif
