// Conservative time of impact. The time moves on only over intervals in which a touch is disproved, rounding
// included, so the answer is never late; it stops where the features are nearer than the tolerance, so it is
// hardly early. Three disproofs, each cheap where the others crawl:
//   1. the coplanarity cubic keeps its sign: straight to the next root, however the features turn;
//   2. a fixed plane keeps the features apart: its corners move on straight lines, so it holds until the
//      first of them reaches it. The advancement of Mirtich (1996) and of Li et al. (2021, ACCD), with speeds
//      along one direction instead of a bound on all speeds;
//   3. a plane that turns between the separating normals n0 and n1 of two times: n(t) . w[k](t) is a
//      quadratic whose control values n0.w0, (n0.w1 + n1.w0)/2, n1.w1 bound it (the inclusion of Wang et al.
//      2021, with a normal that follows the motion). Converges quadratically where the first two are linear:
//      motion in one plane, double and triple roots, slivers.
#include <algorithm>

#include "ccd/toi_query.h"

namespace dfm::toi {
namespace {

class Advance {
 public:
  explicit Advance(const Query &query)
      : q_(query),
        c_(coplanarity(query)),
        clear_(c_.error + query.separation * c_.normal_max),
        safe_(query.separation + kRound),
        stop_(query.separation + std::max(query.tolerance, 4 * kRound)) {}

  Root run() {
    if (apart_along_axis(q_)) return root_;
    double t = next_suspect(0);
    if (t > 1) return root_;
    Separation s = look(t);
    double stride = 1;
    while (s.lower > stop_ && root_.evaluations < uint32_t(q_.max_iterations)) {
      const double fixed = plane_holds_until(s, t);
      if (fixed >= 1) return root_;
      if (const double next = next_suspect(fixed); next > fixed) {
        if (next > 1) return root_;
        s = look(t = next);
        continue;
      }
      if (!turning_plane(s, t, fixed, stride)) s = look(t = fixed);
    }
    root_.t = t;
    root_.u = s.u;
    root_.v = s.v;
    return root_;
  }

 private:
  Separation look(double t) {
    ++root_.evaluations;
    return separate(q_, t);
  }

  // From t on, the first time at which the cubic is not clear of zero, itself where that is t; 2 where
  // there is none.
  double next_suspect(double t) {
    const double at_t = c_.f(t);
    ++root_.evaluations;
    if (!(std::fabs(at_t) > clear_)) return t;
    const double sign = at_t > 0 ? 1 : -1;
    double least, largest;
    c_.f.bounds(least, largest);
    if ((sign > 0 ? least : -largest) > clear_) return 2;
    double ends[3];
    int n = quadratic_roots(c_.f.derivative(), ends);
    ends[n++] = 1;
    for (int k = 0; k < n; ++k) {
      if (ends[k] <= t) continue;
      const double value = sign * c_.f(ends[k]) - clear_;
      ++root_.evaluations;
      if (value <= 0) return last_clear(sign, t, ends[k]);
      t = ends[k];
    }
    return 2;
  }

  // f falls monotonically (times sign) from clear at lo to not clear at hi: a time before the crossing, as
  // near to it as values allow.
  double last_clear(double sign, double lo, double hi) {
    const Poly slope = c_.f.derivative();
    const double target = clear_ + 0.5 * c_.error, enough = clear_ + c_.error;
    double x = lo;
    while (hi - lo > 0x1p-52) {
      const double value = sign * c_.f(x);
      ++root_.evaluations;
      if (value > clear_) lo = x;
      else hi = x;
      if (value > clear_ && value <= enough) break;
      x -= (value - target) / (sign * slope(x));
      if (!(x > lo && x < hi)) x = 0.5 * (lo + hi);
      if (x <= lo || x >= hi) break;
    }
    return lo;
  }

  double plane_holds_until(const Separation &s, double t) const {
    double fraction = HUGE_VAL;
    for (int k = 0; k < q_.ncorner; ++k) {
      const double now = dot(s.normal, q_.corner(k, t)), end = dot(s.normal, q_.w1[k]);
      if (end < safe_) fraction = std::min(fraction, (now - safe_) / (now - end));
    }
    return fraction == HUGE_VAL ? 1 : t + fraction * (1 - t);
  }

  bool keeps_apart(const Separation &s0, double t0, const Separation &s1, double t1) const {
    if (!(s1.lower > safe_)) return false;
    for (int k = 0; k < q_.ncorner; ++k)
      if (!(0.5 * (dot(s0.normal, q_.corner(k, t1)) + dot(s1.normal, q_.corner(k, t0))) > safe_))
        return false;
    return true;
  }

  // Advances further than the fixed plane allows, to the contact time predicted by the slope of the distance.
  bool turning_plane(Separation &s, double &t, double fixed, double &stride) {
    const double slope = dot(s.normal, q_.at(1, s.u, s.v) - q_.at(t, s.u, s.v)) / (1 - t);
    const double target = 0.5 * (safe_ + stop_);
    double to = slope < 0 ? std::min(1.0, t + (s.lower - target) / -slope) : 1.0;
    to = std::min(to, t + stride);
    while (to > fixed && root_.evaluations < uint32_t(q_.max_iterations)) {
      const Separation ahead = look(to);
      if (keeps_apart(s, t, ahead, to)) {
        stride = 4 * (to - t);
        s = ahead;
        t = to;
        return true;
      }
      to = t + 0.25 * (to - t);
    }
    stride = 4 * (fixed - t);
    return false;
  }

  const Query &q_;
  const Coplanarity c_;
  const double clear_;  // |f| above it: no touch
  const double safe_;   // a proven distance above it: no touch
  const double stop_;   // a distance up to it is called a touch
  Root root_;
};

}  // namespace

Root conservative(const Query &query) { return Advance(query).run(); }

}  // namespace dfm::toi
