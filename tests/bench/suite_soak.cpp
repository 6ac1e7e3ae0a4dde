// The stability suite in full: ten jittered runs of every scene and variant with every model, integrator
// and step, a row each. Rows that the table has are left alone, so that the run may be stopped and taken
// up again. Exits with 1 where something does not hold that is not known to fail.
//
//   suite_soak TABLE.csv [--only TEXT] [--seconds N] [--runs N] [--commit HASH]
//       rows whose name contains TEXT; begins no row after N seconds; N jittered runs (10)
#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include "machine.h"
#include "suite.h"

namespace {

using namespace test::suite;

constexpr const char *kModels[] = {"msm", "corotational_fem"};
constexpr const char *kIntegrators[] = {"explicit", "implicit"};
constexpr double kSteps[] = {1e-3, 1.0 / 60};
constexpr double kPatience = 120;  // s of processor time; a run that takes longer is cut short

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "suite_soak TABLE.csv [--only TEXT] [--seconds N] [--runs N] [--commit HASH]\n");
    return 2;
  }
  std::string only, commit = "unknown";
  double seconds = 1e9;
  uint64_t runs = 10;
  for (int i = 2; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
    if (!std::strcmp(argv[i], "--commit")) commit = argv[i + 1];
    if (!std::strcmp(argv[i], "--seconds")) seconds = std::atof(argv[i + 1]);
    if (!std::strcmp(argv[i], "--runs")) runs = std::strtoull(argv[i + 1], nullptr, 10);
  }
  const std::set<std::string> done = bench::names_in(argv[1], 0, 5);
  std::FILE *table = std::fopen(argv[1], "a");
  if (!table) {
    std::perror(argv[1]);
    return 2;
  }
  if (done.empty())
    std::fprintf(table,
                 "scene,model,integrator,step,seed,holds,crossings,substeps,ms_per_step,energy_gain_J,"
                 "energy_most_J,rest_m_s,simulated_s,machine,compiler,commit,why\n");
  const auto start = std::chrono::steady_clock::now();
  int bad = 0;
  for (uint64_t seed = 1; seed <= runs; ++seed)
    for (const char *model : kModels)
      for (const char *integrator : kIntegrators)
        for (const double step : kSteps)
          for (const std::string &scene : names()) {
            const Expectations expect(scene);
            for (const std::string &variant : expect.variants()) {
              const Combination c{model, integrator, step};
              char name[200];
              std::snprintf(name, sizeof name, "%s%s%s,%s,%s,1/%.0f,%llu", scene.c_str(),
                            variant.empty() ? "" : " ", variant.c_str(), model, integrator, 1 / step,
                            static_cast<unsigned long long>(seed));
              if (done.count(name) || std::string(name).find(only) == std::string::npos) continue;
              if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds)
                continue;
              Settings how = expect.settings(variant, c, seed);
              how.cpu_seconds = kPatience;
              const Seen seen = run(expect.path(), how);
              std::string why;
              for (const std::string &s : expect.complaints(variant, c, how, seen))
                why += (why.empty() ? "" : "; ") + s;
              const std::string known = expect.known_failure(variant, c);
              bad += !why.empty() && known.empty();
              std::fprintf(table, "%s,%s,%zu,%llu,%.4g,%.3g,%.3g,%.3g,%g,%s,%s,%s,%s\n", name,
                           why.empty()     ? "yes"
                           : known.empty() ? "NO"
                                           : "known",
                           seen.crossings, static_cast<unsigned long long>(seen.stats.substeps),
                           1e3 * seen.cpu / double(std::max<uint64_t>(1, seen.steps)), seen.gain,
                           seen.energy_most, seen.speed_last, seen.time, bench::machine().c_str(),
                           bench::compiler(), commit.c_str(), bench::quoted(why).c_str());
              std::fflush(table);
              if (!why.empty())
                std::printf("%-64s %s: %s\n", name, known.empty() ? "DOES NOT HOLD" : "known to fail",
                            why.c_str());
              std::fflush(stdout);
            }
          }
  std::fclose(table);
  return bad > 0;
}
