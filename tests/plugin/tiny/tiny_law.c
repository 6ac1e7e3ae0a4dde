/* A law in plain C from one header: viscous drag. What a stranger would write. */
#include <math.h>

#include "deform/plugin.h"

static const dfm_param rows[] = {
    {"c", "drag", "N s/m", 0.0, 1e6, 2.0, DFM_PARAM_RUNTIME, 1, NULL},
    {"axis", "a value of three numbers", "1", -1.0, 1.0, 0.25, 0, 3, NULL},
    {"steps", "a whole number", "1", 1.0, 9.0, 4.0, DFM_PARAM_INTEGER, 1, NULL},
};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  uint32_t i, k;
  for (i = 0; i < in->n; ++i)
    for (k = 0; k < 2; ++k)
      if (out->ft) out->ft[k * in->stride + i] = -in->params[0] * in->vt[k * in->stride + i];
  for (i = 0; i < in->n; ++i) {
    if (out->limit) out->limit[i] = HUGE_VAL;
    if (out->mode) out->mode[i] = 2;
  }
  return DFM_OK;
}

static const dfm_friction law = {sizeof(dfm_friction),
                                 DFM_NEED_VT,
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
static const char *const effects[] = {"viscous", "tiny.word", NULL};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_FRICTION,
                              "org.tiny.drag",
                              "drag",
                              "1.0",
                              "MIT",
                              "test",
                              rows,
                              3,
                              sizeof(dfm_param),
                              effects,
                              &law};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  if (!DFM_ABI_OK(host)) {
    host->log(host->ctx, 2, 0, "tiny_law: another ABI");
    return NULL;
  }
  return &plugin;
}
