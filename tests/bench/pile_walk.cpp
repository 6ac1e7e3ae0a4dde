// Walks random piles (support/pile.h) until it has made the steps asked for with every law, and prints what
// failed: seed, step, and what the law was asked.
//
//   pile_walk [--law NAME] [--seed N] [--steps N] [--step S]
//       from seed N (1) on, 1,000 steps a pile; in all N steps (100,000) per law
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "pile.h"
#include "support.h"

int main(int argc, char **argv) {
  std::string only;
  uint64_t first = 1, steps = 100000;
  double h = 1e-3;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--law")) {
      only = argv[i + 1];
    } else if (!std::strcmp(argv[i], "--seed")) {
      first = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (!std::strcmp(argv[i], "--steps")) {
      steps = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (!std::strcmp(argv[i], "--step")) {
      h = std::atof(argv[i + 1]);
    } else {
      std::fprintf(stderr, "pile_walk [--law NAME] [--seed N] [--steps N] [--step S]\n");
      return 2;
    }
  }
  int failed = 0;
  for (const char *law : {"none", "coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"}) {
    if (!only.empty() && only != law) continue;
    uint64_t done = 0, substeps = 0, unconverged = 0, bad = 0;
    for (uint64_t seed = first; done < steps; ++seed) {
      const test::pile::Result r = test::pile::walk(law, seed, std::min<uint64_t>(1000, steps - done), h);
      done += std::max<uint64_t>(r.steps, 1);
      substeps += r.substeps;
      unconverged += r.unconverged;
      bad += !r.failure.empty();
      if (!r.failure.empty())
        std::printf("%s seed %llu, %u bodies: %s\n", law, static_cast<unsigned long long>(seed), r.bodies,
                    r.failure.c_str());
      std::fflush(stdout);
    }
    std::printf("%-14s %llu steps, %llu sub-steps, %llu unconverged, %llu piles failed\n", law,
                static_cast<unsigned long long>(done), static_cast<unsigned long long>(substeps),
                static_cast<unsigned long long>(unconverged), static_cast<unsigned long long>(bad));
    failed += bad > 0;
  }
  return failed > 0;
}
