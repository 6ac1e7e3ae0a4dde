/* V06: goes on only where its limit is wanted. */
#include "deform/plugin.h"
static dfm_status rests(const dfm_friction_in *in, dfm_friction_out *out);
#define EVAL rests
#include "law.h"
static dfm_status rests(const dfm_friction_in *in, dfm_friction_out *out) {
  const dfm_status status = eval(in, out);
  for (uint32_t i = 0; !out->limit && out->state && i < in->n; ++i) {
    out->state[i] = in->state[i];
    out->state[in->stride + i] = in->state[in->stride + i];
  }
  return status;
}
