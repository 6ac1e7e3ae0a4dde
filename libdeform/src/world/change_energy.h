// What changes of its model may put into a body (doc/concepts/changing_models.md). A change leaves positions
// and velocities, so the elastic energy jumps, and to and fro the jumps need not cancel: a body is one that
// is pumped. What they have put in is counted until the body has lost as much: its losses are what work on
// it from outside has put in (step/change_work.h) less what its energy has grown by.
#pragma once
#include "state/body.h"

namespace dfm {

// The book as it is at the present state, with this elastic energy (NaN: none).
ChangeBook look_at_changes(const Body &b, double elastic);
// With the change that the book of before it and the swap tell of. Throws Error, DFM_DISCARD, where jumps
// that nothing has paid for would come to too much.
void check_unpaid(const Body &b, const ChangeBook &before, Swap &swap);
void book_change(const Body &b, ChangeBook &book, const Swap &swap);
// Bodies are at rest: nothing of what changes have put in is left.
void settle_changes(Body &b);

// While it lives the host changes the state of the body, which is work from outside.
class HostWork {
 public:
  explicit HostWork(Body &b);
  HostWork(const HostWork &) = delete;
  HostWork &operator=(const HostWork &) = delete;
  ~HostWork();

 private:
  Body &b_;
  double before_ = 0;
};

}  // namespace dfm
