// What the host decides about contacts before they are solved (deform/callback.h).
#pragma once
#include "contact/contact_set.h"

namespace dfm {

struct StepContext;
struct World;

// Asks about every contact of the sub-step, in order, and drops those that are not wanted. Where no function
// is set: nothing.
void ask_pre_solve(World &w, StepContext &step);
// About one more; is it wanted?
bool ask_host(World &w, StepContext &step, const ContactPoint &c);

// While rows are made: laws and scales, before stored contacts are matched; belts, once frames stand.
void take_choices(StepContext &step);
void run_belts(StepContext &step);

}  // namespace dfm
