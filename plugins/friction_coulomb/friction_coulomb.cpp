// Coulomb friction with stiction, Stribeck effect and viscous part, as true stick and slip (never smoothed at
// zero speed): the set-valued law of stribeck.h with no band of rest. Zerbato 2010, (5.1)-(5.6), as an
// inclusion at w = 0 and odd in v; the implicit step is the projection on the disc of radius F_S.
#include "../friction_common/stribeck.h"

namespace {

struct Coulomb : stribeck::Run<Coulomb> {
  static constexpr bool kKineticStop = false;
  static double band(const double *) { return 0; }
};

const dfm_friction law = stribeck::ops(lanes::eval<Coulomb>);
const char *const effects[] = {"stiction", "stribeck", "viscous", nullptr};
const dfm_type coulomb = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.coulomb",
    "Coulomb friction with stiction, Stribeck effect and viscous part", "0.1.0", "MIT",
    "Zerbato 2010, (5.1)-(5.6) corrected: set-valued at rest, odd in v", stribeck::kRows, effects, &law);

}  // namespace

DFM_PLUGIN(&coulomb)
