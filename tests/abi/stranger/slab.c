/* A friction law by somebody else, against plugin.h alone: rate-independent dry friction with one level, in
 * the set-valued form: the force that stops the slip while it stays below mu fn, else mu fn against the slip
 * that would follow. */
#include "deform/plugin.h"

#include <math.h>

static const dfm_param params[] = {
    {"mu", "friction coefficient", "1", 0.0, 10.0, 0.3, DFM_PARAM_RUNTIME, 1, NULL}};
static const char *const effects[] = {"stiction", NULL};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  for (uint32_t i = 0; i < in->n; ++i) {
    const double fx = in->ft_stop[i], fy = in->ft_stop[in->stride + i];
    const double limit = in->params[0] * in->fn[i], norm = sqrt(fx * fx + fy * fy);
    const double scale = norm <= limit ? 1.0 : limit / norm;
    if (out->ft) {
      out->ft[i] = scale * fx;
      out->ft[in->stride + i] = scale * fy;
    }
    if (out->limit) out->limit[i] = limit;
    if (out->mode) out->mode[i] = in->fn[i] > 0 ? (norm <= limit ? 1 : 2) : 0;
    if (out->stored) out->stored[i] = 0;
    if (out->dft_dvt)
      for (int c = 0; c < 4; ++c) out->dft_dvt[c * in->stride + i] = 0;
    if (out->dft_dfn)
      for (int c = 0; c < 2; ++c)
        out->dft_dfn[c * in->stride + i] = norm <= limit ? 0 : in->params[0] * (c ? fy : fx) / norm;
  }
  return DFM_OK;
}

static const dfm_friction ops = {sizeof(dfm_friction),
                                 DFM_NEED_FN | DFM_NEED_FT_STOP,
                                 DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_SET_VALUED,
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
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_FRICTION,
                              "com.example.slab",
                              "slab",
                              "1.0",
                              "MIT",
                              "C. A. Coulomb, 1785",
                              params,
                              1,
                              sizeof(dfm_param),
                              effects,
                              &ops};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t abi, uint32_t abi_min) {
  (void)abi;
  (void)abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL;
}
