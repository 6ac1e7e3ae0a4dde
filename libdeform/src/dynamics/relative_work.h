// Rough numbers, for budgets and choices.
#pragma once

namespace dfm {

// Work of an implicit sub-step over that of an explicit one of the same body; where the matrix stays what it
// is; doc/decisions/0170-integrators-by-cost.md.
inline constexpr unsigned kImplicitWork = 50, kConstantWork = 20;

}  // namespace dfm
