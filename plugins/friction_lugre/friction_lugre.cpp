// LuGre friction: an elastic bristle with Stribeck level, micro-damping and viscous part. Canudas de
// Wit, Olsson, Astrom, Lischinsky 1995, (1)-(4); Zerbato 2010, (5.12)-(5.15). Every motion slips: m =
// w in bristle.h.
//
// Constant sigma1 can push: with the published parameters the bristle at F_S and a jump to 0.05 m/s give -6.4
// N. Passive at any speed only where sigma2 >= sigma1 (mu_S - mu_C)/mu_C. The default form sigma1/(1 + sigma1
// A w/(4 g)) equals sigma1 at rest and is passive with any parameters; sigma1 exp(-(w/v_d)^2) (Olsson 1996)
// is where v_d <= 4 F_C/(0.4289 sigma1 A).
#include "../friction_common/lugre_rows.h"

namespace {

constexpr dfm_param kRows[] = {LUGRE_ROWS};

struct Lugre : bristle::Run<Lugre> {
  DEFORM_PASS static bristle::Batch batch(const double *p) { return lugre::batch(p); }
  static constexpr bool kFlat = false;
  DEFORM_PASS static bool flow(const double *, const bristle::Batch &, bristle::Block &) { return false; }
  static constexpr auto check = lanes::check;
  static constexpr auto prepare = lugre::prepare;
  static constexpr auto release = lugre::release;
};

const dfm_friction law = lugre::ops<Lugre>();
const char *const effects[] = {"stribeck", "viscous", "presliding", "hysteresis", "breakaway", nullptr};
const dfm_type type = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.lugre", "LuGre friction: a bristle with Stribeck level and micro-damping",
    "0.1.0", "MIT", "Canudas de Wit et al. 1995, (1)-(4); vector form; passive micro-damping by default",
    kRows, effects, &law);

}  // namespace

DFM_PLUGIN(&type)
