// Linear solvers of plugins behind the interface of math/linear_solver.h, and the choice among all.
#pragma once
#include "math/make_solver.h"
#include "plugin/context.h"

namespace dfm {

class PluginSolver final : public LinearSolver {
 public:
  PluginSolver(const dfm_type &type, const dfm_host &host, const Memory &memory);
  ~PluginSolver() override;
  PluginSolver(const PluginSolver &) = delete;

  const char *name() const override { return type_.id; }
  bool direct() const override;
  // Throw Error, which names the plugin: analyse() if it fails, the others if there is no memory.
  void analyse(const BlockPattern &pattern) override;
  bool factor(const double *blk) override;
  bool solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) override;

 private:
  void release() noexcept;
  bool is_ok(dfm_status status) const;

  const dfm_type &type_;
  const dfm_solver &ops_;
  const dfm_host &host_;
  void *self_ = nullptr;
  uint32_t n_ = 0;
  bool ready_ = false;
};

// The solver of that name, from the library or a plugin. Throws Error, which lists the existing ones.
std::unique_ptr<LinearSolver> make_solver(const SolverChoice &choice, const dfm_context &context,
                                          const Memory &memory, Tasks *tasks);

}  // namespace dfm
