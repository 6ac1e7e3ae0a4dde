// Energy that changes of a body's model have added, and that the body has lost since (world/change_energy.h).
#pragma once

namespace dfm {

// Begins with the first change. Lasting state.
struct ChangeBook {
  bool open = false;
  bool told = false;   // a warning that a change was refused because of the sum has been given
  double unpaid = 0;   // J that changes have put in and that had not been lost by the last look; below 0:
                       // that they have taken out
  double level = 0;    // J, kinetic and elastic energy at the last check
  double work = 0;     // J of external work on the body since
  double largest = 0;  // J, largest energy so far, minus the unpaid part
};

}  // namespace dfm
