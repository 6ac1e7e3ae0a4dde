// Writes what it is told to: "value" 0 a number, 1 a NaN, 2 an infinity, into the output "where"
// (an enumeration).
#include <cmath>

#include "deform/plugin.hpp"

namespace {
namespace dp = dfm::plugin;
const char *const outputs[] = {"ft", "dft_dvt", "dft_dfn", "limit", "stored", "state", nullptr};
const char *const values[] = {"number", "nan", "infinity", nullptr};
const dfm_param rows[] = {dp::enumeration("where", "output that is spoilt", outputs, 0),
                          dp::enumeration("value", "what is written", values, 0)};
const dfm_slot slots[] = {{DFM_PER_CONTACT, 1, DFM_SLOT_SCALAR, 0}};

dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  double *const all[] = {out->ft, out->dft_dvt, out->dft_dfn, out->limit, out->stored, out->state};
  const uint32_t width[] = {2, 4, 2, 1, 1, 1};
  for (int o = 0; o < 6; ++o)
    for (uint32_t c = 0; all[o] && c < width[o]; ++c)
      for (uint32_t i = 0; i < in->n; ++i) dp::column(all[o], in->stride, c)[i] = 0;
  double *spoilt = all[static_cast<int>(in->params[0])];
  if (spoilt) spoilt[in->n - 1] = in->params[1] == 1 ? NAN : in->params[1] == 2 ? HUGE_VAL : 1.0;
  return DFM_OK;
}

const dfm_friction law = {sizeof(dfm_friction),
                          0,
                          0,
                          1,
                          slots,
                          dp::guarded<eval>,
                          nullptr,
                          nullptr,
                          nullptr,
                          nullptr,
                          0,
                          0,
                          nullptr};
const dfm_type type =
    dp::type(DFM_KIND_FRICTION, "org.tiny.nan", "nan", "1.0", "MIT", "test", rows, nullptr, &law);
}  // namespace
DFM_PLUGIN(&type)
