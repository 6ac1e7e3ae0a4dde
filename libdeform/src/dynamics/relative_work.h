// Rough estimates of work, for budgets and choices.
#pragma once

namespace dfm {

// Work of an implicit sub-step relative to an explicit one of the same body; the second value is for a
// constant matrix. Source: doc/decisions/implicit_time.md.
inline constexpr unsigned kImplicitWork = 50, kConstantWork = 20;
// Multiplications of a triangular solve in the time that an explicit sub-step takes for a point or a cell
// (doc/decisions/implicit_time.md).
inline constexpr double kUnitWork = 25;

// Other work in a sub-step, in units of a point or a cell of springs, from counts of instructions and from
// processor time. A point or a cell of a model, by its id:
double units_of_a_cell(const char *model);
// A contact: its candidates, rows, two answers of a law, one sweep, guard and store. Between two bodies there
// are some ten candidates for each contact.
inline constexpr double kObstacleContactUnits = 30, kBodyContactUnits = 80;
// Of each contact in a further sweep, with its share of a residual; the second value is for surfels that
// answer each other's impulses.
inline constexpr double kSweptUnits = 2, kSweptBlockUnits = 8;

}  // namespace dfm
