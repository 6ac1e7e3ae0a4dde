// Anderson acceleration (Walker and Ni 2011, type II) of a fixed-point map x -> x + f(x): the next iterate
// starts from the combination of the last few iterates whose f would be smallest. For a linear map this is
// equivalent to GMRES on its equation.
#pragma once
#include <cstdint>

#include "core/memory.h"

namespace dfm {

inline constexpr uint32_t kAndersonWindow = 5;

// Computes the gamma that minimizes |f - sum gamma_j df_j| from the products gram = df_i . df_j and y = df_j
// . f (overwritten), by the normal equations, slightly regularized, and Cholesky. Returns false if the result
// is not usable.
bool least_combination(uint32_t count, const double (*gram)[kAndersonWindow], double *y, double *gamma);

class Anderson {
 public:
  explicit Anderson(const Memory &memory);
  void start(size_t n);
  // f: the change by the map at x. d (output, may be f): from x to the next iterate; equal to f in
  // the first call. weight [n]: weights of the norm.
  void next(const double *x, const double *f, const double *weight, double *d);

 private:
  size_t n_ = 0;
  uint32_t count_ = 0, slot_ = 0;  // columns held, column to write
  bool first_ = true;
  Array<double> x_, f_;    // [n] of the last call
  Array<double> dx_, df_;  // [window,n] differences of successive calls
  double gram_[kAndersonWindow][kAndersonWindow] = {};
};

}  // namespace dfm
