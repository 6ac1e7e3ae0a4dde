// Anderson acceleration (Walker and Ni 2011, type II) of a fixed-point map x -> x + f(x): of the last few
// iterates, the combination whose f would be least is taken, and from there the next one. Once a map is
// linear this is GMRES on its equation.
#pragma once
#include <cstdint>

#include "core/memory.h"

namespace dfm {

inline constexpr uint32_t kAndersonWindow = 5;

// gamma that makes |f - sum gamma_j df_j| least, from the products gram = df_i . df_j and y = df_j . f, which
// is overwritten: normal equations by Cholesky, slightly regularized. False: not usable.
bool least_combination(uint32_t count, const double (*gram)[kAndersonWindow], double *y, double *gamma);

class Anderson {
 public:
  explicit Anderson(const Memory &memory);
  void start(size_t n);
  // d: from x, where the map asks for the change f, to the next iterate; equal to f at first. weight [n]: of
  // the norm. d may be f.
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
