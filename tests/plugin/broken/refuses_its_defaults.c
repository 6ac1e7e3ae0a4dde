/* V04: its own check does not take the defaults of its table. */
#include <stdio.h>

#include "deform/plugin.h"

static dfm_status check(const double *params, char *why, size_t cap) {
  if (params[0] > 0.9) return DFM_OK;
  snprintf(why, cap, "mu (%g) must be above 0.9", params[0]);
  return DFM_E_ARG;
}
#define CHECK check
#include "law.h"
