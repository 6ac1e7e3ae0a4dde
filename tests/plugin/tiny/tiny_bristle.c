/* A law of a third party: an elastic bristle that slides at mu fn (Prandtl's element), without derivatives.
 * Two slots, so that a host that mixes up their columns is seen; the first counts the steps. */
#include <math.h>

#include "deform/plugin.h"

static const dfm_param rows[] = {
    {"mu", "friction coefficient", "1", 0.0, 10.0, 0.5, 0, 1, NULL},
    {"sigma0", "bristle stiffness per area", "N/m^3", 0.0, 1e15, 1e8, 0, 1, NULL}};
static const dfm_slot slots[] = {{DFM_PER_CONTACT, 1, DFM_SLOT_SCALAR, 0},
                                 {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const double mu = in->params[0], sigma = in->params[1];
  const uint32_t s = in->stride;
  uint32_t i;
  for (i = 0; i < in->n; ++i) {
    const double k = sigma * in->area[i], most = mu * in->fn[i];
    double x = in->state[s + i] + in->dt * in->vt[i], y = in->state[2 * s + i] + in->dt * in->vt[s + i];
    const double trial = k * sqrt(x * x + y * y), share = trial > most ? most / trial : 1.0;
    x *= share;
    y *= share;
    if (out->ft) {
      out->ft[i] = -k * x;
      out->ft[s + i] = -k * y;
    }
    if (out->state) {
      out->state[i] = in->state[i] + 1;
      out->state[s + i] = x;
      out->state[2 * s + i] = y;
    }
    if (out->limit) out->limit[i] = most;
    if (out->mode) out->mode[i] = trial > most ? 2 : 1;
    if (out->stored) out->stored[i] = 0.5 * k * (x * x + y * y);
  }
  return DFM_OK;
}

#define ID "org.tiny.bristle"
#define NEEDS (DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA)
#define EFFECTS "presliding", NULL
#define SOURCE "Prandtl 1928"
#define NSLOT 2
#define SLOTS slots
#include "law_type.h"
