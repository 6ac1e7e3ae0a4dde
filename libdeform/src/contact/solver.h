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

// Residual in m/s of the whole state against the linearised laws (inner) or, right after the laws were asked at this state, the true ones.
struct Residual { double normal = 0, tangent = 0; double max() const { return normal > tangent ? normal : tangent; } };
Residual inner_residual(const ContactRows &rows, const ContactState &law, double h);
Residual true_residual(const ContactRows &rows, const ContactState &answer, double h);

}  // namespace dfm
