// Every shipped scene with every model, integrator and step, as `--set` asks for them: what becomes of it,
// what a step costs. Rows that the table has are left alone.
//
//   scene_models TABLE.csv [--only TEXT] [--simulated S] [--patience S] [--commit HASH]
//       rows whose name contains TEXT; simulates at most S s (0.5) within S s of the processor (30)
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>

#include "machine.h"
#ifdef DEFORM_HAS_ODE
#include "deform/ode_host.h"
#endif
#include "suite.h"

namespace {

using namespace test::suite;

std::vector<std::string> shipped() {
  std::vector<std::string> out;
  for (const auto &file :
       std::filesystem::directory_iterator(std::string(DEFORM_SOURCE_DIR) + "/examples/scenes"))
    if (file.path().extension() == ".json") out.push_back(file.path().string());
  std::sort(out.begin(), out.end());
  return out;
}

// In a word: done, slow (the processor time was over first), stopped (itself), refused (cannot be loaded so).
const char *status_of(const Seen &s) {
  return !s.loaded ? "refused" : s.status != DFM_OK ? "stopped" : !s.in_time ? "slow" : "done";
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "scene_models TABLE.csv [--only TEXT] [--simulated S] [--patience S] [--commit HASH]\n");
    return 2;
  }
  std::string only, commit = "unknown";
  double simulated = 0.5, patience = 30;
  for (int i = 2; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
    if (!std::strcmp(argv[i], "--commit")) commit = argv[i + 1];
    if (!std::strcmp(argv[i], "--simulated")) simulated = std::atof(argv[i + 1]);
    if (!std::strcmp(argv[i], "--patience")) patience = std::atof(argv[i + 1]);
  }
#ifdef DEFORM_HAS_ODE
  test::ok(dfm_ode_register());
#endif
  const std::set<std::string> done = bench::names_in(argv[1], 0, 4);
  std::FILE *table = std::fopen(argv[1], "a");
  if (!table) {
    std::perror(argv[1]);
    return 2;
  }
  if (done.empty())
    std::fprintf(
        table,
        "scene,model,integrator,step,status,crossings,substeps,ms_per_step,energy_gain_J,energy_most_J,"
        "steps,simulated_s,machine,compiler,commit,why\n");
  for (const std::string &path : shipped())
    for (const char *model : {"msm", "corotational_fem"})
      for (const char *integrator : {"explicit", "implicit"})
        for (const double step : {1e-3, 1.0 / 60}) {
          char name[200];
          std::snprintf(name, sizeof name, "%s,%s,%s,1/%.0f", std::filesystem::path(path).stem().c_str(),
                        model, integrator, 1 / step);
          if (done.count(name) || std::string(name).find(only) == std::string::npos) continue;
          Settings how;
          how.combination = {model, integrator, step};
          how.duration = simulated;
          how.cpu_seconds = patience;
          const Seen s = run(path, how);
          std::fprintf(table, "%s,%s,%zu,%llu,%.4g,%.3g,%.3g,%llu,%g,%s,%s,%s,%s\n", name, status_of(s),
                       s.crossings, static_cast<unsigned long long>(s.stats.substeps),
                       1e3 * s.cpu / double(std::max<uint64_t>(1, s.steps)), s.gain, s.energy_most,
                       static_cast<unsigned long long>(s.steps), s.time, bench::machine().c_str(),
                       bench::compiler(), commit.c_str(), bench::quoted(s.reason).c_str());
          std::fflush(table);
          std::printf("%-56s %-8s %zu crossings %s\n", name, status_of(s), s.crossings, s.reason.c_str());
          std::fflush(stdout);
        }
  std::fclose(table);
}
