// What a contact may be off by at rest (contact/solver.h).
#pragma once
#include <algorithm>

#include "contact/solve_settings.h"
#include "state/world.h"

namespace dfm {

// m/s along the normal, a share of the gap's margin.
inline double normal_at_rest(const Derived &d, double h) { return SolveSettings::gap * (0.5 * d.offset) / h; }
// m/s along the surface, in a sub-step of h seconds.
inline double tangent_at_rest(const Rules &r, const Derived &d, double h) {
  return r.def.contact_tolerance > 0 ? r.def.contact_tolerance
                                     : std::min(SolveSettings::at_rest, normal_at_rest(d, h));
}

}  // namespace dfm
