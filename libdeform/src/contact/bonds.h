// Bonds of the contact solve: what their impulses must be, for sweeps, Newton's method and residuals.
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

// One sweep: each bond of the part in turn is solved with the impulses that all others have.
void sweep_bonds(ContactRows &rows, const RowsPart &part);

}  // namespace dfm
