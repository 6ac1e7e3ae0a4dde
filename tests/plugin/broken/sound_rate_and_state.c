/* Nothing is wrong with it: friction that goes by the logarithms of the slip speed v and of a state theta
 * (Ruina 1983), in the form of Lapusta et al. 2000 that is finite at v = 0:
 * f = fn a asinh(v/(2 v0) exp((mu + b ln(v0 theta/D))/a)),   d theta/dt = 1 - v theta/D. */
#include "base.h"

static inline void rate_and_state(struct lane *l, const dfm_friction_in *in, dfm_friction_out *out,
                                  uint32_t i) {
  const double a = 0.02, b = 0.03, v0 = 1e-4, distance = 1e-5;
  const size_t at = 2 * (size_t)in->stride + i;
  const double v = sqrt(l->v[0] * l->v[0] + l->v[1] * l->v[1]);
  const double theta = (in->state[at] + l->h) / (1 + l->h * v / distance);
  const double f =
      l->fn * a * asinh(v / (2 * v0) * exp((l->mu + b * log(v0 * theta / distance)) / a)) / (v > 0 ? v : 1);
  for (int k = 0; k < 2; ++k) l->next[k] = l->z[k]; /* the bristle of the base stays where it began: at 0 */
  finish(l, v > 0);
  for (int k = 0; k < 2; ++k) l->f[k] -= f * l->v[k];
  l->limit += INFINITY;
  if (out->state) out->state[at] = theta;
}

#define EFFECTS NULL
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}, {DFM_PER_CONTACT, 1, DFM_SLOT_SCALAR, 0}
#define LANE(l) rate_and_state(l, in, out, i)
#include "law.h"
