// Linear solvers by name.
#pragma once
#include <memory>

#include "math/linear_solver.h"

namespace dfm {

struct SolverChoice {
  const char *name = "auto";    // "auto", "ldlt", "pcg"; plugin_solver.h knows those of plugins, too
  uint32_t points = 0;          // for "auto"
  bool constant = false;        // the matrix never changes
  uint32_t max_iterations = 0;  // of an iterative solver, per right-hand side; 0: as many as there are rows
};

// The solver that "auto" selects: the factorization where it serves many steps and fits into memory.
const char *solver_name(const SolverChoice &choice);
// One of the library's own; null where it has none of that name.
std::unique_ptr<LinearSolver> own_solver(const SolverChoice &choice, const Memory &memory, Tasks *tasks);

}  // namespace dfm
