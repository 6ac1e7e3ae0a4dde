#include "math/make_solver.h"

#include <cstring>

#include "math/ldlt_solver.h"
#include "math/pcg_solver.h"

namespace dfm {

namespace {

// Points up to which a factorization in every step is worth its price: doc/reference/solvers.md
constexpr uint32_t kFactorEveryStep = 3000;

}  // namespace

const char *solver_name(const SolverChoice &choice) {
  if (std::strcmp(choice.name, "auto") != 0) return choice.name;
  return choice.constant || choice.points <= kFactorEveryStep ? "ldlt" : "pcg";
}

std::unique_ptr<LinearSolver> own_solver(const SolverChoice &choice, const Memory &memory, Tasks *tasks) {
  const char *const name = solver_name(choice);
  if (std::strcmp(name, "ldlt") == 0) return std::make_unique<LdltSolver>(memory, tasks);
  if (std::strcmp(name, "pcg") == 0) return std::make_unique<PcgSolver>(memory, tasks, choice.max_iterations);
  return nullptr;
}

}  // namespace dfm
