// No friction: zero force at every slip. It is a law, so that a frictionless pair is selected like any other.
#include "deform/plugin.hpp"

namespace {

// Zero, except for a lane whose input is not finite, which must not look valid.
dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const size_t stride = in->stride;
  for (uint32_t i = 0; i < in->n; ++i) {
    const double zero = 0.0 * in->fn[i];
    if (out->ft) {
      out->ft[i] = zero;
      out->ft[stride + i] = zero;
    }
    if (out->dft_dvt)
      for (size_t k = 0; k < 4; ++k) out->dft_dvt[k * stride + i] = 0;
    if (out->dft_dfn) {
      out->dft_dfn[i] = 0;
      out->dft_dfn[stride + i] = 0;
    }
    if (out->limit) out->limit[i] = zero;
    if (out->mode) out->mode[i] = in->fn[i] > 0 ? 2 : 0;
    if (out->stored) out->stored[i] = 0;
  }
  return DFM_OK;
}

const dfm_friction law = dfm::plugin::friction(
    DFM_NEED_FN, DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN | DFM_FRIC_NONE, eval);
const char *const effects[] = {nullptr};
const dfm_type none = dfm::plugin::type(DFM_KIND_FRICTION, "org.deform.none", "no friction", "0.1.0", "MIT",
                                        "zero tangential force", effects, &law);

}  // namespace

DFM_PLUGIN(&none)
