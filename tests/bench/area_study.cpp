// The sum of contact areas between two meshes, over the area of the patch, by how the meshes lie on each
// other (doc/concepts/friction_memory.md): a block at 16 places on a pad, up to 5 mm apart, at rest, pulled
// by a tenth of what it holds, and then pressed. Prints a row per place and the range of all.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "two_pads.h"

int main() {
  constexpr int kPlaces = 16;
  constexpr double kReach = 0.01;  // m
  // The R2 sequence of low discrepancy, from the inverse of the plastic number and its square.
  constexpr double kX = 0.7548776662466927, kY = 0.5698402909980532;
  constexpr const char *kWhen[] = {"at rest", "pulled by 0.1 g", "pressed by 3 g"};
  for (int of = 0; of < 2; ++of) {
    double least[3] = {1e9, 1e9, 1e9}, most[3] = {};
    std::printf("%u and %u cells\n", TwoPads::kCells[of][0], TwoPads::kCells[of][1]);
    for (int k = 0; k < kPlaces; ++k) {
      const double x = k ? kReach * (std::fmod(kX * k, 1.0) - 0.5) : 0,
                   y = k ? kReach * (std::fmod(kY * k, 1.0) - 0.5) : 0;
      TwoPads pads(of, x, y);
      std::printf("%8.2f %8.2f mm ", 1e3 * x, 1e3 * y);
      for (int when = 0; when < 3; ++when) {
        if (when > 0) pads.pull(0.1, when == 2 ? 3 : 1);
        test::run(pads.world, when ? 0.9 : 0.6, 1e-3);
        double sum = 0;
        pads.each_loaded([&](const dfm_contact &c) { sum += c.area / TwoPads::kPatch; });
        least[when] = std::min(least[when], sum);
        most[when] = std::max(most[when], sum);
        std::printf(" %6.3f", sum);
      }
      std::printf("\n");
    }
    for (int when = 0; when < 3; ++when)
      std::printf("  %-16s %.3f to %.3f\n", kWhen[when], least[when], most[when]);
  }
  return 0;
}
