/* F15: a second state, of which the force knows nothing, doubles at every step. */
#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}, {DFM_PER_CONTACT, 1, DFM_SLOT_SCALAR, 0}
#define AFTER_LANE \
  if (out->state) out->state[2 * s + i] = 2 * in->state[2 * s + i] + 1e-9;
#include "law.h"
