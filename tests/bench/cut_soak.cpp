// Random cuts (support/cut_walk.h): a world per seed, until as many cuts are made as asked for. Prints each
// seed that fails. A table keeps the sum of what has been done, a row per thousand seeds or at the end; the
// next run goes on with the seed after the last one.
//
//   cut_soak [TABLE.csv] [--cuts N] [--seed N] [--each N] [--seconds S] [--commit HASH]
//       N cuts in all (1,000,000), those of the table counted; from seed N on (after the table's last, or 1);
//       at most N cuts in one world (60); begins no world after S seconds
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "cut_walk.h"
#include "machine.h"

namespace {

struct Total {
  uint64_t first = 0, last = 0, cuts = 0, missed = 0, steps = 0, refused = 0, rolled_back = 0, tears = 0,
           pieces = 0, contacts = 0, energy = 0, fast = 0, failed = 0;
  double seconds = 0;
};

// Seed after the last one of the table, and its cuts.
void go_on(const char *file, uint64_t &seed, uint64_t &cuts) {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line)) {
    unsigned long long first = 0, last = 0, made = 0;
    if (std::sscanf(line.c_str(), "%llu,%llu,%llu", &first, &last, &made) != 3) continue;
    seed = std::max<uint64_t>(seed, last + 1);
    cuts += made;
  }
}

void write(const char *file, const Total &t, const std::string &commit) {
  std::FILE *const out = std::fopen(file, "a");
  if (!out) return std::perror(file);
  if (std::ftell(out) == 0)
    std::fprintf(
        out,
        "first_seed,last_seed,cuts,met_nothing,steps,refused,undone,tears,pieces,contacts,energy_steps,fast,"
        "failed,seconds,machine,compiler,commit\n");
  for (const uint64_t n : {t.first, t.last, t.cuts, t.missed, t.steps, t.refused, t.rolled_back, t.tears,
                           t.pieces, t.contacts, t.energy, t.fast, t.failed})
    std::fprintf(out, "%llu,", static_cast<unsigned long long>(n));
  std::fprintf(out, "%.0f,%s,%s,%s\n", t.seconds, bench::machine().c_str(), bench::compiler(),
               commit.c_str());
  std::fclose(out);
}

}  // namespace

int main(int argc, char **argv) {
  uint64_t wanted = 1000000, each = 60, seed = 1, made = 0;
  double seconds = 1e9;
  const char *table = nullptr, *commit = "unknown";
  int at = 1;
  if (argc > 1 && argv[1][0] != '-') {
    table = argv[at++];
    go_on(table, seed, made);
  }
  for (; at < argc; at += 2) {
    const char *const option = argv[at], *const value = at + 1 < argc ? argv[at + 1] : nullptr;
    if (value && !std::strcmp(option, "--cuts")) wanted = std::strtoull(value, nullptr, 10);
    else if (value && !std::strcmp(option, "--seed")) seed = std::strtoull(value, nullptr, 10);
    else if (value && !std::strcmp(option, "--each")) each = std::strtoull(value, nullptr, 10);
    else if (value && !std::strcmp(option, "--seconds")) seconds = std::atof(value);
    else if (value && !std::strcmp(option, "--commit")) commit = value;
    else {
      std::fprintf(
          stderr,
          "usage: cut_soak [TABLE.csv] [--cuts N] [--seed N] [--each N] [--seconds S] [--commit HASH]\n");
      return 2;
    }
  }
  const auto now = [begin = std::chrono::steady_clock::now()] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  Total t, all;
  double from = 0;
  for (; made + all.cuts < wanted && now() < seconds; ++seed) {
    if (t.first == 0) t.first = seed;
    t.last = seed;
    const test::cutting::Walked r = test::cutting::walk_cuts(seed, each);
    for (Total *const sum : {&t, &all}) {
      sum->cuts += r.cuts;
      sum->missed += r.missed;
      sum->steps += r.steps;
      sum->refused += r.refused;
      sum->rolled_back += r.rolled_back;
      sum->tears += r.tears;
      sum->pieces += r.pieces;
      sum->contacts += r.contacts;
      sum->energy += r.energy;
      sum->fast += r.speed >= test::cutting::CutWalk::kFast;
      sum->failed += !r.failure.empty();
    }
    if (r.speed >= test::cutting::CutWalk::kFast)
      std::printf("seed %llu: fast, %.0f m/s\n", static_cast<unsigned long long>(seed), r.speed);
    if (!r.failure.empty())
      std::printf("seed %llu: %s\n", static_cast<unsigned long long>(seed), r.failure.c_str());
    std::fflush(stdout);
    if (table && seed % 1000 == 0) {
      t.seconds = now() - from;
      from = now();
      write(table, t, commit);
      t = {};
    }
  }
  t.seconds = now() - from;
  if (table && t.first > 0) write(table, t, commit);
  std::printf(
      "%llu cuts, %llu met nothing, %llu steps, %llu refused, %llu undone, %llu tears, %llu pieces, %llu "
      "contacts, %llu "
      "steps gained energy, %llu worlds fast, %llu worlds failed, %.0f s\n",
      static_cast<unsigned long long>(made + all.cuts), static_cast<unsigned long long>(all.missed),
      static_cast<unsigned long long>(all.steps), static_cast<unsigned long long>(all.refused),
      static_cast<unsigned long long>(all.rolled_back), static_cast<unsigned long long>(all.tears),
      static_cast<unsigned long long>(all.pieces), static_cast<unsigned long long>(all.contacts),
      static_cast<unsigned long long>(all.energy), static_cast<unsigned long long>(all.fast),
      static_cast<unsigned long long>(all.failed), now());
  return all.failed > 0;
}
