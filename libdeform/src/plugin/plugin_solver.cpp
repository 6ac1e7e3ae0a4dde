#include "plugin/plugin_solver.h"

#include "core/error.h"
#include "plugin/call.h"
#include "plugin/registry.h"

namespace dfm {

PluginSolver::PluginSolver(const dfm_type &type, const dfm_host &host, const Memory &memory)
    : type_(type), ops_(solver_of(type)), host_(host) {}

PluginSolver::~PluginSolver() { release(); }

void PluginSolver::release() noexcept {
  ready_ = false;
  if (!self_) return;
  call_plugin(host_, type_, "release", [&] { ops_.release(self_); });
  self_ = nullptr;
}

bool PluginSolver::direct() const { return ops_.flags & DFM_SOLVER_DIRECT; }

void PluginSolver::analyse(const BlockPattern &pattern) {
  release();
  n_ = pattern.n;
  const auto query = [&] { return ops_.analyse(&host_, pattern.n, pattern.nb, pattern.ij, &self_); };
  const dfm_status status = call_plugin(host_, type_, "analyse", query);
  if (status == DFM_OK && self_) return;
  self_ = nullptr;  // a solver that fails has freed its data
  is_ok(status);
  fail(DFM_E_FATAL, "solver '%s' cannot take a matrix of %u points; see the log", type_.id, n_);
}

bool PluginSolver::is_ok(dfm_status status) const {
  if (status == DFM_E_NOMEM)
    fail(DFM_E_NOMEM, "the memory does not suffice for solver '%s' and a matrix of %u points", type_.id, n_);
  return status == DFM_OK;
}

bool PluginSolver::factor(const double *blk) {
  ready_ = self_ && is_ok(call_plugin(host_, type_, "factor", [&] { return ops_.factor(self_, blk); }));
  return ready_;
}

bool PluginSolver::solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) {
  info = {};
  const auto query = [&] { return ops_.solve(self_, nrhs, b, x, tolerance); };
  return ready_ && is_ok(call_plugin(host_, type_, "solve", query));
}

std::unique_ptr<LinearSolver> make_solver(const SolverChoice &choice, const dfm_context &context,
                                          const Memory &memory, Tasks *tasks) {
  if (auto own = own_solver(choice, memory, tasks)) return own;
  if (const dfm_type *type = context.registry.try_find(DFM_KIND_SOLVER, choice.name))
    return std::make_unique<PluginSolver>(*type, context.host, memory);
  std::string others;
  for (const dfm_type *type : context.registry.list(DFM_KIND_SOLVER)) others += ", " + short_name(*type);
  fail(DFM_E_UNSUPPORTED, "no linear solver \"%s\" is loaded; choose auto, ldlt, pcg%s", choice.name,
       others.c_str());
}

}  // namespace dfm
