// Contact whose friction limits are fixed (Tresca friction), for a solve that has run away.
//
// Coulomb's law ties the limit of a contact to its normal impulse. In a jam with much friction block
// Gauss-Seidel then need not converge, and the impulses that it leaves can do any amount of work. If the
// limits are fixed, the impulses l minimize
//
//     J(l) = l.W l / 2 + l.(u0 + b)     over l_n >= 0, |l_t| <= limit
//
// with the velocities u0 without impulses and the bias velocities b. J and the set are convex, so no sweep
// increases J (Kikuchi and Oden 1988, Contact problems in elasticity, chapter 10). From l = 0, where J = 0,
// any number of sweeps ends with J <= 0. The work of the impulses is l.W l / 2 + l.u0 = l.(u0 + u) / 2, so
// contacts then do no more work than -l.b, which the bias velocities put in by opening depths.
#pragma once
#include <cstdint>

#include "contact/contact_state.h"
#include "contact/rows.h"
#include "core/memory.h"

namespace dfm {

// J of the present impulses of a part, and sum |l.(u0 + b)| over its rows as the scale of J; both in joules.
struct ExcessWork { double work = 0, scale = 0; };
ExcessWork excess_work(const ContactRows &rows, const RowsPart &part);

// Sets the impulses of the part to zero.
void drop_impulses(ContactRows &rows, const RowsPart &part);

// limit [contacts of the part] N s: the limits of the laws, as last evaluated, in proportion to the present
// normal impulses.
void fix_limits(const ContactRows &rows, const RowsPart &part, const ContactState &law, Array<double> &limit);

// One sweep over the contacts of the part with these limits, in their order.
void sweep_fixed(ContactRows &rows, const RowsPart &part, const double *limit);

}  // namespace dfm
