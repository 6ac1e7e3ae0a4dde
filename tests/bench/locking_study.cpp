// Locking near poisson 1/2: displacement over the truth of linear tetrahedra, locked and with the volume
// change by points (`locking` none and nodal). The table of doc/models/corotational_fem.md.
#include <cstdio>

#include "locking.h"

int main() {
  std::puts("case,mesh,poisson,none,nodal");
  for (const bool sphere : {false, true})
    for (int mesh = 1; mesh <= 2; ++mesh)
      for (const double poisson : {0.3, 0.45, 0.49, 0.499})
        std::printf("%s,%d,%g,%.3f,%.3f\n", sphere ? "sphere" : "cylinder", mesh, poisson,
                    test::lame(sphere, mesh, poisson, 0), test::lame(sphere, mesh, poisson, 1));
  for (int mesh = 2; mesh <= 3; ++mesh)
    for (const double poisson : {0.3, 0.45, 0.49, 0.499})
      std::printf("bar,%d,%g,%.3f,%.3f\n", mesh, poisson, test::bent_bar(mesh, poisson, 0),
                  test::bent_bar(mesh, poisson, 1));
  for (int mesh = 1; mesh <= 3; ++mesh)
    std::printf("cook,%d,0.4999,%.3f,%.3f\n", mesh, test::cooks_membrane(mesh, 0),
                test::cooks_membrane(mesh, 1));
  return 0;
}
