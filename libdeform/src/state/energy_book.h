// Lasting state of the energy watch (step/watch/energy_watch.h), and energy that changes of models have
// added.
#pragma once
#include <cstdint>

namespace dfm {

// What is booked for one body. Lasting state.
struct EnergyBook {
  uint32_t known = 0;  // checks since the host last changed anything; the first few set the base
  double base = 0;     // J, least balance so far, plus the energy that stiff modes may return
  double work = 0;     // J, since base was first taken
  double kinetic = 0;  // J, after predict, at the last check
};

// Energy that changes of a body's model have added, and that the body has lost since (world/change_energy.h).
// Begins with the first change. Lasting state.
struct ChangeBook {
  bool open = false;
  bool reported = false;  // a warning that a change was refused because of the sum has been given
  double unpaid = 0;      // J that changes have put in and that had not been lost by the last look; below 0:
                          // that they have taken out
  double level = 0;       // J, kinetic and elastic energy at the last check
  double work = 0;        // J of external work on the body since
  double largest = 0;     // J, largest energy so far, minus the unpaid part
};

inline constexpr uint32_t kMaxCredit = 4096;  // sub-steps

// The watch over the world's energy. Lasting state.
struct EnergyWatch {
  // sub-steps without a check, minus the cost of checks: limits new bases if the host changes something in
  // every step
  uint32_t credit = kMaxCredit;
  uint32_t age = ~0u;  // sub-steps since the last check
  double last_h = 0;   // s, of the last sub-step
  // s, planned size of the sub-steps before it changed for the next one; 0: it did not. Not state: set in
  // each step
  double size_before = 0;
  // J, what contact has put into its sides (step/watch/contact_energy.h): beyond what recovery puts in, since
  // the sum was last zero, and never below; by friction laws that remember, over the run
  double made = 0, rubbed = 0;
  uint64_t side[2] = {};  // ids of the pair that has put in most in the last sub-step in which one did
  // the last check has stopped the run because of contact: if the host then changes something, the sums start
  // again; not state
  bool reported = false;
};

bool is_valid(const EnergyBook &e);  // whether a world could have reached it
bool is_valid(const EnergyWatch &e);

}  // namespace dfm
