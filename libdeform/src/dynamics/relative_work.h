// Rough estimates of work, for budgets and choices.
#pragma once

namespace dfm {

// Work of an implicit sub-step relative to an explicit one of the same body; the second value is for a
// constant matrix. Source: doc/decisions/implicit_time.md.
inline constexpr unsigned kImplicitWork = 50, kConstantWork = 20;

}  // namespace dfm
