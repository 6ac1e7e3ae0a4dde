// Limit on the energy that changes of its model may add to a body (doc/concepts/changing_models.md). A change
// keeps positions and velocities, so the elastic energy jumps, and repeated changes back and forth could pump
// energy. The added energy counts until the body has lost as much; its loss is the work done on it from
// outside (step/watch/energy_watch.h) minus the growth of its energy.
#pragma once
#include "state/body.h"

namespace dfm {

// J: rounding of positions makes less elastic energy. It is twice that of a strain of sqrt(epsilon).
double rounded_energy(const Body &b);
// The book at the present state, with this elastic energy (NaN: none).
ChangeBook check_changes(const Body &b, double elastic);
// Adds a change, given by the book before it and the swap. Throws Error, DFM_DISCARD, if the unpaid jumps
// would exceed the limit.
void check_unpaid(const Body &b, const ChangeBook &before, Swap &swap);
void book_change(const Body &b, ChangeBook &book, const Swap &swap);
// Bodies are at rest: no added energy is left.
void clear_change_energy(Body &b);

// During its lifetime the host changes the state of the body; the change counts as external work.
class HostWork {
 public:
  explicit HostWork(Body &b);
  HostWork(const HostWork &) = delete;
  ~HostWork();

 private:
  Body &b_;
  double before_ = 0;
};

}  // namespace dfm
