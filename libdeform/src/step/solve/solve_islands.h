// Contact islands: contacts and bonds that affect each other within the sub-step, because they
// share an unknown: a point, or a body whose points respond to each other's impulses. Rows of the same two
// bodies stay together. Each island is solved by itself, with its own acceleration and its own number of
// sweeps; the disturbance that the warm start leaves at a body sets the tolerances in all of its islands. So
// bodies that touch each other move as if they were alone in the world, and several threads may solve several
// islands.
#pragma once
#include <span>
#include <vector>

#include "contact/newton.h"
#include "contact/sweeps.h"
#include "contact/solver.h"
#include "friction/laws.h"
#include "step/budget.h"
#include "core/disjoint_sets.h"

namespace dfm {

struct StepContext;
struct SubStepTimes;
struct World;

struct SolveIsland final : SolveLaws {
  const World *world = nullptr;  // of the present solve
  StepContext *step = nullptr;
  RowsPart part;
  bool implicit = false;        // some body of it moves implicitly
  uint32_t implicit_body = 0;   // slot of one of these
  bool rigid = false;           // some body of it is of a rigid host
  bool between_rigids = false;  // some row of it is between rigid things
  bool all_rigid = false;       // all of them
  LawBatches batches;
  Sweeps sweeping;
  std::unique_ptr<ContactNewton> newton;  // null until it is needed
  Tolerance tolerance;
  std::vector<double> swept;  // [rows,3] N s, scratch
  // of the last solve
  Residual residual;
  uint32_t passes = 0, sweeps = 0;
  bool failed = false;  // no velocities were found: a model cannot tell its forces
  bool drifts = false;  // contacts of it owe slip (friction_memory.h)
  Spent spent;
  const LawInstance *bad = nullptr;  // the law that has failed
  // of all solves of the sub-step
  bool open = true;  // it is to be solved
  uint32_t all_passes = 0, all_sweeps = 0;

  explicit SolveIsland(const Memory &m) : batches(m), sweeping(m) {}
  bool evaluate_local(const double *response, double slip) override;
  bool judge(Residual &found) override;
  void spend(uint64_t rows) override;
  bool goes_on() override;
};

class SolveIslands {
 public:
  explicit SolveIslands(const Memory &memory);
  // Finds the islands of the sub-step's contacts and bonds. Their rows and laws must be known.
  void find(const World &w, StepContext &step);
  // In the order of their first rows.
  std::span<SolveIsland> all() { return {islands_.data(), count_}; }
  std::span<const SolveIsland> all() const { return {islands_.data(), count_}; }
  // Indices of islands, those with the most rows first: otherwise a thread might begin a large island when
  // the others are done.
  std::span<const uint32_t> by_size() const { return {order_.data(), count_}; }
  // [contacts,2] the two bodies: the slot, or behind all slots the first dof of a rigid body; kNone: an
  // obstacle
  const uint32_t *sides() const { return sides_.data(); }
  // [contacts] whether both sides are faces of a cut, set back; null: none are
  const uint8_t *of_cuts() const { return of_cuts_.empty() ? nullptr : of_cuts_.data(); }

 private:
  const Memory &memory_;
  DisjointSets joined_;    // rows by island
  Array<uint32_t> owner_;  // [dofs] a row that moves it; of a block its first dof alone
  Array<uint32_t> sides_;
  Array<uint8_t> between_rigids_;  // [islands]
  Array<uint8_t> of_cuts_;
  Array<uint32_t> order_;
  // by island: runs of contacts, of bonds, and blocks
  Array<RowRun> contact_, bond_;
  Array<uint32_t> block_, begin_;
  std::vector<SolveIsland> islands_;  // those of this sub-step come first, and stay for later ones
  uint32_t count_ = 0;
  void join(const StepContext &step);
  void set_sides(const StepContext &step, uint32_t bodies);
  void find_cuts(const World &w, const StepContext &step);
  // What an island has of `all`, whose lists by island begin_ has.
  template <class T>
  std::span<const T> slice(const Array<T> &all, uint32_t island) const {
    return {all.data() + begin_[island], begin_[island + 1] - begin_[island]};
  }
  // Each island gets its rows of [from, end).
  void assign_rows(uint32_t from, uint32_t end, Array<RowRun> &runs, std::span<const RowRun> RowsPart::*rows,
                   uint32_t RowsPart::*number);
  void prepare(const World &w, StepContext &step);  // each island, with its blocks and laws
};

// Share of a planned sub-step: no repeated one is shorter.
inline constexpr double kMinRepeated = 1.0 / 256;
// Whether a sub-step without a result can be repeated with half its length.
bool may_shorten(const SubStepTimes &times);

// Solves all open islands until the true residual of their laws is good enough. Returns an island in which a
// law has failed, or null.
const SolveIsland *solve_islands(World &w, StepContext &step);

// Where the guard takes only this share of the motion, forces of explicit bodies act for that share
// (Dynamics::take_part), and impulses of islands that have no other bodies are reduced to what is then left
// to stop. Bodies of all other islands keep forces and impulses in full: step.in_full.
void take_part_of_contact(const World &w, StepContext &step, double share);

}  // namespace dfm
