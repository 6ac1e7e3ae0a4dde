// F01 to F03, F05, F12, F14: what every friction force is, whatever its law promises beside.
#include <algorithm>
#include <cmath>

#include "check/groups.h"
#include "check/law.h"
#include "check/runner.h"
#include "plane.h"

namespace cli::check {
namespace {

constexpr double kEverySteps[] = {1e-6, 1e-5, 1e-4, 1e-3, 1.0 / 240, 1.0 / 60, 1.0 / 30};

}  // namespace

std::string rests_at_zero(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  Lanes b(law, 7);
  for (const double h : kEverySteps) {
    for (uint32_t i = 0; i < b.n; ++i) {
      if (law.needs(DFM_NEED_FN)) b.fn[i] = i == 0 ? 0 : s.fn * std::pow(10.0, double(i) - 3);
      b.slip(i, 0, 0);
    }
    std::fill_n(b.state, size_t(law.nstate) * b.stride, 0.0);
    // Several steps: a state that ages at rest is no fault, a force that comes of it is.
    for (int k = 0; k < 5; ++k) {
      b.must(h);
      b.commit();
    }
    for (uint32_t i = 0; i < b.n; ++i) {
      if (!(b.ft(i) == 0))
        broken(
            "at rest, with no state and a normal force of %g N, the force is %g N; make the force zero where "
            "slip and state are zero",
            b.fn[i], b.ft(i));
      if (law.nstate == 0 && !(b.stored[i] == 0))
        broken("at rest it reports a stored energy of %g J although it has no state; write 0", b.stored[i]);
    }
  }
  return "";
}

// ---- F02: 360 copies of one history, each turned by a degree more -----------------------------------------

std::string turns_with_frame(const Subject &subject) {
  if (!(law_of(subject).flags & DFM_FRIC_ISOTROPIC)) skip("the law is not flagged DFM_FRIC_ISOTROPIC");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  Random random(subject.seed);
  double worst = 0;
  for (const double h : {1e-4, 1e-2}) {
    Lanes b(law, 361);
    b.press(s.fn);
    for (int step = 0; step < 40; ++step) {
      // as the host turns the state with the frame
      const bool by_host = law.nstate > 0 && step % 8 == 7;
      for (uint32_t i = 1; by_host && i < b.n; ++i) b.turn_state(i, 0, kTurn * i / 360);
      // straight from rest first, then turns and reversals, from presliding to gross sliding
      const double heading = step < 5 ? 0 : random.uniform(0, kTurn);
      const double w = s.length() / h * (step < 5 ? 0.2 : random.logarithmic(0.01, 10));
      const double push = s.level * random.logarithmic(0.1, 10);
      for (uint32_t i = 0; i < b.n; ++i) {
        const double turn = kTurn * i / 360;
        b.slip(i, w * std::cos(heading + turn), w * std::sin(heading + turn));
        b.stop_by(i, -push * std::cos(heading + turn), -push * std::sin(heading + turn));
      }
      b.must(h);
      const double x = b.out_ft[0], y = b.out_ft[b.stride];
      for (uint32_t i = 1; i < b.n; ++i) {
        const double turn = kTurn * i / 360;
        const double ex = x * std::cos(turn) - y * std::sin(turn);
        const double ey = x * std::sin(turn) + y * std::cos(turn);
        const double off = plane_length(b.out_ft[i] - ex, b.out_ft[b.stride + i] - ey);
        const double error = off == 0 ? 0 : off / (b.ft(0) + s.level);
        worst = std::max(worst, error);
        if (!(error <= 1e-12))
          broken(
              "the same history turned by %u degrees%s gives (%.6g, %.6g) N instead of (%.6g, %.6g) N (off "
              "by %.2g of it); %s",
              i, by_host ? ", its state by the host," : "", b.out_ft[i], b.out_ft[b.stride + i], ex, ey,
              error,
              by_host ? "give pairs of its state that point along the slip the kind DFM_SLOT_TANGENT"
                      : "use lengths and dot products of the pairs, never their components");
      }
      b.commit();
    }
  }
  return text("worst %.1e", worst);
}

// ---- F03 --------------------------------------------------------------------------------------------------

namespace {

// A new contact at every speed, the slowest first: the first at which the force is not finite is named.
void finite_at_every_speed(const Law &law, const Scales &s) {
  const std::vector<double> speeds = decades(1e-6, 100, 4);
  Lanes b(law, static_cast<uint32_t>(speeds.size()));
  b.press(s.fn);
  for (uint32_t i = 0; i < b.n; ++i) b.slip(i, speeds[i], 0);
  for (const double h : {1e-5, 1e-3, 1.0 / 60}) {
    b.must(h);
    b.must_be_finite();
  }
}

// Loops of slip: to and fro, round, and eight-shaped; the work of the last of three turns.
void loops_dissipate(const Law &law, const Scales &s) {
  constexpr int kPoints = 240;
  const std::vector<double> sizes = decades(0.03 * s.length(), 3e3 * s.length(), 2);
  const uint32_t kinds = 3, n = static_cast<uint32_t>(sizes.size()) * kinds;
  for (const double h : {1e-5, 1e-3, 1.0 / 60}) {
    Lanes b(law, n);
    b.press(s.fn);
    std::vector<double> work(n, 0.0), moved(n, 0.0);
    for (int turn = 0; turn < 3; ++turn)
      for (int k = 0; k < kPoints; ++k) {
        for (uint32_t i = 0; i < n; ++i) {
          const double a = sizes[i / kinds], p0 = kTurn * k / kPoints, p1 = kTurn * (k + 1) / kPoints;
          const double dx = a * (std::sin(p1) - std::sin(p0));
          const double round = a * (std::cos(p1) - std::cos(p0));
          const double eight = a * (std::sin(2 * p1) - std::sin(2 * p0));
          b.slip(i, dx / h, (i % kinds == 0 ? 0 : i % kinds == 1 ? round : eight) / h);
        }
        b.must(h);
        b.must_be_finite();
        b.commit();
        for (uint32_t i = 0; turn == 2 && i < n; ++i) {
          // slip() pushes far beyond the limit: a law that stops a contact anyway does no work
          const double vx = law.needs(DFM_NEED_VT) ? b.vt[i] : 0;
          const double vy = law.needs(DFM_NEED_VT) ? b.vt[b.stride + i] : 0;
          work[i] -= h * (b.out_ft[i] * vx + b.out_ft[b.stride + i] * vy);
          moved[i] += h * b.ft(i) * plane_length(vx, vy);
        }
      }
    for (uint32_t i = 0; i < n; ++i)
      if (!(work[i] >= -1e-9 * moved[i]))
        broken(
            "a closed loop of slip of %.3g m at steps of %g s produces %.3g J instead of dissipating energy; "
            "let the force oppose the slip (ft = -F)",
            sizes[i / kinds], h, -work[i]);
  }
}

// doc/laws/formulas.md, rule 3 of every law: random slip, steps and normal forces; at no time has more come
// out than was stored, and in each step `stored` grows by no more than what went in.
void gives_back_no_more(const Law &law, const Scales &s, Random &random) {
  constexpr uint32_t kRuns = 64;
  constexpr int kSteps = 2500;
  Lanes b(law, kRuns);
  std::vector<double> work(kRuns, 0.0), moved(kRuns, 0.0), held(kRuns, 0.0);
  std::string misreported;
  for (int k = 0; k < kSteps; ++k) {
    const double h = random.logarithmic(1e-5, 1.0 / 60);
    for (uint32_t i = 0; i < kRuns; ++i) {
      if (law.needs(DFM_NEED_FN))
        b.fn[i] = random.uniform(0, 1) < 0.05 ? 0 : s.fn * random.logarithmic(0.05, 20);
      // half of the runs keep their direction for a while: a bristle must be wound up before it can give back
      const bool straight = i % 2 && k % 50;
      const double w = random.uniform(0, 1) < 0.1 ? 0 : random.logarithmic(1e-5, 3);
      const double heading = straight ? kTurn * i / kRuns : random.uniform(0, kTurn);
      b.slip(i, w * std::cos(heading), w * std::sin(heading));
      if (law.needs(DFM_NEED_FT_STOP)) {
        const double push = w > 0 ? s.level * random.logarithmic(0.01, 100) : 0;
        b.stop_by(i, -push * std::cos(heading), -push * std::sin(heading));
      }
    }
    b.must(h);
    b.must_be_finite();
    b.commit();
    for (uint32_t i = 0; i < kRuns; ++i) {
      // a law that holds (FT_STOP, mode 1) has no slip in this step
      const bool sticks = law.needs(DFM_NEED_FT_STOP) && b.mode[i] == 1;
      const double vx = sticks ? 0 : b.vt[i], vy = sticks ? 0 : b.vt[b.stride + i];
      const double taken = -h * (b.out_ft[i] * vx + b.out_ft[b.stride + i] * vy);
      const double path = h * b.ft(i) * plane_length(vx, vy);
      work[i] += taken;
      moved[i] += path;
      if (!(work[i] >= -1e-9 * moved[i]))
        broken(
            "after %d random steps of slip and normal force it has produced %.3g J although no energy was "
            "stored at the start; damp the state less at high speed, project it on the cone when the normal "
            "force falls, or do not flag DFM_FRIC_PASSIVE",
            k + 1, -work[i]);
      const double grown = b.stored[i] - held[i];
      if (misreported.empty() && !(taken - grown >= -1e-9 * (path + b.stored[i] + held[i])))
        misreported =
            text("in a step of %g s it takes %.6g J and the energy that it reports as stored grows by %.6g J",
                 h, taken, grown);
      held[i] = b.stored[i];
    }
  }
  if (!misreported.empty())
    broken("%s; let `stored` be the energy that its state can give back", misreported.c_str());
}

}  // namespace

std::string dissipates(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  if (!law.needs(DFM_NEED_VT)) skip("the law does not use the slip (no DFM_NEED_VT)");
  const Scales s = scales_of(law);
  finite_at_every_speed(law, s);
  loops_dissipate(law, s);
  if (!law.has(DFM_FRIC_PASSIVE)) return "loops alone: the law is not flagged DFM_FRIC_PASSIVE";
  Random random(subject.seed);
  gives_back_no_more(law, s, random);
  return "";
}

// ---- F05 --------------------------------------------------------------------------------------------------

namespace {

// One input moved by +-d: best agreement over decades of d and over forward, backward and central differences
// (a law has corners, and next to one only one side is its derivative).
struct Difference {
  Difference(const Law &law, const Lanes &at, double h)
      : base(at),
        plus(law, at.n),
        minus(law, at.n),
        step(h),
        best(size_t(at.n) * 2, HUGE_VAL),
        seen(size_t(at.n) * 2, 0.0) {}
  // input(b, i): the varied number, size(i): its scale, given(row, i): the law's derivative, floor(i): zero
  template <class Input, class Size, class Given, class Floor>
  void run(Input input, Size size, Given given, Floor floor) {
    for (int decade = 2; decade <= 7; ++decade) {
      for (uint32_t i = 0; i < base.n; ++i) {
        plus.take(i, base, i);
        minus.take(i, base, i);
        const double d = size(i) * std::pow(10.0, -decade);
        *input(plus, i) += d;
        *input(minus, i) -= d;
      }
      plus.must(step);
      minus.must(step);
      for (uint32_t i = 0; i < base.n; ++i)
        for (uint32_t row = 0; row < 2; ++row) {
          const double up = *input(plus, i);
          const double down = *input(minus, i);
          const double here = *input(const_cast<Lanes &>(base), i);
          const auto f = [&](const Lanes &b) { return b.out_ft[size_t(row) * b.stride + i]; };
          const double returned = given(row, i);
          for (const double seen_now : {(f(plus) - f(minus)) / (up - down), (f(plus) - f(base)) / (up - here),
                                        (f(base) - f(minus)) / (here - down)}) {
            const double off = std::fabs(seen_now - returned);
            const double error = off == 0 ? 0 : off / (std::fabs(returned) + floor(i));
            if (error < best[2 * i + row]) {
              best[2 * i + row] = error;
              seen[2 * i + row] = seen_now;
            }
          }
        }
    }
  }
  const Lanes &base;
  Lanes plus, minus;
  double step;
  std::vector<double> best, seen;
};

}  // namespace

std::string derivatives_agree(const Subject &subject) {
  if (!(law_of(subject).flags & DFM_FRIC_JACOBIAN))
    skip("the law gives no derivatives (no DFM_FRIC_JACOBIAN)");
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  Random random(subject.seed);
  double worst = 0;
  for (const double h : {1e-5, 1e-3, 1.0 / 30}) {
    const uint32_t n = 160;
    Lanes b(law, n);
    // states by a history of their own, then one slip over the decades
    for (int k = 0; k < 6; ++k) {
      for (uint32_t i = 0; i < n; ++i) {
        const double heading = random.uniform(0, kTurn), path = s.length() * random.logarithmic(0.01, 3);
        const double w = k < 5 ? path / h : std::pow(10.0, -6 + 7.0 * (i % 80) / 79);
        if (law.needs(DFM_NEED_FN)) b.fn[i] = s.fn * (k < 5 ? 1.0 : random.logarithmic(0.3, 3));
        b.slip(i, w * std::cos(heading), w * std::sin(heading));
        const double push = s.level * (i % 3 ? 30 : 0.3);
        b.stop_by(i, -push * std::cos(heading), -push * std::sin(heading));
      }
      b.must(h);
      if (k < 5) b.commit();
    }
    for (int c = 0; c < 3; ++c) {
      if (!(c < 2 ? law.needs(DFM_NEED_VT) : law.needs(DFM_NEED_FN))) continue;
      const auto speed = [&](uint32_t i) {
        return law.needs(DFM_NEED_VT) ? plane_length(b.vt[i], b.vt[b.stride + i]) : 0;
      };
      Difference d(law, b, h);
      if (c < 2)
        d.run([&](Lanes &l, uint32_t i) { return &l.vt[size_t(c) * l.stride + i]; }, speed,
              [&](uint32_t row, uint32_t i) { return b.dv[size_t(2 * row + c) * b.stride + i]; },
              [&](uint32_t i) { return 1e-3 * (b.ft(i) + 1e-3 * s.level) / speed(i); });
      else
        d.run([&](Lanes &l, uint32_t i) { return &l.fn[i]; }, [&](uint32_t i) { return b.fn[i]; },
              [&](uint32_t row, uint32_t i) { return b.dn[size_t(row) * b.stride + i]; },
              [&](uint32_t i) { return 1e-3 * (b.ft(i) + 1e-3 * s.level) / b.fn[i]; });
      for (uint32_t i = 0; i < n; ++i)
        for (uint32_t row = 0; row < 2; ++row) {
          worst = std::max(worst, d.best[2 * i + row]);
          if (!(d.best[2 * i + row] <= 1e-4)) {
            const double returned =
                c < 2 ? b.dv[size_t(2 * row + c) * b.stride + i] : b.dn[size_t(row) * b.stride + i];
            broken(
                "%s[%u%u] is given as %.6g and differences say %.6g (slip %.3g m/s, normal force %.3g N, "
                "step %g s); differentiate the same update, or drop DFM_FRIC_JACOBIAN",
                c < 2 ? "dft_dvt" : "dft_dfn", row, c < 2 ? c : 0, returned, d.seen[2 * i + row], speed(i),
                b.fn[i], h);
          }
        }
    }
  }
  return text("worst %.1e", worst);
}

// ---- F12 --------------------------------------------------------------------------------------------------

std::string bounded_at_every_step(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales s = scales_of(law);
  constexpr uint32_t kRuns = 48;
  constexpr int kSteps = 150;
  double reference = 0, worst = 0;
  // The fine steps of 1e-6 and 1e-4 s say how large the force is under such slip.
  std::vector<double> steps{1e-6, 1e-4};
  steps.insert(steps.end(), std::begin(kEverySteps), std::end(kEverySteps));
  for (size_t at = 0; at < steps.size(); ++at) {
    const double h = steps[at];
    Random random(subject.seed);
    Lanes b(law, kRuns);
    double peak = 0;
    for (int k = 0; k < kSteps; ++k) {
      for (uint32_t i = 0; i < kRuns; ++i) {
        const double heading = random.uniform(0, kTurn);
        const double w = random.uniform(0, 1) < 0.1 ? 0 : random.logarithmic(1e-6, 10);
        if (law.needs(DFM_NEED_FN)) b.fn[i] = random.uniform(0, 1) < 0.1 ? 0 : s.fn * random.uniform(0, 2);
        b.slip(i, w * std::cos(heading), w * std::sin(heading));
      }
      b.must(h);
      b.commit();
      for (uint32_t i = 0; i < kRuns; ++i) {
        double sum = 0;
        for (uint32_t c = 0; c < law.nstate; ++c) sum += std::fabs(b.state[size_t(c) * b.stride + i]);
        peak = std::max(peak, b.ft(i));
        const bool finite = std::isfinite(b.ft(i));
        if (!finite || !std::isfinite(sum))
          broken("at steps of %g s the %s is not finite after %d steps%s; %s", h, finite ? "state" : "force",
                 k + 1, b.inputs(i).c_str(),
                 std::isfinite(sum) ? "return a finite force for every finite slip"
                                    : "update the state implicitly");
        if (b.mode[i] > 2) broken("it writes mode %u; the host knows 0 open, 1 stick and 2 slip", b.mode[i]);
        if (!(b.limit[i] >= 0))
          broken("it writes a limit of %g N; write +inf for a force without a limit, and 0 for no force",
                 b.limit[i]);
        if (!(b.stored[i] >= 0) || !std::isfinite(b.stored[i]))
          broken("it reports a stored energy of %g J; report a finite value that is not negative",
                 b.stored[i]);
      }
    }
    if (at < 2) reference = std::max(reference, peak);
    worst = std::max(worst, peak / reference);
    if (peak > 10 * reference)
      broken(
          "at steps of %g s the force reaches %.3g N where fine steps reach %.3g N; update the state "
          "implicitly",
          h, peak, reference);
  }
  return reference > 0 ? text("largest force %.2f of that at fine steps", worst) : "";
}

// ---- F14 --------------------------------------------------------------------------------------------------

namespace {

// Largest force from first touch to steady slip, by speed: a contact may give it without a spike.
std::vector<double> from_first_touch(const Law &law, const std::vector<double> &speeds, double fn, double h,
                                     int steps) {
  Lanes b(law, static_cast<uint32_t>(speeds.size()));
  b.press(fn);
  std::vector<double> most(speeds.size(), 0.0);
  for (int k = 0; k < steps; ++k) {
    for (uint32_t i = 0; i < b.n; ++i) b.slip(i, speeds[i], 0);
    b.must(h);
    b.commit();
    for (uint32_t i = 0; i < b.n; ++i) most[i] = std::max(most[i], b.ft(i));
  }
  return most;
}

}  // namespace

std::string follows_normal_force(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  if (!law.needs(DFM_NEED_FN)) skip("the law does not use the normal force (no DFM_NEED_FN)");
  const Scales s = scales_of(law);
  const double h = 1e-3;
  const int steps = 400;
  const std::vector<double> speeds{0.05 * s.length() / h, 0.5 * s.length() / h, 0.01, 1};
  // Factors of the normal force, each held for a while: to 0 and back, to 0.1, up by 1e6 and back.
  const std::vector<double> path{1, 0.3, 0.1, 1e-3, 0, 1, 0, 1e-6, 1, 1e6, 1, 1e-6, 1};
  std::vector<std::vector<double>> bound;
  for (const double factor : path) bound.push_back(from_first_touch(law, speeds, factor * s.fn, h, steps));
  // each speed twice: sliding on, and held where it is after the first leg
  Lanes b(law, static_cast<uint32_t>(2 * speeds.size()));
  for (size_t leg = 0; leg < path.size(); ++leg)
    for (int k = 0; k < (leg == 0 ? steps : 60); ++k) {
      b.press(path[leg] * s.fn);
      for (uint32_t i = 0; i < b.n; ++i) {
        const double v = speeds[i / 2];
        b.slip(i, i % 2 && leg > 0 ? 0 : v, 0);
      }
      b.must(h);
      for (uint32_t i = 0; i < b.n; ++i) {
        const double most =
            std::max({1.1 * bound[leg][i / 2], std::isfinite(b.limit[i]) ? 1.1 * s.level * path[leg] : 0.0});
        if (path[leg] == 0 && !(b.ft(i) == 0))
          broken(
              "a contact whose normal force has gone to zero still pulls with %.3g N; return zero force and "
              "the state of rest where fn <= 0",
              b.ft(i));
        if (!(b.ft(i) <= most * (1 + 1e-9)))
          broken(
              "when the normal force goes from %.3g to %.3g N the force is %.3g N, where a contact under "
              "that load gives at most %.3g N (a spike); project the old state on the cone of the new normal "
              "force before the update",
              (leg ? path[leg - 1] : path[leg]) * s.fn, path[leg] * s.fn, b.ft(i), most / 1.1);
      }
      b.commit();
    }
  return "";
}

}  // namespace cli::check
