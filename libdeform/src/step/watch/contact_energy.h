// The energy that contact adds to what touches, or removes. Contact and friction must remove energy. What the
// solve, a friction law or the response of a body adds is detected here, because the balances of single
// bodies (step/watch/energy_watch.h) count the work of contact as external.
#pragma once
#include <string>

namespace dfm {

struct StepContext;
struct World;

// Called at the end of the sub-step, after the work of contact on bodies has been added: step.mean has the
// mean velocities of the dofs.
void book_contact_gain(World &w, const StepContext &step);
// Whether contact has added more energy than the watch allows.
bool contact_over(const World &w);
// The message that names the pair and its friction law; empty if contact is not over the limit.
std::string describe_contact_gain(const World &w);
// The host changes something. Sums restart only after a stop, because a host may change something in every
// step.
void forget_contact_gain(World &w);

}  // namespace dfm
