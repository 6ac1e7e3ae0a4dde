// Anderson acceleration (Walker and Ni 2011, type II) of a fixed-point map x -> G(x): with f = G(x) - x of
// the last few iterates, the next one is the combination of their results whose f would be least. For a
// linear map this is equivalent to GMRES on its equation.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>

#include "core/memory.h"

namespace dfm {

class Anderson {
 public:
  explicit Anderson(const Memory &memory);
  // weights: of the norm of f. Where its square grows by more than `growth`, the map has changed, and earlier
  // iterates are dropped.
  void start(std::span<const double> weights, double growth = HUGE_VAL);
  // g: G(x). jump (output, may be x): from g to the next iterate. False: that is g.
  bool next(const double *x, const double *g, double *jump);

 private:
  static constexpr uint32_t kWindow = 5;
  uint32_t count_ = 0, slot_ = 0;  // columns held, column to write
  bool first_ = true;
  double last_ = 0, growth_ = 0;  // square of the last f
  Array<double> metric_;          // [n] roots of the weights
  Array<double> f_, g_;           // [n] of the last call, f in the metric
  Array<double> df_, dg_;         // [window,n] differences of successive calls
  double gram_[kWindow][kWindow] = {};

  bool combination(double (&y)[kWindow], double (&gamma)[kWindow]) const;
};

}  // namespace dfm
