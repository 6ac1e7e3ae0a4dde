#include "math/make_solver.h"

#include <cstring>

#include "math/ldlt_solver.h"
#include "math/pcg_solver.h"

namespace dfm {

namespace {

// Up to this number of points a factor that is used for many steps is worth its time and memory:
// doc/reference/solvers.md
constexpr uint32_t kFactored = 20000;

}  // namespace

const char *solver_name(const SolverChoice &choice) {
  if (std::strcmp(choice.name, "auto") != 0) return choice.name;
  return choice.constant || choice.points <= kFactored ? "ldlt" : "pcg";
}

std::unique_ptr<LinearSolver> own_solver(const SolverChoice &choice, const Memory &memory, Tasks *tasks) {
  const char *const name = solver_name(choice);
  if (std::strcmp(name, "ldlt") == 0) return std::make_unique<LdltSolver>(memory, tasks);
  if (std::strcmp(name, "pcg") == 0) return std::make_unique<PcgSolver>(memory, tasks, choice.max_iterations);
  return nullptr;
}

}  // namespace dfm
