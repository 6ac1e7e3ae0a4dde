// Rough estimates of work, for budgets and choices.
#pragma once

namespace dfm {

// Work of an implicit sub-step relative to an explicit one of the same body; the second value is for a
// constant matrix. Source: doc/decisions/0170-integrators-by-cost.md.
inline constexpr unsigned kImplicitWork = 50, kConstantWork = 20;
// Multiplications of a triangular solve in the time that an explicit sub-step takes for a point or a cell
// (doc/decisions/0400-auto-goes-by-counts.md).
inline constexpr double kUnitWork = 40;

}  // namespace dfm
