/* M22: forces in single precision are softer by a percent. */
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
static dfm_status prepare(void *self) {
  (void)self;
  return DFM_OK;
}
static dfm_status single_forces(void *self, const dfm_kin *kin, double *f);
static const dfm_f32 table = {sizeof(dfm_f32), 0, prepare, single_forces};
#define SINGLE &table
#include "net.h"
static dfm_status single_forces(void *self, const dfm_kin *kin, double *f) {
  const Net *net = self;
  for (uint32_t i = 0; i < net->n; ++i) {
    double e[3];
    const double pull = 0.99 * pull_of(net, kin, i, e);
    for (int k = 0; k < 3; ++k) {
      f[(size_t)net->edges[2 * i] * kin->stride + k] += pull * e[k];
      f[(size_t)net->edges[2 * i + 1] * kin->stride + k] -= pull * e[k];
    }
  }
  return DFM_OK;
}
