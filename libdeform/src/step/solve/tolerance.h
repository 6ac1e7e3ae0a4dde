// What a contact may be off by at rest (contact/solver.h).
#pragma once
#include <algorithm>

#include "state/world.h"

namespace dfm {

// m/s along the normal: the gap is then off by less than a hundredth of its margin.
inline double normal_at_rest(const World &w, double h) { return 0.01 * (0.5 * w.offset) / h; }
// m/s along the surface, in a sub-step of h seconds.
inline double tangent_at_rest(const World &w, double h) {
  return w.def.contact_tolerance > 0 ? w.def.contact_tolerance : std::min(1e-6, normal_at_rest(w, h));
}

}  // namespace dfm
