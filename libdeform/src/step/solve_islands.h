// Islands of the contact solve: contacts and bonds that can feel each other's impulses, directly or through
// bodies. Each is solved by itself, with its own acceleration, tolerances and end of sweeps, so that its
// answer is the one of a world in which it is alone; and several threads may solve several islands.
#pragma once
#include <exception>
#include <span>
#include <vector>

#include "contact/proximal.h"
#include "contact/redundant.h"
#include "contact/solver.h"
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
  double effort = 0;     // of a sweep (Spent)
  LawBatches batches;
  Acceleration acceleration;
  Momentum momentum;
  Proximal proximal;
  Redundant redundant;
  Tolerance tolerance;
  Array<double> scratch;  // of solve_bonds()
  Array<double> limit;    // [contacts of the part] N s, fixed limits of friction
  // of the last solve
  Residual residual;
  uint32_t passes = 0, sweeps = 0;
  bool slowed = false;  // its depths are opened more slowly
  bool common = false;  // laws are asked by the response of all contacts together
  uint32_t asked = 0;   // passes beyond the cap with the present response
  Spent spent;
  const LawInstance *bad = nullptr;  // that has failed
  std::exception_ptr thrown;
  // of all solves of the sub-step
  bool open = true;  // it is to be solved
  Revised revised = Revised::something;
  uint32_t all_passes = 0, all_sweeps = 0, again = 0, capped = 0;

  explicit SolveIsland(const Memory &m)
      : batches(m), acceleration(m), momentum(m), proximal(m), redundant(m) {
    use_memory(m, scratch, limit);
  }
};

class SolveIslands {
 public:
  explicit SolveIslands(const Memory &memory);
  // Of the contacts and bonds of the sub-step and their rows, whose laws are known.
  void find(const World &w, StepContext &step);
  // In the order of their first bodies.
  std::span<SolveIsland> all() { return {islands_.data(), count_}; }
  std::span<const SolveIsland> all() const { return {islands_.data(), count_}; }
  // Numbers of islands, those with the most rows first: no thread comes to a large one when others are done.
  std::span<const uint32_t> by_size() const { return {order_.data(), count_}; }

 private:
  struct Pair {
    uint32_t body;
    RowRun rows;
  };
  const Memory &memory_;
  Array<Pair> pairs_;       // of sides that touch, or are bonded: contacts, then bonds
  Islands bodies_;          // and behind them rigid groups
  Array<uint32_t> number_;  // [islands of bodies_] that of the island here
  Array<uint32_t> order_;
  // by island: runs of contacts, of bonds, and blocks
  Array<RowRun> contact_, bond_;
  Array<uint32_t> block_, begin_;
  std::vector<SolveIsland> islands_;  // those of this sub-step come first, and stay for later ones
  uint32_t count_ = 0;
};

// All islands that are open, each until the true residual of its laws is good enough. One in which a law has
// failed, or null.
const SolveIsland *solve_islands(World &w, StepContext &step);

}  // namespace dfm
