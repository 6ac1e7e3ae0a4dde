// What runs on meshes of several sizes say about a mesh without end (Richardson).
#pragma once
#include <limits>

#include "quantities.h"

namespace cli::cost {

struct Limit {
  double order = std::numeric_limits<double>::quiet_NaN();  // that three meshes show; NaN: they show none
  bool used = false;  // they show one that can be: the reference is taken on to h = 0 by it
  double error = std::numeric_limits<double>::quiet_NaN();  // of the reference, relative
};

// Assumed is x_h(t) = x(t) + C(t) h^p. Then differences of neighbors point the same way at all times, and
// their lengths are as h2^p - h1^p: that gives p. It is used where both are so and p is 0.8 to 3, first order
// in contact to what scatters above second; taken on by is at most 2, the order of linear cells. The error is
// how far the same extrapolation from the two coarser meshes is. Else the finest run stands, and its error is
// its distance from the next one times h1 / (h2 - h1), as if they converged in first order, the slowest that
// is seen in contact.
//
// h: m or of any unit, sizes of cells, rising; two alike: their distance is the error. coarse: null where
// there is none. limit: out, the reference.
Limit find_limit(const Quantity &fine, const Quantity &middle, const Quantity *coarse, const double h[3],
                 double scale, Quantity &limit);

}  // namespace cli::cost
