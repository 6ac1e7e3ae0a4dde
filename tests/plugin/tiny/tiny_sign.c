/* Dry friction as a beginner writes it: mu fn against the sign of the slip, a jump at rest that the law does
 * not say it has. */
#include <math.h>

#include "deform/plugin.h"

static const dfm_param rows[] = {{"mu", "friction coefficient", "1", 0.0, 10.0, 0.5, 0, 1, NULL}};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  uint32_t i, k;
  for (i = 0; i < in->n; ++i) {
    const double x = in->vt[i], y = in->vt[in->stride + i], w = sqrt(x * x + y * y);
    for (k = 0; k < 2; ++k)
      if (out->ft)
        out->ft[k * in->stride + i] =
            w > 0 ? -in->params[0] * in->fn[i] * in->vt[k * in->stride + i] / w : 0.0;
    if (out->limit) out->limit[i] = in->params[0] * in->fn[i];
    if (out->mode) out->mode[i] = 2;
    if (out->stored) out->stored[i] = 0;
  }
  return DFM_OK;
}

#define ID "org.tiny.sign"
#define NEEDS (DFM_NEED_FN | DFM_NEED_VT)
#include "law_type.h"
