/* V03: a table of single precision with one function. */
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
static dfm_status prepare(void *self) {
  (void)self;
  return DFM_OK;
}
static const dfm_f32 table = {sizeof(dfm_f32), 0, prepare, NULL};
#define SINGLE &table
#include "net.h"
