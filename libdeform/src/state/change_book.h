// What changes of a body's model have done to its energy, and what it has lost since
// (world/change_energy.h).
#pragma once

namespace dfm {

// Opened by the first change. Lasts.
struct ChangeBook {
  bool open = false;
  bool told = false;   // that a change was refused for the sum
  double unpaid = 0;   // J that changes have put in and that had not been lost by the last look; below 0:
                       // that they have taken out
  double level = 0;    // J, kinetic and elastic energy at the last look
  double work = 0;     // J that was done on the body from outside since
  double largest = 0;  // J, largest energy that it has had, less what was unpaid
};

}  // namespace dfm
