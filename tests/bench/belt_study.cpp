// Stick-slip of a soft pad against that of a point mass, as the pad stiffens: belt_study FOLDER writes
// belt_stick_slip.csv (a row per law and modulus) and belt_trace.csv (spring force over time), which
// libdeform/doc/images/belt_stick_slip.py draws. belt_study --wav FILE [LAW] writes what it sounds like.
#include <cstdio>

#include "belt.h"
#include "machine.h"
#include "wav.h"

namespace {

// The pad's speed as sound, a hundred times as fast as it is: a slip of two seconds is a pulse of 20 ms, and
// 16 of them come in a second.
int sound(const char *file, const std::string &law) {
  constexpr double kSeconds = 300, kFaster = 100;
  bool known = false;
  for (const test::belt::Rigid &rigid : test::belt::kRigid) known |= law == rigid.law;
  if (!known) {
    std::fprintf(stderr,
                 "belt_study: '%s' does not stick and slip here; give coulomb, lugre or elastoplastic\n",
                 law.c_str());
    return 2;
  }
  const test::belt::Result r = test::belt::run(law, 1e5, 60, kSeconds, 8);
  if (!test::write_wav(file, r.speed, kFaster / test::belt::kStep)) {
    std::fprintf(stderr, "belt_study: cannot write %s\n", file);
    return 2;
  }
  std::printf("%s: %s, period %.4f s, heard %g times as fast: %.2f Hz\n", file, law.c_str(), r.period,
              kFaster, kFaster / r.period);
  return 0;
}

}  // namespace

int main(int argc, char **argv) {
  if ((argc == 3 || argc == 4) && std::string(argv[1]) == "--wav")
    return sound(argv[2], argc == 4 ? argv[3] : "lugre");
  if (argc != 2) {
    std::fprintf(stderr, "usage: belt_study FOLDER | belt_study --wav FILE [LAW]\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::FILE *const table = std::fopen((folder + "/belt_stick_slip.csv").c_str(), "w");
  std::FILE *const trace = std::fopen((folder + "/belt_trace.csv").c_str(), "w");
  if (!table || !trace) {
    std::fprintf(stderr, "belt_study: cannot write to %s; give a folder that exists\n", argv[1]);
    return 2;
  }
  std::fprintf(table,
               "machine,compiler,law,young_Pa,period_s,period_share,force_max_N,force_min_N,amplitude_share,"
               "substeps\n");
  std::fprintf(trace, "law,young_Pa,t,force_N\n");
  for (const test::belt::Rigid &rigid : test::belt::kRigid)
    for (const double young : {3e3, 1e4, 1e5, 3e5, 1e6}) {
      const test::belt::Result r = test::belt::run(rigid.law, young, 300, 34, 8);
      std::fprintf(table, "%s,%s,%s,%g,%.5f,%.5f,%.5f,%.5f,%.5f,%llu\n", bench::machine().c_str(),
                   bench::compiler(), rigid.law, young, r.period, r.period / rigid.period, r.force_max,
                   r.force_min, (r.force_max - r.force_min) / (rigid.force_max - rigid.force_min),
                   static_cast<unsigned long long>(r.substeps));
      for (const test::belt::Sample &s : r.trace)
        std::fprintf(trace, "%s,%g,%.3f,%.6f\n", rigid.law, young, s.t, s.force);
      std::fflush(table);
      std::printf("%s %g done: period %.4f of the rigid one's\n", rigid.law, young, r.period / rigid.period);
      std::fflush(stdout);
    }
  std::fclose(table);
  std::fclose(trace);
  return 0;
}
