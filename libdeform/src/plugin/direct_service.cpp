#include "plugin/direct_service.h"

#include <memory>
#include <new>

#include "core/error.h"
#include "math/ldlt_solver.h"

namespace dfm {
namespace {

// Panels of right-hand sides that are processed at a time: two per thread, for this many threads.
constexpr uint32_t kThreads = 4;

// The library's solver as a service for plugins: it uses the memory and threads of the given host.
struct Direct {
  const dfm_host &host;
  Memory memory;
  Tasks tasks;
  LdltSolver solver;

  explicit Direct(const dfm_host &h)
      : host(h),
        memory{h.ctx, h.alloc, h.release},
        tasks(kThreads, h.parallel_for, h.ctx),
        solver(memory, h.parallel_for ? &tasks : nullptr) {}
};

Direct &direct(void *self) { return *static_cast<Direct *>(self); }

// Runs f; turns an exception into a status and a line in the log of the host.
template <class F>
dfm_status guarded(const dfm_host &host, F &&f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (const Error &e) {
    host.log(host.ctx, 3, 0, e.what());
    return e.status;
  } catch (...) {
    return DFM_E_FATAL;
  }
}

dfm_status analyse_at(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, const double *places,
                      void **self) {
  return guarded(*h, [&] {
    auto made = std::make_unique<Direct>(*h);
    if (places) made->solver.analyse({n, nb, ij}, places);
    else made->solver.analyse({n, nb, ij});
    *self = made.release();
    return DFM_OK;
  });
}

dfm_status analyse(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, void **self) {
  return analyse_at(h, n, nb, ij, nullptr, self);
}

dfm_status factor(void *self, const double *blk) {
  return guarded(direct(self).host, [&] { return direct(self).solver.factor(blk) ? DFM_OK : DFM_DISCARD; });
}

dfm_status solve(void *self, uint32_t nrhs, const double *b, double *x, double) {
  SolveInfo info;
  return guarded(direct(self).host,
                 [&] { return direct(self).solver.solve(nrhs, b, x, 0, info) ? DFM_OK : DFM_DISCARD; });
}

void release(void *self) { delete &direct(self); }

dfm_status inverse_at(void *self, uint32_t nsel, const uint32_t *sel, double *w) {
  SolveInfo info;
  return guarded(direct(self).host, [&] {
    LdltSolver &solver = direct(self).solver;
    const bool done = solver.restricted(nsel, sel, 0, w, info);
    solver.forget_restricted();
    return done ? DFM_OK : DFM_DISCARD;
  });
}

constexpr dfm_solver kSolver = {sizeof(dfm_solver), DFM_SOLVER_DIRECT, analyse, factor, solve, release};
constexpr dfm_direct kDirect = {sizeof(dfm_direct), 0, &kSolver, analyse_at, inverse_at};

}  // namespace

const dfm_direct &direct_service() { return kDirect; }

}  // namespace dfm
