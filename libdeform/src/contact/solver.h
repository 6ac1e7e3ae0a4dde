// Normal contact and friction of one sub-step: inner sweeps of block Gauss-Seidel on the laws as they were linearised by the last outer
// pass. The outer loop (which asks the laws) is world/solve.cpp; the mathematics is doc/concepts/contact.md.
#pragma once
#include "contact/rows.h"
#include "surfel/contact_state.h"

namespace dfm {

// Sets the trial of every contact from the rows' present state: fn, vt, ft_stop.
void set_trial(const ContactRows &rows, double h, ContactState &state);

// One sweep in contact order. Every contact first gets its normal impulse, then its friction impulse with that new normal impulse.
void sweep(ContactRows &rows, const ContactState &law, double h);

// Anderson acceleration of the sweeps (Walker and Ni 2011, type II). A sweep is a fixed-point map G; where contacts are nearly redundant
// (vertex-face beside edge-edge, two bodies' grids on each other) it converges linearly and slowly. With f = G(lambda) - lambda of the last
// few sweeps, the next iterate is the combination of their results whose f would be least, in the metric of the operator's diagonal; once the
// active set stands this is GMRES on the linear system. The state that is used is always one that a plain sweep has left.
class Acceleration {
 public:
  explicit Acceleration(const Memory &memory);
  void start(const ContactRows &rows);         // before the first sweep of a pass
  void follow(ContactRows &rows);              // after a sweep that another one follows

 private:
  static constexpr uint32_t kWindow = 8;
  uint32_t n_ = 0, count_ = 0, next_ = 0;      // values, columns held, column to write
  bool first_ = true;
  double last_ = 0;
  Array<double> metric_;                       // [n] square roots of the diagonal
  Array<double> from_;                         // [n] iterate that the last sweep started from
  Array<double> f_, g_;                        // [n] of the last sweep, f in the metric
  Array<double> df_, dg_;                      // [window,n] differences of successive f and g
  double gram_[kWindow][kWindow] = {};
  bool combine(const double *f, double *gamma) const;
};

// Residual in m/s of the whole state against the linearised laws (inner) or, right after the laws were asked at this state, the true ones.
struct Residual { double normal = 0, tangent = 0; double max() const { return normal > tangent ? normal : tangent; } };
Residual inner_residual(const ContactRows &rows, const ContactState &law, double h);
Residual true_residual(const ContactRows &rows, const ContactState &answer, double h);

}  // namespace dfm
