// Rows of the parameter table, each one wide.
#pragma once
#include <deform/plugin.h>

namespace reduced {

enum Param : uint32_t {
  kYoung,
  kPoisson,
  kDampingStiffness,
  kDampingMass,
  kModes,
  kFrequency,
  kShare,
  kParamCount
};
extern const dfm_param kParams[kParamCount];

}  // namespace reduced
