// The first attempt at a contact problem: sweeps on the linearized laws, accelerated, in passes over the laws
// (doc/concepts/contact.md). Newton's method (contact/newton.h) goes on where they do not suffice.
#pragma once
#include "contact/newton.h"
#include "contact/solver.h"
#include "math/anderson.h"

namespace dfm {

// Anderson acceleration of sweeps over a part of the rows: of its impulses, in the metric of the operator's
// diagonal.
class AcceleratedImpulses {
 public:
  explicit AcceleratedImpulses(const Memory &memory);
  void start(const ContactRows &rows, const RowsPart &part);  // before the first sweep
  void follow(ContactRows &rows, const RowsPart &part);       // after a sweep that another one follows

 private:
  Anderson anderson_;
  Array<double> from_, to_, jump_;  // [rows,3], of the part one after the other
};

struct SweepLimits {
  uint32_t sweeps, passes;
  double start;  // m/s, the residual at the start
};

// The sweeps of one part of the rows, with what they keep between solves. Where contacts are nearly redundant
// (vertex-face beside edge-edge, two bodies' grids on each other) a sweep converges slowly, and acceleration
// helps. The state that is used is always one that a plain sweep has left.
class Sweeps {
 public:
  explicit Sweeps(const Memory &memory);
  // From rows.impulse, with the laws evaluated there and their slopes known. True: rows and `left` are the
  // result, because it is good enough, or a law has failed, or the budget is used up. False: Newton's method
  // is to go on from rows.
  bool solve(ContactRows &rows, const RowsPart &part, ContactState &state, SolveLaws &laws,
             const Tolerance &tolerance, const SweepLimits &limits, double h, Residual &left);
  uint32_t count() const { return count_; }  // of the last solve

 private:
  ContactRows *rows_ = nullptr;
  const RowsPart *part_ = nullptr;
  ContactState *state_ = nullptr;
  SolveLaws *laws_ = nullptr;
  const Tolerance *tolerance_ = nullptr;
  double h_ = 0;
  uint32_t count_ = 0, most_ = 0;
  AcceleratedImpulses acceleration_;
  Array<double> start_;  // [rows,3] impulses of the part at the start

  void sweep_once();
  bool pass();
  bool good(const Residual &left, double fraction) const;
};

}  // namespace dfm
