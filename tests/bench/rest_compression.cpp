// Rest compression against the static shape (support/compression.h), for every model, integrator,
// step and Young's modulus. Exits with 1 where one is off by more than 1 %.
//
//   rest_compression [--csv TABLE.csv --commit HASH]
#include "compression.h"
#include "machine.h"

int main(int argc, char **argv) {
  using namespace test::compression;
  const bench::Csv table(argc, argv,
                         "scene,model,integrator,step_s,young_Pa,error,compression_m,gap_m,speed_m_s,"
                         "substeps,simulated_s,cpu_s");
  struct Way {
    const char *name;
    int32_t integrator;
  };
  constexpr Way kWays[] = {
      {"explicit", DFM_INTEGRATOR_SYMPLECTIC_EULER},
      {"implicit", DFM_INTEGRATOR_IMPLICIT_EULER},
  };
  int bad = 0;
  for (const char *scene : {"plane", "column", "pair"})
    for (const char *model : {"msm", "corotational_fem", "linear_fem"})
      for (const Way &way : kWays) {
        double worst = 0;
        for (const double step : {1e-4, 1e-3, 1.0 / 60})
          for (const double young : {1e4, 1e5, 1e6, 1e7}) {
            const Result r = run_case({scene, model, way.integrator, step, young});
            worst = std::max(worst, r.error);
            bad += !(r.error < 0.01);
            if (table.csv)
              std::fprintf(table.csv, "%s,%s,%s,%s,%.6g,%g,%.3g,%.4g,%.3g,%.3g,%llu,%.3g,%.3g\n",
                           table.head.c_str(), scene, model, way.name, step, young, r.error, r.expected,
                           r.gap, r.speed, static_cast<unsigned long long>(r.substeps), r.simulated,
                           r.seconds);
          }
        std::printf("%-8s %-18s %-9s worst error %.2e\n", scene, model, way.name, worst);
        std::fflush(stdout);
      }
  return bad > 0;
}
