#include "state/step_sizes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace dfm {
namespace {

using std::numbers::pi;
constexpr double kRounding = 1e-9;  // relative, of the quotient of two sizes
// sizes within this factor are the same step of the ladder: half the distance to the next, a factor of 8/7
constexpr double kSame = 1.06;
// longer sub-steps are used up to this share of the stable one, so that they need not be shortened again soon
constexpr double kRise = 0.9;
// s, for implicit bodies: the first step, before an error is known, and the longest step
constexpr double kFirstOffer = 1e-3, kLongestOffer = 1.0 / 30;
constexpr uint32_t kMinQuietSteps = 64;  // sub-steps: four evaluations of the bound
// share of the stable step that sub-steps may have while a host changes its steps: room for damping
constexpr double kVarying = 0.75;
// s: changes that are further apart do not follow the rhythm of a mode for long
constexpr double kLongestRhythm = 0.1;
// The impulse of damping is divided among sub-steps, so that it meets each mode in several phases: at most
// this share, but at least this one of the stable step squared.
constexpr double kDampingShare = 0.25, kMinDamping = 1e-3;

// The smallest of 1, 2, 3 and (4, 5, 6, 7) 2^k that is not below x.
double count_above(double x) {
  if (!(x > 1)) return 1;
  int e;
  std::frexp(x, &e);  // x < 2^e
  const double unit = std::ldexp(1.0, std::max(0, e - 3));
  return unit * std::ceil(x / unit);
}

double substeps_of(double dt, double longest) { return count_above(dt / longest - kRounding); }

// The largest of (4, 5, 6, 7) 2^k s that is not above x.
double level_below(double x) {
  int e;
  const double m = std::frexp(x, &e);  // in [0.5, 1)
  return std::ldexp(std::floor(8 * m), e - 3);
}

void take(StepLevel &r, double size) {
  if (r.size > 0 && size > r.size) r.patience = std::min(kMaxPatience, 2 * r.patience);
  r.size = size;
  r.quiet_steps = 0;
}

// Decreases at once to `most`, the longest stable size. Increases up to `longer`, which is below it by a
// margin; the larger the gain, the sooner.
void update_level(StepLevel &r, double stable, double most, double longer) {
  if (!(r.size > 0 && r.size <= stable * (1 + kRounding))) return take(r, most);
  if (!(longer > r.size * kSame)) r.quiet_steps = 0;
  const double gain = longer / r.size;
  if (r.quiet_steps >= kMinQuietSteps && r.quiet_steps * (gain * gain) >= r.patience) take(r, longer);
}

void update_offer(StepLevel &r, double stable) {
  if (std::isfinite(stable) && stable > 0)
    update_level(r, stable, level_below(stable), level_below(kRise * stable));
}

void pass(StepLevel &r) { r.quiet_steps += r.quiet_steps < kMaxPatience; }

bool is_valid(const StepLevel &r) {
  return r.size >= 0 && std::isfinite(r.size) && r.quiet_steps <= kMaxPatience &&
         r.patience >= kFirstPatience && r.patience <= kMaxPatience;
}

}  // namespace

double offered_step(const StepSizes &s, double stable) {
  StepLevel r = s.offer;
  update_offer(r, stable);
  return std::isfinite(stable) && stable > 0 ? r.size : stable;
}

double accurate_step(const StepSizes &s) {
  return level_below(s.accurate > 0 ? std::min(s.accurate, kLongestOffer) : kFirstOffer);
}

namespace {

void update_cut(StepLevel &r, double dt, double stable) {
  // If a step differs little from the last one, or is a multiple of its sub-steps, their size is kept.
  const double ratio = dt / r.size, same = r.size > 0 ? count_above(ratio / kSame) : 0;
  if (same > 0 && same <= ratio * kSame) {
    r.size = dt / same;
    update_level(r, stable, dt / substeps_of(dt, stable), dt / substeps_of(dt, kRise * stable));
  } else {
    take(r, dt / substeps_of(dt, stable));
  }
}

// Whether a change is one of the rare ones, forced by the bound or allowed after the patience.
bool earned(const StepSizes &before, const StepSizes &now, double stable) {
  const StepLevel &r = before.cut;
  if (now.offer.size != before.offer.size) return true;
  const double gain = now.cut.size / r.size;
  return gain < 1 ? r.size > stable * (1 + kRounding)
                  : r.quiet_steps >= kMinQuietSteps && r.quiet_steps * (gain * gain) >= r.patience;
}

bool changed_by_host(const StepSizes &before, const StepSizes &now, double stable) {
  return before.cut.size > 0 && differ(now.cut.size, before.cut.size) && !earned(before, now, stable);
}

// A change by d adds to the energy of a mode of frequency w at most the share w d / 2 / (1 - w h / 2);
// damping takes w^2 c. A mode gains repeatedly only if it turns by pi / 2 or more between two changes: so c
// is the largest quotient for w from pi / (2 T) to 2 / stable. That lies at one of the ends.
double damping_of_change(double was, double is, double stable, double since) {
  const double longest = std::max(was, is), time = std::max(longest, std::min(since, kLongestRhythm));
  const double slow = 2 / pi * time / (1 - pi / 4 * longest / time);
  const double fast = 0.5 * stable / (1 - std::min(kRise, longest / stable));
  return 0.5 * std::fabs(is - was) * std::max(slow, fast);
}

}  // namespace

double choose_substeps(StepSizes &s, double dt, double stable, double longest) {
  const StepSizes before = s;
  update_offer(s.offer, stable);
  if (std::isinf(stable)) return substeps_of(dt, longest);
  double most = s.steady < kSteady ? kVarying * stable : stable;
  update_cut(s.cut, dt, most);
  if (changed_by_host(before, s, most)) {
    if (most == stable) {  // until now it was steady
      s.cut = before.cut;
      update_cut(s.cut, dt, kVarying * stable);
    }
    s.damping += damping_of_change(before.cut.size, s.cut.size, stable, s.steady);
    s.steady = 0;
  }
  return std::nearbyint(dt / s.cut.size);
}

double next_damping(StepSizes &s, double h, double stable) {
  if (!(s.damping > 0) || !std::isfinite(stable)) return 0;
  const double square = stable * stable;
  const double room = std::max(0.0, 0.25 * (square - h * h));
  const double change =
      std::min({s.damping, std::max(kDampingShare * s.damping, kMinDamping * square), room});
  s.damping -= change;
  return change;
}

double cut_finer(StepSizes &s, double size, double stable) {
  double parts = 1;
  while (parts < 1e15 && !(size <= parts * stable * (1 + kRounding))) parts *= 2;
  if (parts > 1) take(s.cut, size / parts);
  return parts;
}

bool differ(double size, double other) { return std::fabs(size - other) > kRounding * other; }

void pass(StepSizes &s, double h) {
  pass(s.cut);
  pass(s.offer);
  s.steady = std::min(kSteady, s.steady + h);
}

bool is_valid(const StepSizes &s) {
  return s.accurate >= 0 && is_valid(s.cut) && is_valid(s.offer) && s.steady >= 0 && s.steady <= kSteady &&
         s.damping >= 0 && std::isfinite(s.damping);
}

std::string short_step(double dt, double floor) {
  return format(
      "a step of %g s is below the smallest step of %g s (1 ns for each meter from the origin, at least 1 "
      "ns), in which the rounding of positions would exceed the contact tolerance; take a longer step",
      dt, floor);
}

}  // namespace dfm
