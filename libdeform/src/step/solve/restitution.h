// Restitution of pairs (doc/concepts/restitution.md): bodies that meet in a sub-step, and that answer an
// impact within it as a whole, leave each other at least at a share of the speed at which they meet, from a
// threshold on. The rows of the solve get it as their bias velocity.
#pragma once

namespace dfm {

struct Body;
struct StepContext;
struct World;

// Finds step.rebound_speed, m/s, from the rows without contact. Empty: no pair has a restitution.
void find_throws(const World &w, StepContext &step);
// After the rows have been finished.
void bounce(StepContext &step);
// Share of the sub-step after which the first body lands that touches nothing: if the sub-step were not cut
// there, the body would turn back before it arrives. 1: none. Before impulses are applied.
double lands_at(const World &w, StepContext &step);
// Whether each contact that presses on the body has a restitution.
bool has_restitution(const World &w, const StepContext &step, const Body &b);

}  // namespace dfm
