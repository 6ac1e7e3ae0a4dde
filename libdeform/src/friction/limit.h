// The largest friction that a law carries before gross slip, asked at one normal force, without slip and
// without memory.
#pragma once
#include "friction/laws.h"

namespace dfm {

// N at a normal force of fn N; 0: the law has none, or does not answer.
double limit_of(const LawInstance &law, double fn);

}  // namespace dfm
