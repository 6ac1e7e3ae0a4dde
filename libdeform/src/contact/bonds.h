// Bonds of the contact solve. Their impulses have neither sign condition nor law, so all bonds together form
// one symmetric linear system.
#pragma once
#include <cstdint>

#include "contact/rows.h"
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// m/s, residual of the bond in this row, in the components that can move.
Vec3 bond_residual(const ContactRows &rows, uint32_t row);

// Lowers the limit of the drag in this row to where it does no more work than is left. It is never raised
// again in a solve: of a drag that could stop the edge or let it pass there would be two answers.
void limit_drag(ContactRows &rows, uint32_t row);

// Solves all bonds of a part with fixed contact impulses, until no residual is above `tolerance`, m/s.
// Returns the number of passes over the bonds.
uint32_t solve_bonds(ContactRows &rows, const RowsPart &part, double tolerance, Array<double> &scratch);

}  // namespace dfm
