// Planned cuts: at a given time, without a tool (doc/concepts/cutting.md).
#pragma once
#include "cut/cut.h"

namespace dfm {

// Cuts the body now, and separates its parts if the body has this setting. Throws Error.
CutReport make_cut(Body &b, const CutShape &shape, uint32_t how, uint32_t most);

// Plans a cut of the body and of its present pieces. Throws Error if one of them cannot be cut; then nothing
// has changed.
void plan_cut(Body &b, const PlannedCut &cut);
void plan_no_cuts(Body &b);

// At the end of a step of dt: makes the cuts that are due, and warns of those that met nothing.
// Throws Error; a cut that failed stays planned.
void make_planned_cuts(World &w, double dt);

}  // namespace dfm
