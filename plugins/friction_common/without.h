// dfm_friction.without for laws with a Stribeck level: without the Stribeck effect mu_S = mu_C, without the
// viscous part sigma2 = 0. The arguments are row numbers of scalar parameters.
#pragma once
#include <cstring>

#include "deform/plugin.h"

namespace without {

template <int kMuC, int kMuS, int kSigma2>
dfm_status level(const char *effect, double *params) {
  if (!std::strcmp(effect, "stribeck")) params[kMuS] = params[kMuC];
  else if (!std::strcmp(effect, "viscous")) params[kSigma2] = 0;
  else return DFM_E_UNSUPPORTED;
  return DFM_OK;
}

}  // namespace without
