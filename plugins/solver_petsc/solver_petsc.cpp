// org.deform.petsc_gamg, petsc_hypre, petsc_mumps: solvers of PETSc. Compiled twice: as the plugin, which is
// rank 0, and with DEFORM_PETSC_RANK as the program of the other ranks. Each call of the plugin is an Order
// that all ranks perform.
#include "system.h"

#include <dlfcn.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deform/plugin.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace {

namespace dp = dfm::plugin;
using petsc::Data, petsc::System;

enum What : int32_t { kAnalyse, kFactor, kSolve, kRelease, kEnd };
struct Order {
  int32_t what, system;
  uint32_t method;
  PetscInt rows;
  double tolerance;
};

// PETSc and MPI of this process: one call at a time, whichever thread it comes from; a log function of the
// host may make another one. Never destroyed, because matrices that are left when MPI has ended cannot be.
struct Process {
  enum { kNew, kRunning, kEnded } state = kNew;
  bool own_mpi = false, own_petsc = false, working = false;  // working: in MPI or PETSc
  int size = 1, rank = 0, threads = 0, next = 0;
  pid_t pid = 0;
  MPI_Comm comm = MPI_COMM_NULL;
  std::map<int, System> systems;
  char said[300] = "";  // PETSc's reason of the last failure
  std::recursive_mutex door;
};
alignas(Process) unsigned char room[sizeof(Process)];
Process &process = *new (room) Process;

PetscErrorCode take_reason(MPI_Comm, int, const char *function, const char *, PetscErrorCode code,
                           PetscErrorType type, const char *text, void *) {
  if (type == PETSC_ERROR_INITIAL)
    std::snprintf(process.said, sizeof process.said, "%s: %s", function, text ? text : "");
  return code;
}

// mpirun and srun tell a process its rank before it starts MPI.
const char *launched_rank() {
  const char *const rank = std::getenv("PMIX_RANK");
  return rank ? rank : std::getenv("PMI_RANK");
}

void finish();

PetscErrorCode start_mpi() {
  int already = 0;
  PetscBool petsc = PETSC_FALSE;
  MPI_Initialized(&already);
  process.own_mpi = !already;
  if (process.own_mpi) {
    constexpr const char *no_daemon = "OMPI_MCA_ess_singleton_isolated";  // else Open MPI starts a process
    if (!launched_rank()) setenv(no_daemon, "1", 0);
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &process.threads);
  } else {
    MPI_Query_thread(&process.threads);
  }
  // ranks of a host that uses MPI itself are not ours to call
  MPI_Comm_dup(process.own_mpi ? MPI_COMM_WORLD : MPI_COMM_SELF, &process.comm);
  MPI_Comm_set_errhandler(process.comm, MPI_ERRORS_RETURN);
  MPI_Comm_size(process.comm, &process.size);
  MPI_Comm_rank(process.comm, &process.rank);
  PetscInitialized(&petsc);
  process.own_petsc = !petsc;
  if (process.own_petsc) {
    char program[] = "deform", signals_off[] = "-no_signal_handler", file_off[] = "-skip_petscrc";
    char *words[] = {program, signals_off, file_off, nullptr}, **argv = words;
    int argc = 3;
    PETSC_COMM_WORLD = process.comm;
    PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  }
  return 0;
}

PetscErrorCode start() {
  struct sigaction handlers[32];  // MPI installs its own; these are the host's matter
  for (int k = 1; k < 32; ++k) sigaction(k, nullptr, &handlers[k]);
  const PetscErrorCode failed = start_mpi();
  for (int k = 1; k < 32; ++k) sigaction(k, &handlers[k], nullptr);
  process.pid = getpid();
  process.state = failed ? Process::kEnded : Process::kRunning;
  if (!failed) std::atexit(finish);
  return failed;
}

PetscErrorCode perform(const Order &order, Data &root) {
  switch (order.what) {
    case kAnalyse: return process.systems[order.system].analyse(process.comm, order.method, order.rows, root);
    case kFactor: return process.systems[order.system].factor(root);
    case kSolve: return process.systems[order.system].solve(order.tolerance, root);
    case kRelease: process.systems.erase(order.system); return 0;
    default: process.systems.clear(); return 0;
  }
}

// Nothing is printed, and no exception leaves.
template <class F>
PetscErrorCode quietly(const F &work) {
  PetscErrorCode failed = PETSC_ERR_MEM;
  PetscPushErrorHandler(take_reason, nullptr);
  try {
    failed = work();
  } catch (const std::bad_alloc &) {
    std::snprintf(process.said, sizeof process.said, "the memory does not suffice");
  }
  PetscPopErrorHandler();
  return failed;
}

// The host has ended MPI, or this is a child of fork(), which has no part in it.
bool gone() {
  int ended = 0;
  MPI_Finalized(&ended);
  return ended || process.state == Process::kEnded || process.pid != getpid();
}

// Waits without keeping a processor busy: root may compute for long between two orders.
PetscErrorCode share(Order &order) {
  MPI_Request request;
  PetscCallMPI(MPI_Ibcast(&order, sizeof order, MPI_BYTE, 0, process.comm, &request));
  for (int arrived = 0; !arrived;) {
    PetscCallMPI(MPI_Test(&request, &arrived, MPI_STATUS_IGNORE));
    if (!arrived && process.rank) usleep(50);
  }
  return 0;
}

void finish() {
  if (process.state == Process::kNew || gone()) return;
  const std::unique_lock one_at_a_time(process.door, std::try_to_lock);
  if (!one_at_a_time || process.working) {  // exit() in the middle of a call: ranks cannot be asked to end
    process.state = Process::kEnded;
    if (process.size > 1) MPI_Abort(process.comm, 1);
    return;
  }
  Order end{kEnd, 0, 0, 0, 0};
  Data none;
  if (process.rank == 0 && process.size > 1) share(end);
  if (process.rank == 0) quietly([&] { return perform(end, none); });
  process.state = Process::kEnded;
  if (process.own_petsc) PetscFinalize();
  MPI_Comm_free(&process.comm);
  if (process.own_mpi) MPI_Finalize();
}

// A rank that fails alone leaves the others waiting in PETSc for ever, so it ends them, and itself.
void abandon() {
  process.state = Process::kEnded;
  MPI_Abort(process.comm, 1);
}

#ifndef DEFORM_PETSC_RANK

dfm_status refuse(const dfm_host &host, dfm_status status, const char *text) {
  host.log(host.ctx, 3, 0, text);
  return status;
}

dfm_status failure(const dfm_host &host, const char *what, PetscErrorCode code) {
  char text[600];
  std::snprintf(text, sizeof text, "petsc: %s failed (%s); %s", what,
                *process.said ? process.said : "PETSc gives no reason",
                code == PETSC_ERR_MEM ? "use more ranks of MPI, or the solver pcg" : "use the solver pcg");
  return refuse(host, code == PETSC_ERR_MEM ? DFM_E_NOMEM : DFM_E_FATAL, text);
}

dfm_status call(const dfm_host &host, const char *what, Order order, Data &data) {
  if (process.pid && process.pid != getpid())  // its lock may be held for ever
    return refuse(host, DFM_E_STATE, "petsc: this process is a child of the one that started MPI");
  const std::lock_guard one_at_a_time(process.door);
  *process.said = 0;
  if (process.state == Process::kNew)
    if (const PetscErrorCode failed = quietly(start)) return failure(host, "its start", failed);
  if (gone()) return refuse(host, DFM_E_STATE, "petsc: MPI has ended; release all bodies before");
  int main_thread = 0;
  MPI_Is_thread_main(&main_thread);
  if (process.threads < MPI_THREAD_SERIALIZED && !main_thread)
    return refuse(host, DFM_E_UNSUPPORTED,
                  "petsc: the host started MPI for its main thread alone; start it with "
                  "MPI_THREAD_SERIALIZED, or run with one thread");
  process.working = true;
  PetscErrorCode failed = process.size > 1 ? share(order) : 0;
  if (!failed) failed = quietly([&] { return perform(order, data); });
  process.working = false;
  if (!failed && data.status == DFM_E_NOMEM) failure(host, what, PETSC_ERR_MEM);  // known to all ranks
  if (!failed) return data.status;
  const dfm_status status = failure(host, what, failed);
  if (process.size > 1) abandon();
  return status;
}

class Solver {
 public:
  Solver(const dfm_host &host, uint32_t n, uint32_t method)
      : host_(host), order_{kAnalyse, 0, method, PetscInt(3 * n), 0} {}

  dfm_status analyse(uint32_t nb, const uint32_t *ij) {
    if (18 * uint64_t{nb} > uint64_t(PETSC_MAX_INT))
      return refuse(host_, DFM_E_UNSUPPORTED,
                    "petsc: the matrix has more entries than this PETSc can count; use the solver pcg, or a "
                    "PETSc with 64-bit indices");
    {
      const std::lock_guard one_at_a_time(process.door);
      order_.system = process.next++;
    }
    nb_ = nb;
    for (uint32_t k = 0; k < nb; ++k)
      if (ij[2 * size_t{k}] == ij[2 * size_t{k} + 1]) own_.push_back(k);
    Data data;
    data.nb = nb;
    data.ij = ij;
    const dfm_status status = call(host_, "analyse", order_, data);
    if (status != DFM_OK) release();
    return status;
  }

  dfm_status factor(const double *blk) {
    double nan_flag = 0;
    for (size_t k = 0; k < 9 * size_t{nb_}; ++k) nan_flag += 0.0 * blk[k];
    bool positive = nan_flag == 0;  // the iterations find the rest of what is not definite in solve
    for (const uint32_t k : own_)
      for (size_t c = 0; c < 3; ++c) positive = positive && blk[9 * size_t{k} + 4 * c] > 0;
    if (!positive) return DFM_DISCARD;
    Data data;
    data.in = blk;
    return ask(kFactor, "factor", 0, data);
  }

  dfm_status solve(uint32_t nrhs, const double *b, double *x, double tolerance) {
    dfm_status status = DFM_OK;
    const size_t rows = size_t(order_.rows);
    for (uint32_t k = 0; k < nrhs && status >= DFM_OK; ++k, b += rows, x += rows) {
      if (std::all_of(b, b + rows, [](double v) { return v == 0; })) {
        std::fill_n(x, rows, 0.0);
        continue;
      }
      Data data;
      data.in = b;
      data.out = x;
      const dfm_status one = ask(kSolve, "solve", tolerance, data);
      if (one != DFM_OK) status = one;
      char text[60];
      std::snprintf(text, sizeof text, "petsc: %d iterations", int(data.iterations));
      host_.log(host_.ctx, 0, 0, text);
    }
    return status;
  }

  void release() {
    Data none;
    if (process.state != Process::kNew && !gone()) ask(kRelease, "release", 0, none);
  }

 private:
  dfm_status ask(What what, const char *name, double tolerance, Data &data) {
    order_.what = what;
    order_.tolerance = tolerance;
    return call(host_, name, order_, data);
  }

  const dfm_host &host_;
  Order order_;
  uint32_t nb_ = 0;
  std::vector<uint32_t> own_;  // blocks on the diagonal
};

template <uint32_t Method>
dfm_status analyse(const dfm_host *host, uint32_t n, uint32_t nb, const uint32_t *ij, void **self) {
  auto solver = std::make_unique<Solver>(*host, n, Method);
  const dfm_status status = solver->analyse(nb, ij);
  if (status == DFM_OK) *self = solver.release();
  return status;
}
dfm_status factor(void *self, const double *blk) { return static_cast<Solver *>(self)->factor(blk); }
dfm_status solve(void *self, uint32_t nrhs, const double *b, double *x, double tolerance) {
  return static_cast<Solver *>(self)->solve(nrhs, b, x, tolerance);
}
void release(void *self) {
  static_cast<Solver *>(self)->release();
  delete static_cast<Solver *>(self);
}

template <uint32_t Method>
constexpr dfm_solver table = {
    sizeof(dfm_solver),           Method == petsc::kMumps ? uint32_t(DFM_SOLVER_DIRECT) : 0u,
    dp::guarded<analyse<Method>>, dp::guarded<factor>,
    dp::guarded<solve>,           release};
constexpr const char *licence = "MIT; GPL-2.0-or-later with Debian's PETSc";
const dfm_type gamg =
    dp::type(DFM_KIND_SOLVER, "org.deform.petsc_gamg", "PETSc: conjugate gradients, GAMG", "1.0.0", licence,
             "Balay et al., PETSc/TAO users manual, ANL-21/39", nullptr, &table<petsc::kGamg>);
const dfm_type hypre = dp::type(
    DFM_KIND_SOLVER, "org.deform.petsc_hypre", "PETSc: conjugate gradients, BoomerAMG", "1.0.0", licence,
    "Henson and Yang 2002, Applied Numerical Mathematics 41 (1)", nullptr, &table<petsc::kHypre>);
const dfm_type mumps =
    dp::type(DFM_KIND_SOLVER, "org.deform.petsc_mumps", "PETSc: factorization by MUMPS", "1.0.0", licence,
             "Amestoy, Duff, L'Excellent and Koster 2001, SIAM J. Matrix Anal. Appl. 23 (1)", nullptr,
             &table<petsc::kMumps>);

std::string own_file() {
  Dl_info self;
  dladdr(reinterpret_cast<const void *>(&own_file), &self);
  return self.dli_fname;
}

// Rank 0 starts MPI at once, because the others wait for it; these become deform-petsc-rank. A host that
// started MPI before keeps its ranks.
bool join(const dfm_host &host) {
  const char *const rank = launched_rank();
  int already = 0;
  MPI_Initialized(&already);
  if (!rank || already) return true;
  if (std::strcmp(rank, "0") == 0) {
    const std::lock_guard one_at_a_time(process.door);
    const PetscErrorCode failed = process.state == Process::kNew ? quietly(start) : 0;
    if (failed) failure(host, "its start", failed);
    return !failed;
  }
  const std::string file = own_file(), program = file.substr(0, file.rfind('/') + 1) + "deform-petsc-rank";
  execl(program.c_str(), program.c_str(), nullptr);
  const std::string text = "petsc: cannot start " + program + " for rank " + rank + " (" +
                           std::strerror(errno) + "); put it beside the plugin";
  host.log(host.ctx, 3, 0, text.c_str());
  return false;
}

}  // namespace

extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi,
                                                         uint32_t host_abi_min) {
  static const dfm_type *const types[] = {&gamg, &hypre, &mumps};
  static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 3, types, nullptr};
  const dfm_plugin *const known = dp::publish(host, host_abi, host_abi_min, &plugin);
  return known && join(*host) ? known : nullptr;
}

#else

}  // namespace

int main() {
  const PetscErrorCode not_started = quietly(start);
  if (not_started || process.rank == 0) {
    std::fprintf(stderr, "deform-petsc-rank: %s\n",
                 not_started
                     ? process.said
                     : "rank 0 must be a program that loads solver_petsc; this one is for the other ranks");
    return 1;
  }
  for (;;) {
    Order order;
    Data none;
    PetscErrorCode failed = share(order);
    if (!failed) failed = quietly([&] { return perform(order, none); });
    if (failed) {
      std::fprintf(stderr, "deform-petsc-rank: rank %d failed (%s); use more ranks, or the solver pcg\n",
                   process.rank, process.said);
      abandon();
      return 1;
    }
    if (order.what == kEnd) return 0;
  }
}

#endif
