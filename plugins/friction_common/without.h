// What laws with a Stribeck level answer to dfm_friction.without: the level does not fall where mu_S = mu_C,
// and nothing grows with speed where sigma2 = 0. Row numbers of parameters one wide.
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
