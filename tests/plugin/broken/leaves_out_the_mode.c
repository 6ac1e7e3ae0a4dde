/* V06: does not write an output that is wanted. */
#include "deform/plugin.h"
static dfm_status forgets(const dfm_friction_in *in, dfm_friction_out *out);
#define EVAL forgets
#include "law.h"
static dfm_status forgets(const dfm_friction_in *in, dfm_friction_out *out) {
  dfm_friction_out all_but_mode = *out;
  all_but_mode.mode = NULL;
  return eval(in, &all_but_mode);
}
