// Slip that no impulse removes (doc/decisions/0361). Where more contacts carry load than points are touched,
// they ask for more than the bodies can do: normals a little askew and gaps that do not quite agree leave
// slips that sweeps answer by moving impulses from one contact to others for ever, while velocities stand.
#pragma once
#include "contact/contact_state.h"
#include "contact/rows.h"
#include "contact/solver.h"

namespace dfm {

class Redundant {
 public:
  explicit Redundant(const Memory &memory);
  // Before the first solve of a sub-step.
  void start() { left_.clear(); }
  // More contacts carry load than dofs are touched by these.
  bool found(const ContactRows &rows, const RowsPart &part);
  // Velocities before a plain sweep.
  void note(const ContactRows &rows, const RowsPart &part);
  // After it: whether it has left velocities as they were. What each contact then slips by against its law,
  // up to the largest normal tolerance, is allowed, here and in later solves of the sub-step.
  bool stands(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
              const Tolerance &tolerance);
  // In a later solve, after its own tolerance has been set.
  void allow(const RowsPart &part, const Tolerance &tolerance) const;

 private:
  Array<double> before_;    // [contacts of the part,3] m/s
  Array<double> left_;      // [contacts of the part] m/s, allowed; empty: none yet
  Array<uint8_t> touched_;  // [dofs]
};

}  // namespace dfm
