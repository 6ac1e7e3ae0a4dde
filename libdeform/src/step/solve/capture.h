// Contact problems of a run in files (dfm_debug_contact_problems).
#pragma once
#include <cstdint>
#include <memory>
#include <string>

namespace dfm {

struct ContactProblem;
struct SolveIsland;
struct StepContext;
struct World;

struct Capture {
  std::string folder;
  uint32_t every = 0;   // problem that is written; 0: those that are not solved
  uint64_t solved = 0;  // problems so far, the others included
};

// What the solve of this island is about to be given; null where a model cannot tell its forces, which the
// solve finds, too. Other islands may be solved at the same time.
std::unique_ptr<ContactProblem> take_problem(const World &w, const StepContext &step, const SolveIsland &own);
// After the islands have been solved. Ends the capture, with a warning, where a file cannot be written.
void write_problems(const World &w, StepContext &step);

}  // namespace dfm
