// What contact did between two things over the whole last step: sums and peaks over its sub-steps. The
// store holds the last sub-step alone, so an impact that begins and ends within a step, or peaks before its
// end, is not in it.
#pragma once
#include "state/impulses.h"

namespace dfm {

struct ContactStore;
struct World;
struct WorldState;

void begin_impulses(StepImpulses &s, double start, double length);  // s
// So that these cannot fail: contacts of bodies, pairs of rigid things; most: pairs with a body, all.
void reserve_impulses(StepImpulses &impulses, const WorldState &state, size_t most, size_t contacts,
                      size_t pairs);
void add_impulses(World &w, const ContactStore &s);  // of the sub-step that one of its stores holds
// Before the store changes: adds what sleepers have exchanged in the idle sub-steps up to now.
void end_idle(World &w);
void list_impulses(const World &w, Array<StepImpulses::Pair> &out);

}  // namespace dfm
