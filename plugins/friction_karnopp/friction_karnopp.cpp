// Karnopp's law: a band of speeds |v| <= dv counts as rest, and there the contact holds whatever stays below
// the static level; what slides faster is braked by kinetic friction alone until it enters the band. The
// set-valued law of stribeck.h with that band. Zerbato 2010, (5.7) corrected: |v| in the test of the band,
// the stick branch saturates at F_S, and a contact that is caught is brought to rest within the step
// (ft_stop), so that nothing creeps at speeds inside the band.
#include "../friction_common/stribeck.h"

namespace {

enum { kDv = stribeck::kShared };
const dfm_param rows[] = {
    stribeck::kRows[0],
    stribeck::kRows[1],
    stribeck::kRows[2],
    stribeck::kRows[3],
    stribeck::kRows[4],
    dfm::plugin::param("dv", "speed below which the contact counts as at rest", "m/s", 1e-12, 10, 1e-3,
                       DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),
};

struct Karnopp : stribeck::Run<Karnopp> {
  static constexpr bool kKineticStop = true;
  static double band(const double *params) { return params[kDv]; }
};

const dfm_friction law = stribeck::ops(lanes::eval<Karnopp>);
const char *const effects[] = {"stiction", "stribeck", "viscous", nullptr};
const dfm_type karnopp = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.karnopp", "Karnopp friction: a band of rest around zero speed", "0.1.0",
    "MIT", "Karnopp 1985; Zerbato 2010, (5.7) corrected: |v|, saturated stick, slip set to zero in the band",
    rows, effects, &law);

}  // namespace

DFM_PLUGIN(&karnopp)
