// Parameters that lugre and elastoplastic share, their cross-field rule, and the warning about a form of
// micro-damping that can push.
#pragma once
#include "bristle.h"
#include "without.h"

namespace lugre {

enum { kMuC, kMuS, kVs, kDelta, kSigma0, kSigma1, kForm, kVd, kSigma2, kShared };
constexpr const char *kForms[] = {"passive", "constant", "falling", nullptr};

#define LUGRE_ROWS                                                                                           \
  CURVE_ROWS,                                                                                                \
      dfm::plugin::param("sigma0", "bristle stiffness per area", "N/m^3", 1, 1e15, 1e8,                      \
                         DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),                                           \
      dfm::plugin::param("sigma1", "bristle damping per area", "N s/m^3", 0, 1e12, 1e5, DFM_PARAM_RUNTIME),  \
      dfm::plugin::enumeration("sigma1_form", "how sigma1 falls with speed", lugre::kForms,                  \
                               bristle::kPassive),                                                           \
      dfm::plugin::param("v_d", "speed at which sigma1 of the form falling is e times smaller", "m/s", 1e-9, \
                         1e3, 0.01, DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),                                \
      dfm::plugin::param("sigma2", "viscous friction per area", "N s/m^3", 0, 1e12, 0, DFM_PARAM_RUNTIME)

inline bristle::Batch batch(const double *p) {
  return {0,      p[kMuC],   p[kMuS], p[kVs], p[kDelta], p[kSigma0], p[kSigma1], static_cast<int>(p[kForm]),
          p[kVd], p[kSigma2]};
}

constexpr int32_t kWarning = 2;  // DFM_LOG_WARNING of base.h, which plugins do not include

// The largest push of constant micro-damping, compared with the viscous part that must brake it; `excess` as
// in the law's flow.
inline void warn(const dfm_host *host, const double *p, double excess, const char *as) {
  char text[320] = "";
  const int form = static_cast<int>(p[kForm]);
  const double sigma1 = p[kSigma1], present = p[kSigma2] * p[kMuC];
  if (form == bristle::kConstant && excess > present)
    std::snprintf(text, sizeof text,
                  "with these parameters LuGre friction with constant sigma1 can add energy: it needs sigma2 "
                  "mu_C >= sigma1 %s, and %g < %g (sigma1 %g, sigma2 %g, mu_C %g, mu_S %g); \"sigma1_form\": "
                  "\"passive\" is safe with any parameters",
                  as, present, excess, sigma1, p[kSigma2], p[kMuC], p[kMuS]);
  if (form == bristle::kFalling && sigma1 > 0)
    std::snprintf(text, sizeof text,
                  "falling sigma1 is passive only where v_d <= 4 mu_C p/(0.4289 sigma1), that is above a "
                  "contact pressure p of %g Pa (sigma1 %g, v_d %g, mu_C %g); \"sigma1_form\": \"passive\" is "
                  "safe at any pressure",
                  0.4289 * sigma1 * p[kVd] / (4 * p[kMuC]), sigma1, p[kVd], p[kMuC]);
  if (*text && host && host->log) host->log(host->ctx, kWarning, 0, text);
}

// Prepares nothing; logs the warning, because a law may log here.
inline dfm_status prepare(const dfm_host *host, const double *p, void **data) {
  *data = nullptr;
  warn(host, p, p[kSigma1] * (p[kMuS] - p[kMuC]), "(mu_S - mu_C)");
  return DFM_OK;
}

inline void release(const dfm_host *, void *) {}

template <class Law>
constexpr dfm_friction ops() {
  dfm_friction f = bristle::ops<Law>();
  f.without = without::level<kMuC, kMuS, kSigma2>;
  return f;
}

}  // namespace lugre
