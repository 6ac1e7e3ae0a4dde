// What runs on meshes of several sizes say about a mesh without end (Richardson).
#pragma once
#include <limits>

#include "quantities.h"

namespace cli::cost {

// What the error of the reference is known by.
enum class Basis { order, slow_order, no_order, no_fall, two_meshes, same_mesh, damped };

struct Limit {
  double order = std::numeric_limits<double>::quiet_NaN();  // that three meshes show; NaN: they show none
  bool used = false;  // they show one that can be: the reference is taken on to h = 0 by it
  Basis basis = Basis::two_meshes;
  double error = std::numeric_limits<double>::quiet_NaN();  // of the reference, relative: an estimate
  double bound = std::numeric_limits<double>::infinity();   // what proves; not less than error; inf: nothing
};

// Assumed is x_h(t) = x(t) + C(t) h^p. Then differences of neighbors point the same way at all times, and
// their lengths are as h2^p - h1^p: that gives p. It is used where both are so and p is at least 0.8, first
// order in contact; taken on by is at most 2, the order of linear cells. More shows that the coarsest mesh is
// too coarse, which the error then has: it is how far the same extrapolation from the two coarser meshes is,
// and not less than a quarter of the correction: three figures of one number meet in any order, and the grid
// convergence index of three meshes is 1.25 times the correction (Roache 1994).
//
// Else the finest run is the limit. If p is less, 1.25 times the correction with that p is error and bound.
// Where there is no p, the error is an estimate, as if the finest converged in first order: from its distance
// to each of the others, the larger. Then the bound is three times the largest distance of any two (Eca and
// Hoekstra 2014), if differences fall from coarse to fine as those of a method with p > 0 do; two meshes, and
// three whose differences do not fall, bound nothing.
//
// h: m or of any unit, sizes of cells, rising; two alike: their distance is error and bound. coarse: null
// where there is none. limit: out, the reference.
Limit find_limit(const Quantity &fine, const Quantity &middle, const Quantity *coarse, const double h[3],
                 double scale, Quantity &limit);

}  // namespace cli::cost
