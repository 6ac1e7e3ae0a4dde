// Line search for Newton's corrections.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace dfm {

// a . b over all components, in order.
template <class Values>
double product(const Values &a, const Values &b) {
  double sum = 0;
  for (size_t j = 0; j < a.size(); ++j) sum += a[j] * b[j];
  return sum;
}

// Moves along a direction by the whole way, or by less where the slope at the end would be negative and more
// than half as large as at the start. start: the slope at the beginning, above zero. move(share) moves on by
// a share of the way; slope(value) writes the slope there, or returns false if it is unknown: then the way is
// halved. False: the slope is unknown at the end, too.
template <class Move, class Slope>
bool search_line(double start, uint32_t cuts, const Move &move, const Slope &slope) {
  constexpr double kOvershoot = 0.5;
  double share = 1, now = 0;
  move(1.0);
  for (uint32_t cut = 0; cut < cuts; ++cut) {
    const bool known = slope(now);
    if (known && now >= -kOvershoot * start) return true;
    const double next = share * (known ? std::clamp(start / (start - now), 0.1, 0.7) : 0.5);
    move(next - share);
    share = next;
  }
  return slope(now);
}

}  // namespace dfm
