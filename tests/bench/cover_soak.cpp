// Every model with every coupling, partner, law and integrator (support/cover.h), a row of a table each. Rows
// that the table has are left alone, so that the run may be stopped and taken up again. Exits with 1 where
// something does not hold that is not known to fail.
//
//   cover_soak TABLE.csv [--only TEXT] [--seconds N] [--part I/N] [--commit HASH] [--pairwise 1]
//       rows whose name contains each TEXT; begins no row after N seconds; every Nth row from the Ith (0 ..
//       N - 1) on; the rows of `make test` only
#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include "cover.h"
#include "cover_known.h"
#include "machine.h"

int main(int argc, char **argv) {
  using namespace test::cover;
  if (argc < 2) {
    std::fprintf(stderr, "cover_soak TABLE.csv [--only TEXT] [--seconds N] [--part I/N] [--commit HASH]\n");
    return 2;
  }
  std::vector<std::string> only;
  std::string commit = "unknown";
  double seconds = 1e9;
  size_t part = 0, parts = 1;
  bool all = true;
  for (int i = 2; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--only")) only.emplace_back(argv[i + 1]);
    if (!std::strcmp(argv[i], "--commit")) commit = argv[i + 1];
    if (!std::strcmp(argv[i], "--seconds")) seconds = std::atof(argv[i + 1]);
    if (!std::strcmp(argv[i], "--part")) std::sscanf(argv[i + 1], "%zu/%zu", &part, &parts);
    if (!std::strcmp(argv[i], "--pairwise")) all = false;
  }
  const std::set<std::string> done = bench::names_in(argv[1], 0, int(kAxes));
  std::FILE *table = std::fopen(argv[1], "a");
  if (!table) {
    std::perror(argv[1]);
    return 2;
  }
  if (done.empty())
    std::fprintf(
        table,
        "model,coupling,partner,law,integrator,holds,momentum,cone,cone_cut,work_J,gain,creep_m_s,slide,"
        "slip_m_s,crossings,stuck,unconverged,substeps,cpu_s,machine,compiler,commit,why\n");
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Row> rows = all ? product() : pairwise();
  int bad = 0;
  for (size_t r = part; r < rows.size(); r += parts) {
    const std::string name = columns(rows[r]);
    if (done.count(name) || !std::all_of(only.begin(), only.end(), [&](const std::string &text) {
          return name.find(text) != std::string::npos;
        }))
      continue;
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) break;
    const Seen seen = run(rows[r]);
    std::string why = seen.refused ? seen.reason : "";
    for (const std::string &s : seen.wrong) why += (why.empty() ? "" : "; ") + s;
    const std::string known = known_failure(rows[r]);
    bad += !why.empty() && known.empty();
    const char *const holds = seen.refused     ? "refused"
                              : why.empty()    ? "yes"
                              : !known.empty() ? "known"
                                               : "NO";
    std::fprintf(table, "%s,%s,%.2g,%.2g,%.2g,%.2g,%.2g,%.2g,%.2g,%.2g,%zu,%u,%llu,%llu,%.2f,%s,%s,%s,%s\n",
                 name.c_str(), holds, seen.momentum, seen.cone, seen.cone_cut, seen.work, seen.gain,
                 seen.creep, seen.slide, seen.slip, seen.crossings, seen.stuck,
                 static_cast<unsigned long long>(seen.unconverged),
                 static_cast<unsigned long long>(seen.substeps), seen.cpu, bench::machine().c_str(),
                 bench::compiler(), commit.c_str(), bench::quoted(why).c_str());
    std::fflush(table);
    if (!why.empty()) std::printf("%-70s %s: %s\n", name.c_str(), holds, why.c_str());
    std::fflush(stdout);
  }
  std::fclose(table);
  return bad > 0;
}
