// Bonds of the contact solve. Their impulses have no sign and no law, so all bonds together are one symmetric
// linear system.
#pragma once
#include <cstdint>

#include "contact/rows.h"
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// m/s, what the impulse of the bond in this row leaves of its condition, in the components in which anything
// moves.
Vec3 bond_residual(const ContactRows &rows, uint32_t row);

// Solves all bonds of a part with the impulses of contacts as they are, until no residual is above
// `tolerance`, m/s. Returns how many times it has passed over the bonds.
uint32_t solve_bonds(ContactRows &rows, const RowsPart &part, double tolerance, Array<double> &scratch);

}  // namespace dfm
