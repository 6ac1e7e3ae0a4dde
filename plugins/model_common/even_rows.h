// Weights w > 0 of points for which the rows (sum_b N_ab w_b) / (m_a w_a) are even: of all weights those
// allow the longest step. Some steps of the power method toward the Perron vector of the row sums.
#pragma once
#include <algorithm>
#include <cstdint>

namespace model {

constexpr int kWeightSteps = 20;
constexpr double kMinWeight = 1e-3;  // far from the stiffest place weights need not fall any lower

// add(next) adds sum_b N_ab weight_b to next [npoint].
template <class Add>
void even_rows(uint32_t npoint, const double *mass, double *weight, double *next, const Add &add) {
  std::fill(weight, weight + npoint, 1.0);
  for (int step = 0; step < kWeightSteps; ++step) {
    std::fill(next, next + npoint, 0.0);
    add(next);
    double most = 0;
    for (uint32_t i = 0; i < npoint; ++i) {
      next[i] = mass[i] > 0 ? next[i] / mass[i] : 0;
      most = std::max(most, next[i]);
    }
    for (uint32_t i = 0; i < npoint; ++i) weight[i] = most > 0 ? std::max(next[i] / most, kMinWeight) : 1;
  }
}

}  // namespace model
