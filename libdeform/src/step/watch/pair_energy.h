// The energy that the contact of each pair adds to its two sides, or removes. Contact and friction must
// remove energy. Energy added by the solve, a friction law or the response of a body is detected here,
// because the balances of single bodies (step/watch/energy_watch.h) count the work of contact as external.
#pragma once
#include <cstdint>
#include <string>

namespace dfm {

struct StepContext;
struct World;
struct PairWork;

// The ids of two sides, a body first; of two bodies the lower one. They touch by surfels of either of them,
// and these contacts are one pair, whatever side comes first.
struct PairIds {
  uint64_t a = 0, b = 0;
  PairIds() = default;
  PairIds(uint64_t body, uint64_t other, bool obstacle)
      : a(!obstacle && other < body ? other : body), b(a == body ? other : body) {}
};

// What contacts of one pair that follow each other have done in a sub-step.
struct PairMade {
  PairIds ids;
  uint32_t contact = 0;           // the first one
  bool deep = false;              // some of them is nearer than the rest distance
  double made = 0, friction = 0;  // J, beyond what recovery puts in; of the law
};

PairWork &work_of(World &w, PairIds ids);  // adds one if there is none
// Called at the end of the sub-step, after the work of contact on bodies has been added: step.mean has the
// mean velocities of the dofs.
void book_pairs(World &w, StepContext &step);
// Whether some pair has added more energy than the watch allows.
bool pair_over(const World &w);
// The message that names the pair and its friction law; empty if no pair is over the limit.
std::string describe_pair_gain(World &w);
// The host changes the body, or (id 0) a friction law. Sums restart only after a stop, because a host may
// change something in every step.
void forget_pairs(World &w, uint64_t id);

}  // namespace dfm
