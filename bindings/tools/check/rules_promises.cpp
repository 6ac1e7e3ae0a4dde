// F06 to F11 and F13: each effect that a law promises is measured. A promise that only some parameters
// keep (a static level above the kinetic one, a viscous part) is kept if parameters inside the table's
// ranges show it.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "check/groups.h"
#include "check/model.h"
#include "check/runner.h"

namespace cli::check {
namespace {

void needs_promise(const Subject &subject, const char *effect) {
  if (!promises(*subject.type, effect)) skip("the law does not promise %s", effect);
}

// Parameter sets in which a promise may show: the lively ones, then one value moved at a time over its range.
std::vector<std::vector<double>> candidates(const Subject &subject) {
  const dfm_type &type = *subject.type;
  const std::vector<double> base = lively_params(subject);
  std::vector<std::vector<double>> out{base};
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i].width, ++i) {
    const dfm_param &row = type.params[i];
    std::vector<double> values;
    if (row.flags & (DFM_PARAM_ENUM | DFM_PARAM_INTEGER)) {
      for (int k = 0; k <= 8 && row.min + k <= row.max; ++k) values.push_back(row.min + k);
    } else {
      for (const double factor : {1.5, 0.5, 10.0, 0.1}) values.push_back(row.def * factor);
      for (int decade = -4; decade <= 6; decade += 2) values.push_back(std::pow(10.0, decade));
    }
    for (const double v : values) {
      std::vector<double> moved = base;
      for (uint32_t k = 0; k < row.width; ++k) moved[at + k] = v;
      if (v >= row.min && v <= row.max && moved != base && refusal(law_of(subject), moved).empty())
        out.push_back(std::move(moved));
    }
  }
  return out;
}

// The first candidate that shows it; what show() returns where it does not is kept for the sentence.
template <class Show>
std::string some_candidate(const Subject &subject, const char *sentence, Show show) {
  std::string first;
  for (const std::vector<double> &params : candidates(subject)) {
    const Law law(subject, params);
    std::string why;
    const std::string shown = show(law, scales_of(law), &why);
    if (!shown.empty()) return shown;
    if (first.empty()) first = why;
  }
  broken(sentence, first.c_str());
}

// Masses brought to a load within a second, at fine steps.
void load_up(Masses &masses, const std::vector<double> &load) {
  constexpr int kSteps = 1000;
  std::vector<double> force(load.size());
  for (int k = 1; k <= 2 * kSteps; ++k) {
    for (size_t i = 0; i < load.size(); ++i)
      force[i] = load[i] * std::min(1.0, static_cast<double>(k) / kSteps);
    masses.step(force, 1e-3);
  }
}

double presliding_or_break(const Scales &s) {
  if (s.z > 0) return s.z;
  broken(
      "a small displacement leaves no elastic force, so there is no presliding; keep a bristle in a state "
      "slot, or drop the promise");
}

}  // namespace

std::string holds_below_threshold(const Subject &subject) {
  needs_promise(subject, "stiction");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  const std::vector<double> shares{0.1, 0.5, 0.9};
  std::vector<double> load;
  for (const double share : shares) load.push_back(share * s.level);
  Masses masses(law, s, 3);
  load_up(masses, load);
  for (int k = 0; k < 3000; ++k) masses.step(load, 1e-2);
  const std::vector<double> begin = masses.x;
  for (int k = 0; k < 30000; ++k) masses.step(load, 1.0 / 30);
  double worst = 0;
  for (size_t i = 0; i < shares.size(); ++i) {
    const double moved = std::fabs(masses.x[i] - begin[i]);
    worst = std::max(worst, moved);
    if (!(moved < 1e-9))
      broken(
          "under %g of its limit of %.3g N it moves by %.3g m in 1000 s (1e-9 m allowed); let the force at "
          "rest neither relax nor need a speed",
          shares[i], s.level, moved);
  }
  return text("moved %.1e m in 1000 s", worst);
}

std::string falls_with_speed(const Subject &subject) {
  needs_promise(subject, "stribeck");
  const std::vector<double> speeds = decades(1e-5, 10, 8);
  return some_candidate(subject,
                        "it promises stribeck, but %s for none of the parameters tried; let the level fall "
                        "from mu_S to mu_C with speed, or drop the promise",
                        [&](const Law &law, const Scales &s, std::string *why) -> std::string {
                          const std::vector<double> f = steady_force(law, s, speeds);
                          double top = 0, fall = 0;
                          for (const double x : f) {
                            top = std::max(top, x);
                            fall = std::max(fall, (top - x) / top);
                          }
                          *why = "the steady force falls nowhere between 1e-5 and 10 m/s";
                          return fall > 0.01 ? text("falls by %.0f %%", 100 * fall) : "";
                        });
}

std::string rises_at_high_speed(const Subject &subject) {
  needs_promise(subject, "viscous");
  return some_candidate(subject,
                        "it promises viscous, but %s for any of the parameters tried; add a term that grows "
                        "with speed, or drop the promise",
                        [&](const Law &law, const Scales &s, std::string *why) -> std::string {
                          const std::vector<double> f = steady_force(law, s, {10, 100});
                          *why = "the steady force does not rise between 10 and 100 m/s";
                          return f[1] > f[0] * (1 + 1e-9) ? text("%.3g N s/m", (f[1] - f[0]) / 90) : "";
                        });
}

// ---- presliding -------------------------------------------------------------------------------------------

namespace {

// Force along a path of displacements, at a rate: the same displacements, each step taking as long as
// the rate says.
std::vector<double> along(const Law &law, const Scales &s, const std::vector<double> &path, double h) {
  Lanes b(law, 1);
  if (law.needs(DFM_NEED_FN)) b.fn[0] = s.fn;
  std::vector<double> out;
  for (size_t k = 1; k < path.size(); ++k) {
    b.slip(0, (path[k] - path[k - 1]) / h, 0);
    b.must(h);
    b.commit();
    out.push_back(-b.out_ft[0]);
  }
  return out;
}

std::vector<double> to_and_fro(double amplitude, int steps_per_leg, int legs) {
  std::vector<double> out{0};
  for (int leg = 0; leg < legs; ++leg) {
    const double from = leg == 0 ? 0 : (leg % 2 ? amplitude : -amplitude);
    const double to = leg % 2 ? -amplitude : amplitude;
    for (int k = 1; k <= steps_per_leg; ++k) out.push_back(from + (to - from) * k / steps_per_leg);
  }
  return out;
}

}  // namespace

std::string presliding_is_displacement(const Subject &subject) {
  needs_promise(subject, "presliding");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  const double z = presliding_or_break(s);
  const std::vector<double> path = to_and_fro(0.8 * z, 400, 3);
  const std::vector<double> fast = along(law, s, path, 1.0 / 3000);
  const std::vector<double> slow = along(law, s, path, 1.0 / 300);
  const std::vector<double> slowest = along(law, s, path, 1.0 / 30);
  const double early = most_apart(fast, slow), late = most_apart(slow, slowest);
  if (!(late <= 0.01 * s.level) || !(late <= 0.3 * early + 2e-5 * s.level))
    broken(
        "along one presliding path the force still changes by %.3g N when the rate falls from a tenth to a "
        "hundredth (%.3g N before, of a level of %.3g N); let slip path, not time, change the state",
        late, early, s.level);
  const double small = std::fabs(along(law, s, {0, 0.01 * z}, 1.0 / 30)[0]);
  if (!(small < 0.1 * s.level))
    broken(
        "a hundredth of the presliding displacement gives %.3g N of %.3g N, so the contact is rigid; make "
        "the bristle softer, or drop the promise",
        small, s.level);
  return text("%.3g m, %.3g N/m, rate changes it by %.1e of the level", z, s.stiffness, late / s.level);
}

std::string loop_has_area(const Subject &subject) {
  needs_promise(subject, "hysteresis");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  const double z = presliding_or_break(s), amplitude = 1.5 * z;
  constexpr int kLeg = 400;
  const std::vector<double> path = to_and_fro(amplitude, kLeg, 5), force = along(law, s, path, 1.0 / 30);
  double area = 0;
  // the last two legs close a loop
  for (size_t k = 3 * kLeg + 1; k < path.size(); ++k)
    area += 0.5 * (force[k - 2] + force[k - 1]) * (path[k] - path[k - 1]);
  const double share = area / (4 * amplitude * s.level);
  if (!(share > 1e-3))
    broken(
        "a loop of +-%.3g m, one and a half times the presliding displacement, takes %.3g J (%.2g of the "
        "largest possible), though it promises hysteresis; let the bristle yield before the level, or drop "
        "the promise",
        amplitude, area, share);
  return text("%.0f %% of a full loop", 100 * share);
}

// ---- break-away -------------------------------------------------------------------------------------------

std::string breaks_away(const Subject &subject) {
  needs_promise(subject, "breakaway");
  const std::vector<double> speeds = decades(1e-5, 10, 8), rates{0.3, 1, 3, 10, 30};  // levels per second
  const auto show = [&](const Law &law, const Scales &s, std::string *why) -> std::string {
    const std::vector<double> steady = steady_force(law, s, speeds);
    const auto top = std::max_element(steady.begin(), steady.end() - 1);
    const auto low = std::min_element(top, steady.end());
    // sliding has begun where the steady force has come down to within a hundredth of its least
    double begun = speeds.back();
    for (auto f = low; f != top && *(f - 1) <= 1.01 * *low; --f)
      begun = speeds[static_cast<size_t>(f - 1 - steady.begin())];
    Masses masses(law, s, static_cast<uint32_t>(rates.size()));
    std::vector<double> peak(rates.size(), 0.0), force(rates.size());
    std::vector<bool> slides(rates.size(), false);
    const double h = 5e-4;
    for (int k = 1; k * h * rates[0] < 2.5; ++k) {
      for (size_t i = 0; i < rates.size(); ++i) force[i] = s.level * std::min(2.5, rates[i] * k * h);
      masses.step(force, h);
      for (size_t i = 0; i < rates.size(); ++i) {
        slides[i] = slides[i] || masses.v[i] > begun;
        if (!slides[i]) peak[i] = std::max(peak[i], masses.resist[i]);
      }
      if (std::ranges::all_of(slides, [](bool b) { return b; })) break;
    }
    *why = text(
        "the peak is %.4g N at the slowest ramp and %.4g N at the fastest, above a kinetic level of %.4g N",
        peak.front(), peak.back(), *low);
    bool falls = peak.front() > 1.01 * *low && peak.back() < (1 - 1e-3) * peak.front();
    for (size_t i = 1; i < peak.size(); ++i) falls = falls && peak[i] <= (1 + 1e-3) * peak[i - 1];
    return falls ? text("%.3g to %.3g of the kinetic level", peak.front() / *low, peak.back() / *low) : "";
  };
  return some_candidate(subject,
                        "it promises breakaway, but %s, for all parameters tried; let the state lag behind "
                        "the slip, or drop the promise",
                        show);
}

// ---- drift ------------------------------------------------------------------------------------------------

std::string does_not_drift(const Subject &subject) {
  needs_promise(subject, "stiction");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  // Shares of the level: bias and amplitude; the largest sum lies well inside what any elastic zone carries.
  const struct { double bias, amplitude; } loads[] = {{0.2, 0.25}, {0.3, 0.1}, {-0.1, 0.3}, {0.05, 0.4}};
  constexpr int kCycle = 250, kWarm = 4, kCycles = 24;
  Masses masses(law, s, std::size(loads));
  std::vector<double> load(std::size(loads)), begin;
  for (size_t i = 0; i < load.size(); ++i) load[i] = loads[i].bias * s.level;
  load_up(masses, load);
  for (int k = 1; k <= kCycle * kCycles; ++k) {
    for (size_t i = 0; i < load.size(); ++i)
      load[i] = s.level * (loads[i].bias + loads[i].amplitude * std::sin(6.283185307179586 * k / kCycle));
    masses.step(load, 1.0 / kCycle);
    if (k == kCycle * kWarm) begin = masses.x;
  }
  double worst = 0;
  for (size_t i = 0; i < load.size(); ++i) {
    const double drift = std::fabs(masses.x[i] - begin[i]) / (kCycles - kWarm);
    worst = std::max(worst, drift);
    if (!(drift <= 1e-6 * s.length()))
      broken(
          "a load of %g +- %g of its limit, which it should hold, moves it by %.3g m per cycle (elastic "
          "displacement %.3g m); give the bristle a purely elastic zone, or do not promise stiction",
          loads[i].bias, loads[i].amplitude, drift, s.length());
  }
  return text("%.1e m per cycle", worst);
}

}  // namespace cli::check
