// The range of small displacements, and warnings where a body leaves it. Energies are computed occasionally
// and not in each step, so rotations and strains are checked there. Of a turn by theta about an axis n the
// forces are zero with u = tan(theta) n x X, so the antisymmetric part of the gradient is its tangent.
#pragma once
#include <algorithm>
#include <cmath>

#include "entry.h"

namespace model {

class SmallRange {
 public:
  // h: the gradient of a cell's displacement
  void look(uint32_t cell, const double (&h)[3][3]) {
    double turn = 0, strain = 0;
    for (size_t r = 0; r < 3; ++r) {
      const size_t s = (r + 1) % 3;
      const double half = 0.5 * (h[s][r] - h[r][s]);
      turn += half * half;
      strain = std::max({strain, std::fabs(h[r][r]), std::fabs(0.5 * (h[s][r] + h[r][s]))});
    }
    const double beyond = std::max(std::sqrt(turn) / kLargestTurn, strain / kLargestStrain);
    if (beyond > most_.beyond) most_ = {beyond, std::sqrt(turn), strain, cell};
  }

  // Warns when a cell leaves the range, and once more when it is much farther out.
  void warn(const dfm_host *host, const char *who) {
    const Farthest most = most_;
    most_ = {};
    if (!(most.beyond > 1) || warnings_ == kMaxWarnings) return;
    if (warnings_ > 0 && !(most.beyond > kMuchFarther * reported_)) return;
    reported_ = most.beyond;
    ++warnings_;
    say(host, 2, who,
        "cell %u is turned by %.0f degrees and strained by %.0f %% against the rest shape: beyond %.0f "
        "degrees or %.0f %% this model treats rotation as strain, so the body swells and its forces are "
        "wrong; corotational_fem has no such limit",
        most.cell, degrees_of(most.turn), 100 * most.strain, degrees_of(kLargestTurn), 100 * kLargestStrain);
  }

 private:
  // tangent of the rotation, largest strain
  static constexpr double kLargestTurn = 0.27, kLargestStrain = 0.3;
  // Number of warnings. From 15 degrees so much farther is 47.
  static constexpr uint32_t kMaxWarnings = 2;
  static constexpr double kMuchFarther = 4;

  // The cell that is farthest from small displacements: of the limits, tangent of its turn, strain.
  struct Farthest {
    double beyond = 0, turn = 0, strain = 0;
    uint32_t cell = 0;
  };
  // The angle of a tangent to half a degree, for a sentence.
  static double degrees_of(double tangent) {
    if (tangent > 1) return 90 - degrees_of(1 / tangent);
    return 57.3 * tangent / (1 + 0.28 * tangent * tangent);
  }

  Farthest most_;
  double reported_ = 0;  // excess over the range at the last warning
  uint32_t warnings_ = 0;
};

}  // namespace model
