// The energy that the contact of each pair adds to its two sides, or removes. Contact and friction must
// remove energy. Energy added by the solve, a friction law or the response of a body is detected here,
// because the balances of single bodies (step/energy_watch.h) count the work of contact as external.
#pragma once
#include <cstdint>
#include <string>

namespace dfm {

struct StepContext;
struct World;
struct Body;
struct PairWork;

PairWork &work_of(World &w, uint64_t a, uint64_t b);  // of ids; adds one if there is none
// Called at the end of the sub-step, after the work of contact on bodies has been added: step.mean has the
// mean velocities of the dofs.
void book_pairs(World &w, StepContext &step);
// Whether some pair has added more energy than the watch allows.
bool pair_over(const World &w);
// The message that names the pair and its friction law; empty if no pair is over the limit.
std::string tell_pair_gain(const World &w);
// The host changes the body, or (id 0) a friction law. Sums restart only after a stop, because a host may
// change something in every step.
void forget_pairs(World &w, uint64_t id);

}  // namespace dfm
