// Islands of the contact solve: contacts and bonds that feel each other's impulses within the sub-step,
// because they share an unknown: a point, or a body whose points answer each other. Rows of the same two
// sides stay together. Each island is solved by itself, with its own acceleration and end of sweeps; what
// the warm start leaves at a body sets the tolerances in all of its islands. So the answer of bodies that
// touch each other is the one of a world in which they are alone, and several threads may solve several
// islands.
#pragma once
#include <exception>
#include <limits>
#include <span>
#include <vector>

#include "contact/proximal.h"
#include "contact/redundant.h"
#include "contact/solver.h"
#include "contact/tresca.h"
#include "friction/laws.h"
#include "step/budget.h"
#include "step/islands.h"

namespace dfm {

struct StepContext;
struct World;

// What an island does for its bodies' sake between two solves (solve.cpp).
enum class Revised { nothing, something, diverged, failed };

struct SolveIsland {
  RowsPart part;
  bool revises = false;  // some body of it looks again at what the solve has made of it
  bool rigid = false;    // some body of it is of a rigid host
  bool soft = false;     // points of some body of it answer each other
  double effort = 0;     // of a sweep (Spent)
  LawBatches batches;
  Acceleration acceleration;
  Momentum momentum;
  Proximal proximal;
  Redundant redundant;
  Tresca tresca;
  Tolerance tolerance;
  Array<double> scratch;  // of solve_bonds()
  Array<double> limit;    // [contacts of the part] N s, fixed limits of friction
  // of the last solve
  Residual residual;
  uint32_t passes = 0, sweeps = 0;
  bool slowed = false;     // its depths are opened more slowly
  bool stalls = false;     // sweeps have ended at the cap in this sub-step, and another method has not
  bool waits = false;      // for another response, by which that method is possible
  bool backs = true;       // that method may be tried
  bool stuck = false;      // it was, and has found nothing
  bool common = false;     // laws are asked by the response of all contacts together
  uint32_t asked = 0;      // passes beyond the cap with the present response
  double affordable = -1;  // sweeps beyond the cap; < 0: not known yet
  // of the last two passes (Residual::due)
  double due, due_before;
  Spent spent;
  const LawInstance *bad = nullptr;  // that has failed
  std::exception_ptr thrown;
  // of all solves of the sub-step
  bool open = true;  // it is to be solved
  Revised revised = Revised::something;
  uint32_t all_passes = 0, all_sweeps = 0, again = 0, capped = 0;

  explicit SolveIsland(const Memory &m)
      : batches(m), acceleration(m), momentum(m), proximal(m), redundant(m), tresca(m) {
    use_memory(m, scratch, limit);
    start();
  }
  // From the first pass on.
  void start() {
    passes = sweeps = asked = 0;
    common = false;
    affordable = -1;
    due = due_before = std::numeric_limits<double>::infinity();
  }
};

class SolveIslands {
 public:
  explicit SolveIslands(const Memory &memory);
  // Of the contacts and bonds of the sub-step and their rows, whose laws are known.
  void find(const World &w, StepContext &step);
  // In the order of their first rows.
  std::span<SolveIsland> all() { return {islands_.data(), count_}; }
  std::span<const SolveIsland> all() const { return {islands_.data(), count_}; }
  // Numbers of islands, those with the most rows first: no thread comes to a large one when others are done.
  std::span<const uint32_t> by_size() const { return {order_.data(), count_}; }
  // [contacts,2] numbers of the two sides among all bodies of all islands; kNone: an obstacle
  const uint32_t *sides() const { return sides_.data(); }
  // [contacts] whether both sides are faces of a cut, set back; null: none are
  const uint8_t *of_cuts() const { return of_cuts_.empty() ? nullptr : of_cuts_.data(); }
  uint32_t side_count() const { return static_cast<uint32_t>(body_of_.size()); }
  bool shares_sides() const;                    // whether some body is in several islands
  void largest_by_body(Array<double> &values);  // [sides,2] each becomes the largest of its body

 private:
  struct Pair {
    uint32_t a, b;  // b: kNone: an obstacle
    RowRun rows;
  };
  const Memory &memory_;
  Array<Pair> pairs_;      // of sides that touch, or are bonded: contacts, then bonds
  Islands joined_;         // pairs by island
  Array<uint32_t> owner_;  // [dofs] a pair that moves it; of a block its first dof alone
  // [bodies] the last island it was met in, and its number there
  Array<uint32_t> met_, side_;
  Array<uint32_t> sides_, body_of_;  // body_of_: [sides]
  Array<uint8_t> of_cuts_;
  Array<double> largest_;  // [bodies,2] scratch
  Array<uint32_t> order_;
  // by island: runs of contacts, of bonds, and blocks
  Array<RowRun> contact_, bond_;
  Array<uint32_t> block_, begin_;
  std::vector<SolveIsland> islands_;  // those of this sub-step come first, and stay for later ones
  uint32_t count_ = 0;
  void join(const ContactRows &rows);
  void number_sides(size_t bodies, size_t of_contacts);
  void find_cuts(const World &w, const StepContext &step);
};

// Whether a sub-step without a result can be taken anew, half as long.
bool may_shorten(const StepContext &step);

// All islands that are open, each until the true residual of its laws is good enough. One in which a law has
// failed, or null.
const SolveIsland *solve_islands(World &w, StepContext &step);

}  // namespace dfm
