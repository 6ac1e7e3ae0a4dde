// The host's decisions about contacts before they are solved (deform/callback.h).
#pragma once
#include "contact/contact_set.h"

namespace dfm {

struct StepContext;
struct World;

// Calls the host for every contact of the sub-step, in order, and drops rejected ones. Does nothing without a
// callback.
void call_pre_solve(World &w, StepContext &step);
// The same for one more contact; returns whether it is accepted.
bool query_host(World &w, StepContext &step, const ContactPoint &c);

// While rows are made: laws and scales, before stored contacts are matched; belts, once frames are known.
void take_choices(StepContext &step);
void run_belts(StepContext &step);

}  // namespace dfm
