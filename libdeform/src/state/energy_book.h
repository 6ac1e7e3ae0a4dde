// Lasting state of the energy watch (step/energy_watch.h).
#pragma once
#include <cstdint>

namespace dfm {

// Of one body. Lasting state.
struct EnergyBook {
  uint32_t known = 0;  // checks since the host last changed anything; the first few set the base
  double base = 0;     // J, least balance so far, plus the energy that stiff modes may return
  double work = 0;     // J, since base was first taken
  double kinetic = 0;  // J, after predict, at the last check
};

inline constexpr uint32_t kMostCredit = 4096;  // sub-steps

// Of the world. Lasting state.
struct EnergyWatch {
  // sub-steps without a check, minus the cost of checks: limits new bases if the host changes something in
  // every step
  uint32_t credit = kMostCredit;
  uint32_t age = ~0u;  // sub-steps since the last check
  double last_h = 0;   // s, of the last sub-step
  // s, planned size of the sub-steps before it changed for the next one; 0: it did not. Not state: set in
  // each step
  double size_before = 0;
  // the last check has stopped the run because of a pair: if the host then changes something, the sums start
  // again; not state
  bool told = false;
};

bool sound(const EnergyBook &e);  // whether a world could have reached it
bool sound(const EnergyWatch &e);

}  // namespace dfm
