// The arithmetic of a corotational cell alone, for corot_kernel_bench.cpp: gradients, constants and forces
// lie in the order in which they are used, nothing is gathered or added up.
#pragma once
#include <stdint.h>

#include "model_corotational_fem/corot_kernel.h"

namespace corot_bound {

struct Cells {
  uint32_t groups;
  const corot::Group *group;
  const double *gradient;  // [groups,2,9,4]
  double *force;           // [groups,2,9,4]: of corners 1 to 3
};
using Kernel = void (*)(const Cells &);
Kernel plain_sse2();
Kernel plain_avx2();
Kernel plain_avx512();

}  // namespace corot_bound
