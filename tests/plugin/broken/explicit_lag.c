/* F12: a viscous part that follows the slip within 10 ms, by explicit Euler: it grows without limit at steps
 * beyond 20 ms. */
#include "base.h"

static inline void lagged(struct lane *l, const dfm_friction_in *in, dfm_friction_out *out, uint32_t i) {
  const double follows = 0.01, viscous = 1e-3 * l->cone;
  correct_lane(l);
  for (uint32_t a = 0; a < 2; ++a) {
    const size_t at = (2 + a) * (size_t)in->stride + i;
    const double old = l->fn > 0 ? in->state[at] : 0.0;
    const double lag = l->fn > 0 ? old + l->h / follows * (l->v[a] - old) : 0.0;
    if (out->state) out->state[at] = lag;
    l->f[a] -= viscous * lag;
  }
}

#define EFFECTS NULL
#define FLAGS DFM_FRIC_ISOTROPIC
#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}, {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}
#define LANE(l) lagged(l, in, out, i)
#include "law.h"
