/* M04: an energy of the state at t, and forces of the state at t + dt. */
#include "deform/plugin.h"

static const dfm_slot one = {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0};
static double later(const dfm_kin *kin) { return (kin->state[0] + kin->dt) / (1 + kin->dt); }
#define NSLOT 1
#define SLOTS &one
#define DAMPER 0
#define CAPS (DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#define BEFORE_FORCES \
  if (kin->state_out) kin->state_out[0] = later(kin);
#define FORCE(pull) ((1 + later(kin)) * (pull))
#define REACTION(pull) FORCE(pull)
#define ALONG_BLOCK(k) ((1 + later(kin)) * (k))
#define ACROSS_BLOCK(k) ((k) > 0 ? (1 + later(kin)) * (k) : 0)
#define ENERGY(sum) ((1 + kin->state[0]) * (sum))
#define CELL_ENERGY(sum) ENERGY(sum)
#define BOUND(k) (2 * (k))
#include "net.h"
