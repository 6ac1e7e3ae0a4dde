/* Dry friction without a jump: mu fn w/(w + v_s) against the slip of speed w. v_s is the speed at which half
 * of it acts, so that its default is far from its smallest value. */
#include <math.h>

#include "deform/plugin.h"

static const dfm_param rows[] = {{"mu", "friction coefficient", "1", 0.0, 10.0, 0.5, 0, 1, NULL},
                                 {"v_s", "speed of half the force", "m/s", 1e-6, 10.0, 0.1, 0, 1, NULL}};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  uint32_t i, k;
  for (i = 0; i < in->n; ++i) {
    const double x = in->vt[i], y = in->vt[in->stride + i], w = sqrt(x * x + y * y);
    const double share = in->params[0] * in->fn[i] / (w + in->params[1]);
    for (k = 0; k < 2; ++k)
      if (out->ft) out->ft[k * in->stride + i] = -share * in->vt[k * in->stride + i];
    if (out->limit) out->limit[i] = in->params[0] * in->fn[i];
    if (out->mode) out->mode[i] = 2;
    if (out->stored) out->stored[i] = 0;
  }
  return DFM_OK;
}

static const dfm_friction law = {sizeof(dfm_friction),
                                 DFM_NEED_FN | DFM_NEED_VT,
                                 DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE,
                                 0,
                                 NULL,
                                 eval,
                                 NULL,
                                 NULL,
                                 NULL,
                                 NULL,
                                 0,
                                 0,
                                 NULL};
static const char *const effects[] = {NULL};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_FRICTION,
                              "org.tiny.smooth",
                              "smooth",
                              "1.0",
                              "MIT",
                              "test",
                              rows,
                              2,
                              sizeof(dfm_param),
                              effects,
                              &law};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL;
}
