// What the watch on energies (step/energy_watch.h) keeps between steps.
#pragma once
#include <cstdint>

namespace dfm {

// Of one body. Lasts.
struct EnergyBook {
  uint32_t known = 0;  // looks since the host last changed anything, the first few of which take the base
  double base = 0;     // J, least balance so far, with what the stiff modes may give back
  double work = 0;     // J, since base was first taken
  double kinetic = 0;  // J, after predict, when last looked at
};

inline constexpr uint32_t kMostCredit = 4096;  // sub-steps

// Of the world. Lasts.
struct EnergyWatch {
  // sub-steps without a look, less what looks have cost: new bases wait for it where the host changes
  // something all the time
  uint32_t credit = kMostCredit;
  uint32_t age = ~0u;  // sub-steps since the energies were last looked at
  double last_h = 0;   // s, of the last sub-step
  // the next one is longer or shorter because the step's bound has it so; not state: said anew by each step
  bool new_size = false;
  // the last look has stopped the run because of a pair: what the host changes then starts sums anew; not
  // state
  bool told = false;
};

bool sound(const EnergyBook &e);  // could a world have come to it?
bool sound(const EnergyWatch &e);

}  // namespace dfm
