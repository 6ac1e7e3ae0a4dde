#include "state/step_sizes.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace dfm {
namespace {

constexpr double kRounding = 1e-9;  // relative, of the quotient of two sizes
// sizes within this factor are the same rung: half the distance to the nearest rung, a factor of 8/7 away
constexpr double kSame = 1.06;
// longer sub-steps are used up to this share of the stable one, so that they need not be shortened again soon
constexpr double kRise = 0.9;
// s, for implicit bodies: the first step, before an error is known, and the longest step
constexpr double kFirstOffer = 1e-3, kLongestOffer = 1.0 / 30;
constexpr uint32_t kLeastCalm = 64;  // sub-steps: four evaluations of the bound

// The smallest of 1, 2, 3 and (4, 5, 6, 7) 2^k that is not below x.
double count_above(double x) {
  if (!(x > 1)) return 1;
  int e;
  std::frexp(x, &e);  // x < 2^e
  const double unit = std::ldexp(1.0, std::max(0, e - 3));
  return unit * std::ceil(x / unit);
}

double pieces(double dt, double longest) { return count_above(dt / longest - kRounding); }

// The largest of (4, 5, 6, 7) 2^k s that is not above x.
double rung_below(double x) {
  int e;
  const double m = std::frexp(x, &e);  // in [0.5, 1)
  return std::ldexp(std::floor(8 * m), e - 3);
}

void take(Rung &r, double size) {
  if (r.size > 0 && size > r.size) r.patience = std::min(kMostPatience, 2 * r.patience);
  r.size = size;
  r.calm = 0;
}

// Decreases at once to `most`, the longest stable size. Increases up to `longer`, which is below it by a
// margin; the larger the gain, the sooner.
void settle(Rung &r, double stable, double most, double longer) {
  if (!(r.size > 0 && r.size <= stable * (1 + kRounding))) return take(r, most);
  if (!(longer > r.size * kSame)) r.calm = 0;
  const double gain = longer / r.size;
  if (r.calm >= kLeastCalm && r.calm * (gain * gain) >= r.patience) take(r, longer);
}

void settle_offer(Rung &r, double stable) {
  if (std::isfinite(stable) && stable > 0) settle(r, stable, rung_below(stable), rung_below(kRise * stable));
}

void pass(Rung &r) { r.calm += r.calm < kMostPatience; }

bool sound(const Rung &r) {
  return r.size >= 0 && std::isfinite(r.size) && r.calm <= kMostPatience && r.patience >= kFirstPatience &&
         r.patience <= kMostPatience;
}

}  // namespace

double offered_step(const StepSizes &s, double stable) {
  Rung r = s.offer;
  settle_offer(r, stable);
  return std::isfinite(stable) && stable > 0 ? r.size : stable;
}

double accurate_step(const StepSizes &s) {
  return rung_below(s.accurate > 0 ? std::min(s.accurate, kLongestOffer) : kFirstOffer);
}

double choose_pieces(StepSizes &s, double dt, double stable) {
  settle_offer(s.offer, stable);
  if (std::isinf(stable)) return 1;
  Rung &r = s.cut;
  // If a step differs little from the last one, or is a multiple of its sub-steps, their size is kept.
  const double ratio = dt / r.size, same = r.size > 0 ? count_above(ratio / kSame) : 0;
  if (same > 0 && same <= ratio * kSame) {
    r.size = dt / same;
    settle(r, stable, dt / pieces(dt, stable), dt / pieces(dt, kRise * stable));
  } else {
    take(r, dt / pieces(dt, stable));
  }
  return std::nearbyint(dt / r.size);
}

double cut_finer(StepSizes &s, double size, double stable) {
  double parts = 1;
  while (parts < 1e15 && !(size <= parts * stable * (1 + kRounding))) parts *= 2;
  if (parts > 1) take(s.cut, size / parts);
  return parts;
}

bool earned(const StepSizes &before, const StepSizes &now, double stable) {
  const Rung &r = before.cut;
  if (now.cut.size == r.size || !(r.size > 0)) return false;
  if (now.offer.size != before.offer.size) return true;
  const double gain = now.cut.size / r.size;
  return gain < 1 ? r.size > stable * (1 + kRounding)
                  : r.calm >= kLeastCalm && r.calm * (gain * gain) >= r.patience;
}

void pass(StepSizes &s) {
  pass(s.cut);
  pass(s.offer);
}

bool sound(const StepSizes &s) { return s.accurate >= 0 && sound(s.cut) && sound(s.offer); }

std::string short_step(double dt, double floor) {
  return format(
      "a step of %g s is below the smallest step of %g s (1 ns for each meter from the origin, at least 1 "
      "ns), in which the rounding of positions would exceed the contact tolerance; take a longer step",
      dt, floor);
}

}  // namespace dfm
