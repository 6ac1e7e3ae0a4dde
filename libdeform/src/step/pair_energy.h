// What the contact of each pair puts into the motion of its two sides, or takes from it. Contact and friction
// take energy; what the solve, a friction law or a body's answer to impulses makes is seen here, because the
// balances of single bodies (step/energy_watch.h) take the work of contact for given.
#pragma once
#include <cstdint>
#include <string>

namespace dfm {

struct StepContext;
struct World;
struct Body;
struct PairWork;

PairWork &work_of(World &w, uint64_t a, uint64_t b);  // of ids; a new one where there is none
// After the ends of the sub-step are known, once the work of the bodies' contacts is booked: step.mean has
// the mean velocities of the dofs.
void book_pairs(World &w, StepContext &step);
// Some pair has made more than the watch allows of what is known of the largest energy.
bool pair_over(const World &w);
// The sentence that names the pair, or its friction law; empty where none has made too much.
std::string tell_pair_gain(const World &w);
// The host changes the body, or (0) a friction law. Only what has stopped the run starts anew: a host may
// change something in every step.
void forget_pairs(World &w, uint64_t id);

}  // namespace dfm
