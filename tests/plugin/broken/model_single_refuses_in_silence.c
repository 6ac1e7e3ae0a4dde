/* M22: has no single precision after all, and does not say why. */
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
static dfm_status prepare(void *self) {
  (void)self;
  return DFM_E_UNSUPPORTED;
}
static dfm_status single_forces(void *self, const dfm_kin *kin, double *f) {
  (void)self;
  (void)kin;
  (void)f;
  return DFM_E_STATE;
}
static const dfm_f32 table = {sizeof(dfm_f32), 0, prepare, single_forces};
#define SINGLE &table
#include "net.h"
