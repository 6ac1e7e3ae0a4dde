// Slip that no impulse removes. If there are more loaded contacts than touched points, their conditions
// cannot all be met: slightly different normals and inconsistent gaps leave slips, and sweeps keep moving
// impulses between contacts while velocities no longer change (doc/decisions/contact_solver.md).
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
  // Whether there are more loaded contacts than dofs that they touch; or more between cut faces than ways in
  // which the points that they hold move against each other (doc/decisions/contact_solver.md).
  //   cut  [contacts of all parts] whether both sides have cut faces; null: none have
  bool found(const ContactRows &rows, const RowsPart &part, const uint8_t *cut);
  bool found_at_cuts(const ContactRows &rows, const RowsPart &part, const uint8_t *cut);  // the latter
  // Velocities before a plain sweep.
  void note(const ContactRows &rows, const RowsPart &part);
  // After it: whether velocities have not changed. The remaining slip of each contact against its law, up to
  // the largest normal tolerance, is then allowed in this and later solves of the sub-step.
  bool stands(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
              const Tolerance &tolerance);
  // In a later solve, after its own tolerance has been set.
  void allow(const RowsPart &part, const Tolerance &tolerance) const;

 private:
  Array<double> before_;    // [contacts of the part,3] m/s
  Array<double> left_;      // [contacts of the part] m/s, allowed; empty: none yet
  Array<uint8_t> touched_;  // [dofs]
  Array<uint8_t> within_;   // [contacts of the part] hold only points that others hold, too
  // [dofs] contacts that hold it; another dof of its group; of a group's first one: contacts beyond its dofs
  Array<uint32_t> held_, root_;
  Array<int32_t> surplus_;
};

}  // namespace dfm
