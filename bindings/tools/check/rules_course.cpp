// F15 to F17: how force and state go on from step to step, whatever a law promises.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "check/groups.h"
#include "check/law.h"
#include "check/runner.h"
#include "plane.h"

namespace cli::check {
// ---- F15 --------------------------------------------------------------------------------------------------

// The same 400 steps again and again, at rest, swinging, sliding and at random: what counts time or path
// grows in proportion to it, what feeds on itself faster than any power.
std::string state_stays_bounded(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  if (law.nstate == 0) skip("the law keeps no state");
  const Scales s = scales_of(law);
  constexpr uint32_t kRuns = 32;
  constexpr int kBlocks = 8, kSteps = 400, kFirst = 1;
  // growth from the second block to the last; the square of the time grows by 16
  constexpr double kMax = 100;
  double worst = 0;
  for (const double h : {1e-3, 1.0 / 60}) {
    Lanes b(law, kRuns);
    const size_t n = size_t(law.nstate) * kRuns;
    std::vector<double> before(n, 0.0), block(n, 0.0);
    for (int k = 0; k < kBlocks; ++k) {
      Random random(subject.seed);
      std::ranges::fill(block, 0.0);
      stage("block %d of %d steps of %g s", k + 1, kSteps, h);
      for (int step = 0; step < kSteps; ++step) {
        b.press(s.fn);
        for (uint32_t i = 0; i < kRuns; ++i) {
          const double heading = random.uniform(0, kTurn);
          const double any = random.logarithmic(1e-6, 10);
          const double load = random.uniform(0, 2);
          const double swing =
              0.5 * s.length() * (std::sin(kTurn * (step + 1) / 50) - std::sin(kTurn * step / 50)) / h;
          if (i % 4 == 0) b.slip(i, 0, 0);
          else if (i % 4 == 1) b.slip(i, swing, 0);
          else if (i % 4 == 2) b.slip(i, 1e-3 * std::pow(10.0, i % 3), 0);
          else b.slip(i, any * std::cos(heading), any * std::sin(heading));
          if (i % 4 == 3 && law.needs(DFM_NEED_FN)) b.fn[i] = load < 0.2 ? 0 : s.fn * load;
        }
        b.must(h);
        b.commit();
        for (uint32_t c = 0; c < law.nstate; ++c)
          for (uint32_t i = 0; i < kRuns; ++i) {
            const double size = std::fabs(b.state[size_t(c) * b.stride + i]);
            if (!std::isfinite(size))
              broken(
                  "state %u is no longer finite after %d steps of %g s; make the state tend to a finite "
                  "value",
                  c, k * kSteps + step + 1, h);
            block[size_t(c) * kRuns + i] = std::max(block[size_t(c) * kRuns + i], size);
          }
      }
      if (k == kFirst) before = block;
    }
    for (size_t j = 0; j < n; ++j) {
      if (!(before[j] > 0)) continue;
      worst = std::max(worst, block[j] / before[j]);
      if (block[j] > kMax * before[j])
        broken(
            "state %zu grows by %.3g while the same %d steps of %g s are repeated %d times; make the state "
            "tend to a finite value, or grow at most in proportion to time",
            j / kRuns, block[j] / before[j], kSteps, h, kBlocks - 1 - kFirst);
    }
  }
  return text("grows by %.2g at most", worst);
}

// ---- F16 --------------------------------------------------------------------------------------------------

namespace {

// From rest along each axis, presliding to gross: an isotropic law knows no other direction. What it does
// between the axes is F02's to say.
void stays_on_the_line(const Law &law, const Scales &s) {
  constexpr int kWays[][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (const double h : {1e-4, 1e-2}) {
    Lanes b(law, std::size(kWays));
    b.press(s.fn);
    for (int step = 0; step < 60; ++step) {
      const double w = s.length() / h * (step < 20 ? 0.05 : step < 40 ? 1 : 20) * (step % 13 == 12 ? -1 : 1);
      for (uint32_t i = 0; i < b.n; ++i) b.slip(i, w * kWays[i][0], w * kWays[i][1]);
      b.must(h);
      b.must_be_finite();
      b.commit();
      for (uint32_t i = 0; i < b.n; ++i) {
        const double across = b.out_ft[b.stride + i] * kWays[i][0] - b.out_ft[i] * kWays[i][1];
        if (!(std::fabs(across) <= 1e-9 * (b.ft(i) + s.level)))
          broken(
              "slip along a straight line from rest gives a force that is %.3g rad off that line; make the "
              "force parallel to slip and state",
              std::asin(std::min(1.0, std::fabs(across) / b.ft(i))));
      }
    }
  }
}

}  // namespace

std::string opposes_slip(const Subject &subject) {
  if (!(law_of(subject).flags & DFM_FRIC_ISOTROPIC)) skip("the law is not flagged DFM_FRIC_ISOTROPIC");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  stays_on_the_line(law, s);
  Random random(subject.seed);
  double worst = 0;
  for (const double h : {1e-4, 1e-2}) {
    constexpr uint32_t kPairs = 32;
    // the second half is the first, mirrored in the x axis
    Lanes b(law, 2 * kPairs);
    b.press(s.fn);
    for (int step = 0; step < 60; ++step) {
      for (uint32_t i = 0; i < kPairs; ++i) {
        const double heading = random.uniform(0, kTurn);
        const double w = s.length() / h * random.logarithmic(0.01, 10);
        const double push = s.level * random.logarithmic(0.1, 10);
        for (uint32_t side = 0; side < 2; ++side) {
          const uint32_t at = i + side * kPairs;
          const double x = std::cos(heading), y = side ? -std::sin(heading) : std::sin(heading);
          b.slip(at, w * x, w * y);
          b.stop_by(at, -push * x, -push * y);
        }
      }
      b.must(h);
      b.commit();
      for (uint32_t i = 0; i < kPairs; ++i) {
        const double off = plane_length(b.out_ft[i] - b.out_ft[i + kPairs],
                                        b.out_ft[b.stride + i] + b.out_ft[b.stride + i + kPairs]);
        const double error = off == 0 ? 0 : off / (b.ft(i) + s.level);
        worst = std::max(worst, error);
        if (!(error <= 1e-12))
          broken(
              "a history and its mirror image give forces that are not each other's mirror image (off by "
              "%.2g); use lengths and dot products of the pairs, not cross products",
              error);
      }
    }
  }
  return text("worst %.1e", worst);
}

// ---- F17 --------------------------------------------------------------------------------------------------

// One history of slip, oscillating and steady, in steps of 1e-3 to 1e-6 s: at the same times the forces must
// converge. The oscillation reverses between these times: where it reverses, the mean slip of a step is as
// small as the step, and a force that depends on the logarithm of the slip differs for every step.
std::string converges_with_step(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  constexpr uint32_t kRuns = 8;
  constexpr int kSamples = 10;
  constexpr double kBetween = 2e-3;                       // s
  constexpr double kPeriod = 0.85 * kSamples * kBetween;  // s; turns 0.25 ms from a sample, or farther
  const auto amplitude_of = [&](uint32_t run) {
    return s.length() * std::pow(4.0, static_cast<double>(run / 2) - 1);
  };
  std::vector<std::vector<double>> course;
  const std::vector<int> cuts{2, 20, 200, 2000};
  for (const int cut : cuts) {
    const double h = kBetween / cut;
    Lanes b(law, kRuns);
    b.press(s.fn);
    course.emplace_back();
    stage("steps of %g s", h);
    for (int k = 0; k < kSamples * cut; ++k) {
      for (uint32_t i = 0; i < kRuns; ++i) {
        const double amplitude = amplitude_of(i), t0 = k * h;
        const double swing =
            amplitude * (std::sin(kTurn * (t0 + h) / kPeriod) - std::sin(kTurn * t0 / kPeriod)) / h;
        b.slip(i, i % 2 ? amplitude / (kSamples * kBetween) : swing, 0);
      }
      b.must(h);
      b.commit();
      if ((k + 1) % cut == 0)
        for (uint32_t i = 0; i < kRuns; ++i) course.back().push_back(b.out_ft[i]);
    }
  }
  std::vector<double> apart;  // shares of the level, from one cut to the next
  size_t where = 0;           // sample and run of the last one
  for (size_t c = 1; c < course.size(); ++c) {
    double most = 0;
    for (size_t j = 0; j < course[c].size(); ++j)
      if (const double off = std::fabs(course[c][j] - course[c - 1][j]) / s.level; off > most) {
        most = off;
        where = j;
      }
    apart.push_back(most);
  }
  if (!(apart[2] <= 0.5 * std::max(apart[0], apart[1]) + 0.02)) {
    const uint32_t run = where % kRuns;
    broken(
        "the same slip cut into steps of 1e-5 and of 1e-6 s gives forces that differ by %.3g of the level "
        "(%.3g from 1e-4 to 1e-5 s), so it does not converge: %.6g and %.6g N, %g ms after the state was 0, "
        "in a slip %s %.2g m; use dt to move the state only, and divide only its changes by dt",
        apart[2], apart[1], course[2][where], course[3][where], 1e3 * kBetween * (where / kRuns + 1.0),
        run % 2 ? "at constant speed over" : "that swings by", amplitude_of(run));
  }
  return text("%.1e, %.1e, %.1e of the level apart", apart[0], apart[1], apart[2]);
}

}  // namespace cli::check
