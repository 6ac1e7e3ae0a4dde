// Cuts to come, by time and without a tool (doc/concepts/cutting.md).
#pragma once
#include "world/cut.h"

namespace dfm {

// Cuts the body now, and separates its parts if the body has this setting. Throws Error.
CutReport make_cut(Body &b, const CutShape &shape, uint32_t how, uint32_t most);

// Of the body, and of the pieces that it has by now. Throws Error if one of them cannot be cut, and then
// nothing has changed.
void plan_cut(Body &b, const PlannedCut &cut);
void plan_no_cuts(Body &b);

// At the end of a step of dt: makes the cuts whose time has come, and warns of those that have met nothing.
// Throws Error; the cut that fails is still to come.
void make_planned_cuts(World &w, double dt);

}  // namespace dfm
