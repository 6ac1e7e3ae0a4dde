// Every step is implicit: the law answers at the speed of its end, m (v' - v)/h = f(t') - F(v'), x' = x + h
// v'. The slip that the law sees is v' exactly, nothing that rests moves, and a spring of any stiffness stays
// stable. That is first order, as the laws' own updates are (doc/laws/formulas.md (8)); a mass under a law
// that does not jump at rest is taken to second order by extrapolation. Where the motion is prescribed the
// law is given its mean over the step and left to its own order.
#include "rig.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "messages.h"
#include "plane.h"

namespace cli {
namespace {

constexpr double kTwoPi = 6.283185307179586476925286766559;
// N s/m: a prescribed motion does not yield, so the force that would stop it is almost infinite
constexpr double kFirmDrive = 1e18;
constexpr double kMaxSteps = 2e9;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double sinc(double a) { return std::fabs(a) < 1e-8 ? 1.0 : std::sin(a) / a; }

struct Motion { double vx = 0, vy = 0; };

class Rig {
 public:
  Rig(const FrictionCase &rig, RigLaw &law, double step, Progress &progress)
      : case_(rig), law_(law), step_(step), progress_(progress) {
    out_.columns = rig.columns;
    fn_ = law.normal_force();
    sigma0_ = law.tangent(0) >= 0 ? law.param("sigma0", 0) : 0;
  }

  RigResult run() {
    try {
      if (case_.drive == Drive::ramps) ramps();
      else if (case_.drive == Drive::path) path();
      else timed();
    } catch (const Failure &failure) {
      if (failure.exit_code != kStopped) throw;
      out_.stopped =
          "step " + std::to_string(out_.steps) + ", t = " + short_text(t_) + " s: " + failure.what();
    }
    return out_;
  }

 private:
  static std::string short_text(double x) { return formatted("%.6g", x); }
  double in(const char *key) const { return case_.input.at(key); }
  bool pushed() const {
    return case_.drive == Drive::force || case_.drive == Drive::spring || case_.drive == Drive::ramps;
  }
  double z(int axis) const {
    return law_.tangent(0) < 0 ? 0.0 : law_.state(uint32_t(law_.tangent(0) + axis));
  }
  double elastic_force() const { return sigma0_ > 0 ? sigma0_ * z(0) : fx_; }

  // ---- what drives ----

  double force(double t) const {
    if (case_.drive == Drive::ramps) return rate_ * t;
    if (case_.drive == Drive::spring) return in("k") * (in("V") * t - x_);
    return in("bias") + in("amp") * std::sin(kTwoPi * in("freq") * t + in("phase"));
  }

  Motion motion(double t) const { return mean_motion(t, t); }

  // Mean velocity between t and t1, by the closed form of the path.
  Motion mean_motion(double t, double t1) const {
    const double middle = 0.5 * (t + t1), half = 0.5 * (t1 - t), speed = in("V");
    if (case_.drive == Drive::circle) {
      const double omega = speed / in("R"), share = sinc(omega * half);
      return {speed * share * std::cos(omega * middle), speed * share * std::sin(omega * middle)};
    }
    if (case_.drive == Drive::turn) {
      const double angle = middle < in("t_turn") ? 0.0 : in("turn_angle");
      return {speed * std::cos(angle), speed * std::sin(angle)};
    }
    const bool loaded = case_.drive == Drive::loaded;
    const double omega = kTwoPi * in(loaded ? "vfreq" : "freq"), phase = in(loaded ? "vphase" : "phase");
    return {speed * std::sin(omega * middle + phase) * sinc(omega * half), 0};
  }

  double load(double t) const {
    return case_.drive == Drive::loaded ? in("F0") * (1 + in("a_open") * std::sin(kTwoPi * in("freq") * t))
                                        : law_.normal_force();
  }

  // ---- one step ----

  Slip slip_of(double h) const {
    Slip s;
    s.dt = h;
    s.fn = std::max(fn_, 0.0);
    s.dwell = dwell_;
    return s;
  }

  void push(double t, double t1) {
    if (law_.jumps_at_rest()) out_.jumps += euler(t, t1, 0.5).on_jump;
    else extrapolated(t, t1);
    if (!std::isfinite(x_)) throw Failure(kStopped, "the position of the mass is no longer finite");
  }

  // Implicit Euler. The spring pulls as at x + h (s v' - (1 - s) v): s = 1 is x'; s = 1/2 is the leapfrog
  // method with the stiffness k/(1 + k h^2/2m), since x' = x + h v'. That neither damps the slip phase, whose
  // length sets the period, as a spring at x' would, nor bounds the step as one at x would.
  StepResult euler(double t, double t1, double s) {
    const double h = t1 - t;
    const double kh = case_.drive == Drive::spring ? h * in("k") : 0;
    const double m_h = case_.mass / h + s * kh;
    const StepResult r =
        implicit_step(law_, slip_of(h), m_h, (m_h - (2 * s - 1) * kh) * v_.vx + force(t1), v_.vx);
    law_.commit();
    v_.vx = r.u;
    fx_ = r.f;
    fy_ = 0;
    x_ += h * r.u;
    return r;
  }

  // Implicit Euler once over the whole step and once over its halves: 2 halves - whole is of second order and
  // still damps what is stiff (Deuflhard 1985, SIAM Review 27, p. 505; Hairer and Wanner, Solving ODEs II,
  // IV.9). The first order alone would damp a mass that rings on its bristles by a share of h omega / 2.
  // Where there may be several solutions, or a jump held the mass, both need not have taken the same one: use
  // the halves. Force and bristles are taken as far as the law can carry them, and as the halves have them
  // where those differ from the whole in a flag.
  void extrapolated(double t, double t1) {
    const double middle = 0.5 * (t + t1), x = x_, v = v_.vx;
    before_ = law_.memory();
    const StepResult whole = euler(t, t1, 1);
    const double whole_x = x_;
    whole_ = law_.memory();
    law_.recall(before_);
    x_ = x;
    v_.vx = v;
    const StepResult first = euler(t, middle, 1);
    dwell_ += middle - t;
    const StepResult second = euler(middle, t1, 1);
    dwell_ -= middle - t;
    const bool jumps = whole.on_jump || first.on_jump || second.on_jump;
    out_.jumps += jumps;
    if (jumps || whole.falls || first.falls || second.falls) return;
    const double more = second.f - whole.f, room = std::copysign(second.limit, more) - second.f;
    const double share = law_.differs(whole_)                        ? 0
                         : std::fabs(second.f + more) > second.limit ? std::clamp(room / more, 0.0, 1.0)
                                                                     : 1;
    law_.extrapolate(whole_, share);
    x_ = 2 * x_ - whole_x;
    v_.vx = 2 * second.u - whole.u;
    fx_ = second.f + share * more;
  }

  void lead(double t, double t1, double h, const Motion &mean) {
    Slip s = slip_of(h);
    s.vx = mean.vx;
    s.vy = mean.vy;
    s.stop_x = -kFirmDrive * s.vx;
    s.stop_y = -kFirmDrive * s.vy;
    const Resistance r = law_.eval(s);
    law_.commit();
    fx_ = r.fx;
    fy_ = r.fy;
    x_ += h * mean.vx;
    work_ += h * (r.fx * mean.vx + r.fy * mean.vy);
    if (case_.drive == Drive::velocity && in("freq") > 0) {
      const auto half = size_t(in("freq") * (t + t1));  // 2 freq times the middle of the step
      half_work_.resize(std::max(half_work_.size(), half + 1));
      half_work_[half] += h * r.fx * mean.vx;
    }
  }

  void advance(double t, double t1) {
    const double h = t1 - t;
    fn_ = load(t1);
    if (pushed()) push(t, t1);
    else lead(t, t1, h, mean_motion(t, t1));
    if (!pushed()) v_ = motion(t1);
    dwell_ = fn_ > 0 ? dwell_ + h : 0;
    t_ = t1;
    ++out_.steps;
  }

  // The force at this very instant, where no step has led to it (the start, a jump of the velocity): the
  // answer to a step that is next to nothing, which is then dropped.
  void look() {
    fn_ = load(t_);
    if (!pushed()) v_ = motion(t_);
    Slip s = slip_of(1e-6 * step_);
    s.vx = v_.vx;
    s.vy = v_.vy;
    s.stop_x = pushed() ? -(force(t_) + case_.mass * s.vx / s.dt) : -kFirmDrive * s.vx;
    s.stop_y = pushed() ? 0 : -kFirmDrive * s.vy;
    const Resistance r = law_.eval(s);
    fx_ = r.fx;
    fy_ = r.fy;
  }

  // ---- rows ----

  double cell(const std::string &name) const {
    if (name == "t") return t_;
    if (name == "x") return x_;
    if (name == "v" || name == "vx") return v_.vx;
    if (name == "vy") return v_.vy;
    if (name == "F" || name == "Fx") return fx_;
    if (name == "Fy") return fy_;
    if (name == "z" || name == "zx") return z(0);
    if (name == "zy") return z(1);
    if (name == "Fn") return fn_;
    if (name == "F_elastic") return elastic_force();
    if (name == "closed") return fn_ > 0 ? 1 : 0;
    return element_force(uint32_t(std::stoul(name.substr(1)) - 1));
  }

  // The force of one of several bristles: its state times its stiffness.
  double element_force(uint32_t i) const {
    const int at = law_.tangent(i);
    return at < 0 ? 0.0 : law_.state(uint32_t(at)) * law_.param("k", 1, i);
  }

  void check_columns() const {
    std::vector<std::string> known = {"t",  "x",  "v",  "F",  "z",  "vx",        "vy",
                                      "zx", "zy", "Fx", "Fy", "Fn", "F_elastic", "closed"};
    // elements of a law with several bristles
    for (int e = 1; e <= 16; ++e) known.push_back("f" + std::to_string(e));
    require(known);
  }
  void require(const std::vector<std::string> &known) const {
    for (const std::string &name : case_.columns)
      if (std::ranges::find(known, name) == known.end()) {
        std::string all;
        for (const std::string &k : known) all += (all.empty() ? "" : " ") + k;
        throw Failure(kBadInput, case_.file + ": /columns names \"" + name + "\", expected some of " + all +
                                     did_you_mean(name, known));
      }
  }

  void record() {
    std::vector<double> row;
    for (const std::string &name : case_.columns) row.push_back(cell(name) + 0.0);  // -0 reads as 0
    out_.rows.push_back(row);
  }

  void figure(const std::string &name, double value) { out_.figures.push_back({name, {value}}); }

  // ---- the runs ----

  void refuse_too_many(double steps) const {
    if (steps > kMaxSteps)
      throw Failure(kBadInput, "--step " + short_text(step_) + " s means " + short_text(steps) +
                                   " steps, expected 2e9 at most");
  }

  void restart() {
    law_.reset(case_);
    t_ = 0;
    x_ = case_.x0;
    v_ = {case_.v0, 0};
    dwell_ = 0;
    fx_ = fy_ = 0;
    if (case_.drive != Drive::path) look();
  }

  void show(double end) {
    if (out_.steps % 4096 == 0) progress_.show(t_, end, 0);
  }

  void timed() {
    check_columns();
    restart();
    const double end = case_.times.back();
    refuse_too_many(end / step_);
    if (case_.drive == Drive::velocity && !(in("freq") * step_ <= 0.5))
      throw Failure(kBadInput, case_.file + ": /input/freq: half a cycle is shorter than the step of " +
                                   short_text(step_) + " s; reduce \"freq\", which is in Hz, or --step");
    const bool turns = case_.drive == Drive::circle || case_.drive == Drive::turn;
    const auto force_now = [&] { return (turns ? plane_length(fx_, fy_) : fx_) + 0.0; };
    const auto speed_now = [&] { return plane_length(v_.vx, v_.vy); };
    double highest = force_now(), lowest = highest, fastest = speed_now();
    for (const double row : case_.times) {
      std::vector<double> stops = {row};
      if (case_.drive == Drive::turn && in("t_turn") > t_ && in("t_turn") < row)
        stops.insert(stops.begin(), in("t_turn"));
      for (const double to : stops) {
        const double from = t_, span = to - from;
        const auto n = int64_t(std::max(std::ceil(span / step_ - 1e-6), span > 0 ? 1.0 : 0.0));
        for (int64_t k = 1; k <= n; ++k) {
          const double before = v_.vx;
          advance(t_, k == n ? to : from + span * double(k) / double(n));
          if (case_.drive == Drive::spring) watch(before);
          highest = std::max(highest, force_now());
          lowest = std::min(lowest, force_now());
          fastest = std::max(fastest, speed_now());
          show(end);
        }
      }
      if (case_.drive == Drive::turn && row == in("t_turn")) look();
      record();
    }
    figure("F_max", highest);
    figure("F_min", lowest);
    figure("v_max", fastest);
    figure("x_end", x_ + 0.0);
    if (!pushed()) figure("work_J", work_);
    if (!half_work_.empty()) out_.figures.push_back({"work_per_half_cycle_J", half_work_});
    if (case_.drive == Drive::spring) spring_figures();
  }

  static constexpr double kSlow = 0.01;  // of the pull: laws without exact rest stick below it
  // Stick-slip: a cycle begins where the mass overtakes what pulls the spring.
  void watch(double before) {
    const double pull = in("V");
    if (before < pull && v_.vx >= pull) {
      const double h = last_ < t_ ? t_ - last_ : 0;
      overtakes_.push_back(t_ - h * (v_.vx - pull) / (v_.vx - before));
    }
    // A bristle never rests exactly.
    const double rest = law_.jumps_at_rest() ? 0 : kSlow * std::fabs(pull);
    const bool rested = std::fabs(before) <= rest, rests = std::fabs(v_.vx) <= rest;
    if (rested && !rests) releases_.push_back(last_);
    if (!rested && rests) sticks_.push_back(t_);
    if (!overtakes_.empty()) {
      const double f = force(t_);
      spring_max_ = std::max(spring_max_, f);
      spring_min_ = std::min(spring_min_, f);
    }
    last_ = t_;
  }
  void spring_figures() {
    const size_t n = overtakes_.size();
    figure("cycles", n ? double(n - 1) : 0);
    figure("period", n > 1 ? overtakes_[n - 1] - overtakes_[n - 2] : kNone);
    figure("spring_force_max", n ? spring_max_ : kNone);
    figure("spring_force_min", n ? spring_min_ : kNone);
    out_.figures.push_back({"release_times", releases_});
    out_.figures.push_back({"stick_times", sticks_});
  }

  // A path so slow that only its length counts, walked at path_speed.
  void path() {
    restart();
    x_ = case_.path_x[0];
    double length = 0, walked = 0;
    for (size_t i = 1; i < case_.path_x.size(); ++i)
      length += std::fabs(case_.path_x[i] - case_.path_x[i - 1]);
    const double grain = case_.path_speed * step_;
    refuse_too_many(length / grain);
    for (size_t i = 0; i < case_.path_x.size(); ++i) {
      const double dx = i ? case_.path_x[i] - case_.path_x[i - 1] : 0;
      const double n = std::ceil(std::fabs(dx) / grain - 1e-6);
      const double h = n > 0 ? std::fabs(dx) / case_.path_speed / n : 0;
      for (int64_t k = 0; k < int64_t(n); ++k) {
        lead(t_, t_ + h, h, {dx / (n * h), 0});
        t_ += h;
        dwell_ += h;
        ++out_.steps;
        show((length - walked) / case_.path_speed + t_);
      }
      walked += std::fabs(dx);
      out_.rows.push_back({case_.path_x[i], case_.path_segment[i], fx_});
    }
    figure("work_J", work_);
  }

  // One run per rate from rest until the mass slides at 30 v_s. Break-away is where the elastic force is
  // largest; a law without bristles breaks away where its force is.
  struct Peak { double t, f; };
  void ramps() {
    const std::vector<std::string> known = {
        "rate", "F_ba", "t_ba", "f_applied_at_ba", "interior_peak", "t_v_eq_v_s", "f_applied_v_eq_v_s"};
    require(known);
    const double v_s = case_.number_of("v_s", law_.param("v_s", 0));
    if (!(v_s > 0))
      throw Failure(
          kBadInput,
          case_.file + ": /params/v_s is missing, expected the speed in m/s whose 30-fold ends a ramp");
    const double slowest = std::ranges::min(case_.times);
    for (const double rate : case_.times) {
      rate_ = rate;
      // the force grows by the same amount in every step of every ramp
      const double h = step_ * slowest / rate;
      restart();
      double crossed = kNone;
      Peak peak[3] = {{0, elastic_force()}, {0, elastic_force()}, {0, elastic_force()}}, before = peak[1];
      bool after = false;  // the sample behind the peak is still to come
      const uint64_t begun = out_.steps;
      for (int64_t k = 1; v_.vx < 30 * v_s; ++k) {
        if (double(out_.steps - begun) > kMaxSteps / 100)
          throw Failure(kStopped, "the ramp of " + short_text(rate) + " N/s has not made the mass slide");
        const double slower = v_.vx, earlier = t_;
        advance(earlier, double(k) * h);
        if (std::isnan(crossed) && v_.vx >= v_s) crossed = earlier + h * (v_s - slower) / (v_.vx - slower);
        const Peak now = {t_, elastic_force()};
        if (after) {
          peak[2] = now;
          after = false;
        }
        if (now.f > peak[1].f) {
          peak[0] = before;
          peak[1] = now;
          after = true;
        }
        before = now;
        show(t_);
      }
      const bool interior = !after && peak[1].f > before.f * (1 + 1e-9);
      add_ramp(rate, interior ? refined(peak) : Peak{kNone, peak[1].f}, interior, crossed);
    }
  }

  // The top of the parabola through a peak and its neighbors; a kink is its own top.
  static Peak refined(const Peak (&p)[3]) {
    const double left = p[1].f - p[0].f, right = p[1].f - p[2].f, h = p[2].t - p[1].t, bend = left + right;
    if (!(left > 0 && right > 0 && left < 4 * right && right < 4 * left)) return p[1];
    const double s = 0.5 * (left - right) / bend;
    return {p[1].t + s * h, p[1].f + 0.25 * (left - right) * s};
  }

  void add_ramp(double rate, const Peak &peak, bool interior, double crossed) {
    std::vector<double> row;
    for (const std::string &name : case_.columns)
      row.push_back(name == "rate"              ? rate
                    : name == "F_ba"            ? peak.f
                    : name == "t_ba"            ? peak.t
                    : name == "f_applied_at_ba" ? rate * peak.t
                    : name == "interior_peak"   ? double(interior)
                    : name == "t_v_eq_v_s"      ? crossed
                                                : rate * crossed);
    out_.rows.push_back(row);
  }

  const FrictionCase &case_;
  RigLaw &law_;
  double step_, fn_ = 1, sigma0_ = 0, rate_ = 0;
  Progress &progress_;
  RigResult out_;
  double t_ = 0, x_ = 0, fx_ = 0, fy_ = 0, dwell_ = 0, work_ = 0;
  Motion v_;
  std::vector<RigLaw::Column> before_, whole_;
  std::vector<double> half_work_, overtakes_, releases_, sticks_;
  double last_ = 0, spring_max_ = -INFINITY, spring_min_ = INFINITY;
};

}  // namespace

RigResult run_rig(const FrictionCase &rig, RigLaw &law, double step, Progress &progress) {
  return Rig(rig, law, step, progress).run();
}

}  // namespace cli
