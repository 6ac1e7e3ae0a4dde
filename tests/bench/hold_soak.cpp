// The hold bound, in full: scenes of support/hold.h for all laws, steps and meshes, one row of a table each.
// Rows that the table has are left alone, so that the run may be stopped and taken up again. Exits with 1
// where something that should hold crept by more than a micrometer per second, or what drifts by its law does
// so at more than 1.25 times the rate of its formula.
//
//   hold_soak TABLE.csv [--only TEXT] [--seconds N]
//       rows whose name contains each TEXT; begins no row after N seconds
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include "hold.h"
#include "machine.h"
#include "support.h"

namespace {

using namespace test::hold;

struct Place {
  const char *scene;
  double level, cycles;
};
constexpr Place kPlaces[] = {
    {"slope", 0.5, 0}, {"slope", 0.9, 0}, {"slope", 0.99, 0}, {"pull", 0.5, 0},  {"pull", 0.9, 0},
    {"pull", 0.99, 0}, {"soft", 0.5, 0},  {"soft", 0.9, 0},   {"soft", 0.99, 0}, {"pinch", 1.05, 0},
    {"pinch", 2, 0},   {"pinch", 20, 0},  {"pinch", 95, 0},   {"stack", 3, 0},   {"stack", 5, 0},
    {"grip", 1.05, 0}, {"grip", 2, 0},    {"grip", 20, 0},    {"vee", 0, 0},     {"vee", 10, 0},
    {"taper", 2, 0},   {"taper", 5, 0},   {"wedges", 0, 0},   {"wedges", 3, 0},  {"vibration", 0.5, 10000}};
constexpr const char *kLaws[] = {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"};
struct Step {
  const char *name;
  double seconds;
};
constexpr Step kSteps[] = {{"1/1000", 1e-3}, {"1/60", 1.0 / 60}, {"1/240", 1.0 / 240}, {"1/10000", 1e-4}};
// steps: so many of kSteps
struct Bodies {
  const char *model, *integrator;
  int32_t i;
  int steps;
};
constexpr Bodies kBodies[] = {{"msm", "explicit", DFM_INTEGRATOR_AUTO, 4},
                              {"msm", "implicit", DFM_INTEGRATOR_IMPLICIT_EULER, 2},
                              {"corotational_fem", "implicit", DFM_INTEGRATOR_IMPLICIT_EULER, 2}};

std::string name_of(const Place &p, const char *law, const Bodies &bodies, const char *mesh,
                    const Step &step) {
  char text[200];
  std::snprintf(text, sizeof text, "%s,%s,%g,%s,%s,%s,%s", p.scene, law, p.level, bodies.model,
                bodies.integrator, mesh, step.name);
  return text;
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "hold_soak TABLE.csv [--only TEXT] [--seconds N]\n");
    return 2;
  }
  std::vector<std::string> only;
  double seconds = 1e9;
  for (int i = 2; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--only")) only.push_back(argv[i + 1]);
    if (!std::strcmp(argv[i], "--seconds")) seconds = std::atof(argv[i + 1]);
  }
  const std::set<std::string> done = bench::names_in(argv[1], 0, 7);
  std::FILE *table = std::fopen(argv[1], "a");
  if (!table) {
    std::perror(argv[1]);
    return 2;
  }
  if (done.empty())
    std::fprintf(table,
                 "scene,law,level,model,integrator,mesh,step_s,creep_m_s,worst_contact_m_s,law_drift_m_s,"
                 "stuck,substeps,"
                 "unconverged,simulated_s,cpu_s,machine,compiler\n");
  const auto start = std::chrono::steady_clock::now();
  int bad = 0;
  // Coarse meshes and short runs first: what is stopped early has seen every law.
  for (const Bodies &bodies : kBodies)
    for (const bool fine : {false, true})
      for (const Step *step = kSteps; step != kSteps + bodies.steps; ++step)
        for (const Place &p : kPlaces)
          for (const char *law : kLaws) {
            const bool implicit = bodies.i == DFM_INTEGRATOR_IMPLICIT_EULER;
            if (p.cycles > 0 && (fine || implicit)) continue;  // a quarter of an hour each
            // doc/laws/gms.md, limits
            if (!std::strcmp(p.scene, "soft") && p.level > 0.5 && !std::strcmp(law, "gms")) continue;
            if (implicit && !promises_stiction(law)) continue;
            const std::string name = name_of(p, law, bodies, fine ? "fine" : "coarse", *step);
            if (done.count(name) || !std::all_of(only.begin(), only.end(), [&](const std::string &text) {
                  return name.find(text) != std::string::npos;
                }))
              continue;
            if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds)
              continue;
            const Result r =
                run_case({p.scene, law, p.level, step->seconds, fine, p.cycles, bodies.model, bodies.i});
            const bool holds = r.drift > 0 ? r.creep < 1.25 * r.drift : r.creep < 1e-6;
            bad += !holds;
            std::fprintf(table, "%s,%.3g,%.3g,%.3g,%u,%llu,%llu,%g,%.2f,%s,%s\n", name.c_str(), r.creep,
                         r.contact, r.drift, r.stuck, static_cast<unsigned long long>(r.substeps),
                         static_cast<unsigned long long>(r.unconverged), r.simulated, r.seconds,
                         bench::machine().c_str(), bench::compiler());
            std::fflush(table);
            std::printf("%-64s creep %9.3g m/s  law's drift %9.3g  %s\n", name.c_str(), r.creep, r.drift,
                        holds ? "" : "TOO MUCH");
            std::fflush(stdout);
          }
  std::fclose(table);
  return bad > 0;
}
