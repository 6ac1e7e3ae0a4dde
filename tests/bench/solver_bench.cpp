// What each linear solver costs on the matrix of an implicit step, four sizes of a cylinder.
//
//   solver_bench [--csv FILE --commit HASH] [--plugin FILE --solver NAME] [--cells N] [--large]
//
// --large: conjugate gradients alone, 4,000 to 1,000,000 points (8 GB), also the matrix of equilibrium.
// --cells (may be repeated): a cylinder of that many cells and the named solvers alone, without 64 right-hand
// sides and W. `mpirun -n 2 solver_bench ..`: solver_petsc with two ranks, in the column of threads.
//
// Linear elasticity, E 1e5 Pa, nu 0.3, density 1,000 kg/m^3, step 1/60 s, one end held. `analyse` is paid
// once, `factor` whenever the matrix changes; `solve` is per right-hand side, one at a time and 64 together,
// to 1e-8 in the solver's norm; `restricted` is S A^-1 S^T of as many points of the surface as
// stated. Best of some rounds: processor time of one thread, real time of two.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>

#include "../unit/math/block_system.h"
#include "deform/deform.h"
#include "machine.h"
#include "math/ldlt_solver.h"
#include "plugin/plugin_solver.h"

namespace {

constexpr double kTolerance = 1e-8;
constexpr uint32_t kMany = 64;

struct CountedMemory {
  size_t live = 0, peak = 0;
  dfm::Memory memory;
  CountedMemory() {
    memory.user = this;
    memory.alloc = [](void *user, size_t bytes, size_t align) {
      CountedMemory &m = *static_cast<CountedMemory *>(user);
      m.live += bytes;
      m.peak = std::max(m.peak, m.live);
      const dfm::Memory &s = dfm::Memory::standard();
      return s.alloc(s.user, bytes, align);
    };
    memory.release = [](void *user, void *p, size_t bytes, size_t align) {
      static_cast<CountedMemory *>(user)->live -= bytes;
      const dfm::Memory &s = dfm::Memory::standard();
      s.release(s.user, p, bytes, align);
    };
  }
};

double real_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What a plugin logs of its iterations.
void note_iterations(void *user, int32_t, const char *text) {
  std::sscanf(text, "%*[^:]: %u iterations", static_cast<uint32_t *>(user));
}

uint32_t logged_iterations = 0;
double (*seconds)() = real_seconds;

// Best of as many rounds as fit into half a second, at least two.
double best_ms(const std::function<void()> &f) {
  double best = HUGE_VAL, total = 0;
  for (int round = 0; round < 2 || (total < 0.5 && round < 20); ++round) {
    const double begin = seconds();
    f();
    const double s = seconds() - begin;
    best = std::min(best, s);
    total += s;
  }
  return 1e3 * best;
}

// "pcg_one_level": told no places, so it has block Jacobi alone. "pcg_static": the matrix of equilibrium.
void measure(const bench::Csv &sink, const dfm_context &context, const char *label, uint32_t threads,
             const test::BlockSystem &system, uint32_t ntet, bool whole) {
  CountedMemory counted;
  seconds = threads == 1 ? bench::process_seconds : real_seconds;
  logged_iterations = 0;
  const bool one_level = std::strcmp(label, "pcg_one_level") == 0;
  const char *const name = std::strncmp(label, "pcg", 3) == 0 ? "pcg" : label;
  dfm::Tasks tasks(threads, nullptr, nullptr);
  const dfm::Tasks::Step step(tasks);  // workers stay awake as they do while a world steps
  const auto solver =
      dfm::make_solver({name, system.n, false, 0}, context, counted.memory, threads > 1 ? &tasks : nullptr);
  const double analyse = best_ms([&] { solver->analyse(system.pattern()); });
  const double factor = best_ms([&] {
    if (!one_level) solver->place(system.points.data(), 3);
    if (!solver->factor(system.blk.data())) std::puts("not positive definite");
  });
  const size_t rows = 3 * size_t{system.n};
  const size_t nrhs = whole && solver->direct() ? kMany : 1;
  std::vector<double> b(rows * nrhs), x(rows * nrhs);
  for (size_t k = 0; k < b.size(); ++k) b[k] = double((k * 7919) % 1000) / 1000 - 0.3;
  dfm::SolveInfo info;
  const double one = best_ms([&] {
    std::fill(x.begin(), x.end(), 0.0);
    solver->solve(1, b.data(), x.data(), kTolerance, info);
  });
  const uint32_t iterations = info.iterations + logged_iterations;
  double many = 0;
  if (nrhs > 1) {
    many = best_ms([&] { solver->solve(kMany, b.data(), x.data(), kTolerance, info); }) / kMany;
    // bytes of solving, without those of 64 right-hand sides and of W
  }
  const double bytes = double(counted.peak) / ntet;
  double restricted[2] = {0, 0};
  std::vector<uint32_t> sel;
  if (auto *const ldlt = dynamic_cast<dfm::LdltSolver *>(solver.get()); ldlt && whole)
    for (uint32_t k = 0; k < 2; ++k) {
      // the lowest points: a body that lies on the ground
      std::vector<uint32_t> order(system.n);
      for (uint32_t i = 0; i < system.n; ++i) order[i] = i;
      std::stable_sort(order.begin(), order.end(), [&](uint32_t p, uint32_t q) {
        return system.points[3 * size_t{p}] < system.points[3 * size_t{q}];
      });
      sel.assign(order.begin(), order.begin() + std::min<uint32_t>(system.n / 2, k ? 300 : 50));
      std::vector<double> w(9 * sel.size() * sel.size());
      restricted[k] = best_ms([&] { ldlt->restricted(uint32_t(sel.size()), sel.data(), w.data()); });
    }
  const double per = iterations ? 1e6 * one / iterations / ntet : 0;
  std::printf("%-13s %u %6u %7u %9.2f %9.2f %9.3f %9.3f %6u %8.2f %9.2f %9.2f %8.0f\n", label, threads,
              system.n, ntet, analyse, factor, one, many, iterations, per, restricted[0], restricted[1],
              bytes);
  std::fflush(stdout);
  if (sink.csv)
    std::fprintf(sink.csv, "%s,%s,%u,%u,%u,%.3f,%.3f,%.4f,%.4f,%u,%.2f,%.3f,%.3f,%.0f\n", sink.head.c_str(),
                 label, threads, system.n, ntet, analyse, factor, one, many, iterations, per, restricted[0],
                 restricted[1], bytes);
}

}  // namespace

int main(int argc, char **argv) {
  const bench::Csv sink(
      argc, argv,
      "solver,threads,points,tetrahedra,analyse_ms,factor_ms,solve_ms,solve_of_64_ms,iterations,"
      "iteration_ns_per_tet,restricted_50_ms,restricted_300_ms,bytes_per_tet");
  std::printf("%-13s %s %6s %7s %9s %9s %9s %9s %6s %8s %9s %9s %8s\n", "solver", "t", "points", "tets",
              "analyse", "factor", "solve", "of 64", "iter", "ns/it/t", "S 50", "S 300", "B/tet");
  std::vector<const char *> names = {"ldlt", "pcg", "pcg_one_level"};
  std::vector<uint32_t> sizes = {650, 4800, 11500, 20200};
  std::vector<double> steps = {1.0 / 60};
  for (int n = 1; n < argc; ++n) {
    if (std::strcmp(argv[n], "--large") != 0) continue;
    names = {"pcg"};
    sizes = {20200, 118000, 475000, 1720000, 5800000};
    steps.push_back(HUGE_VAL);
  }
  dfm_context *context = nullptr;
  dfm_context_def def = dfm_context_def_default();
  def.user = &logged_iterations;
  def.log = note_iterations;
  if (dfm_context_create(&def, &context) != DFM_OK) return 1;
  const char *const launched = std::getenv("OMPI_COMM_WORLD_SIZE");
  const uint32_t ranks = launched ? uint32_t(std::atoi(launched)) : 1;
  std::vector<const char *> chosen;
  std::vector<uint32_t> cells_chosen;
  for (int n = 1; n + 1 < argc; n += 2) {
    if (!std::strcmp(argv[n], "--plugin") && dfm_plugin_load(context, argv[n + 1]) != DFM_OK)
      std::puts(dfm_last_error());
    if (!std::strcmp(argv[n], "--solver")) chosen.push_back(argv[n + 1]);
    if (!std::strcmp(argv[n], "--cells")) cells_chosen.push_back(uint32_t(std::atoi(argv[n + 1])));
  }
  const bool whole = cells_chosen.empty();
  if (!whole) {
    names.clear();
    sizes = cells_chosen;
  }
  names.insert(names.end(), chosen.begin(), chosen.end());
  for (const uint32_t cells : sizes) {
    const dfm::RestMesh mesh = dfm::make_cylinder(dfm::Memory::standard(), 0.05, 0.2, cells);
    for (const double h : steps) {
      test::BlockSystem system = test::elastic_system(mesh, 1e5, 0.3, h);
      std::vector<uint8_t> mask(system.n, 0);
      for (uint32_t i = 0; i < system.n; ++i) mask[i] = system.points[3 * size_t{i} + 2] < 1e-9 ? 7 : 0;
      dfm::hold_components(system.pattern(), mask.data(), system.blk.data());
      for (const char *name : names)
        if (std::strncmp(name, "petsc_", 6) == 0) {
          measure(sink, *context, name, ranks, system, mesh.ntet(), whole);
        } else {
          for (const uint32_t threads : {1u, 2u})
            measure(sink, *context, std::isinf(h) ? "pcg_static" : name, threads, system, mesh.ntet(), whole);
        }
    }
  }
  dfm_context_destroy(context);
}
