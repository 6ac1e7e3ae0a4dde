// Time of impact by roots: where features first touch, one of a few polynomials is zero. All their roots are
// isolated between the roots of their derivatives, sorted, and the earliest at which the true distance
// confirms a touch is the answer (Zerbato 2010, (4.2) to (4.7), corrected: up to three roots, each with its
// inside test; even roots and motions in one plane have no change of sign).
//
//   without separation   the coplanarity cubic; where it vanishes altogether (motion in one plane, parallel
//                        edges, flat triangles) a first touch is one at the patch's border: w_k x w_k+1 = 0
//                        on a side, w_k = 0 at a corner
//   with separation m    the same per region of the patch: f^2 = m^2 |n|^2, |w_k x w_k+1|^2 = m^2 |w_k+1 -
//                        w_k|^2, |w_k|^2 = m^2
#include <algorithm>

#include "ccd/toi_finders.h"
#include "ccd/toi_query.h"

namespace dfm::toi {
namespace {

constexpr double kPolyRound = 0x1p-44;  // rounding of a polynomial's values, in sizes of its coefficients

constexpr double kSharp = 1e-10;     // in t: roots with a larger uncertainty are refined
constexpr double kSharpenBy = 1e-8;  // in t: limit of a refinement step

struct VectorPoly { Poly x, y, z; };
VectorPoly path(Vec3 at0, Vec3 at1) {
  return {linear(at0.x, at1.x), linear(at0.y, at1.y), linear(at0.z, at1.z)};
}
VectorPoly cross(const VectorPoly &a, const VectorPoly &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Poly square(const VectorPoly &a) { return a.x * a.x + a.y * a.y + a.z * a.z; }

class Roots {
 public:
  Roots(const Query &query, int method) : q_(query), method_(method) {}

  Root run() {
    if (apart_along_axis(q_)) return root_;
    const bool contacts = q_.separation == 0;
    if (contacts) plane_ = coplanarity(q_);
    if (!contacts || !(std::fabs(plane_.f.b[0]) > plane_.error)) {
      touch_ = q_.separation + 4 * kRound;
      if (touches(0)) return root_;
    }
    // motion of the features within the uncertainty of t
    touch_ = q_.separation + 8 * q_.tolerance + 4 * kRound;
    if (contacts && !plane_.vanishes && in_order()) return root_;
    if (contacts) contact();
    else separation();
    std::sort(time_, time_ + ntime_);
    for (int k = 0; k < ntime_; ++k)
      if ((k == 0 || time_[k] > time_[k - 1]) && touches(time_[k])) break;
    return root_;
  }

 private:
  bool touches(double t) {
    ++root_.evaluations;
    const Separation s = separate(q_, t);
    if (!(s.upper <= touch_)) return false;
    root_.t = t;
    root_.u = s.u;
    root_.v = s.v;
    return true;
  }

  void add(double t) {
    if (ntime_ < kMaxTimes) time_[ntime_++] = t;
  }

  // Changes of sign inside (0,1) between the roots of the derivative, which come first, ascending.
  int crossings(const Poly &p, int method, double *out, double *turn, int &nturn) {
    nturn = 0;
    if (p.degree == 1) {
      const double t = p.b[0] / (p.b[0] - p.b[1]);
      if (!(t > 0 && t < 1)) return 0;
      out[0] = t;
      return 1;
    }
    if (p.degree == 2) {
      double unused[kMaxDegree];
      int none;
      nturn = crossings(p.derivative(), method, turn, unused, none);
      return quadratic_roots(p, out);
    }
    double below[kMaxDegree];
    int nbelow;
    nturn = crossings(p.derivative(), DFM_TOI_BRENT, turn, below, nbelow);
    int n = 0;
    Bracket b{0, 0, p(0), 0};
    for (int k = 0; k <= nturn; ++k, b.lo = b.hi, b.f_lo = b.f_hi) {
      b.hi = k < nturn ? turn[k] : 1;
      b.f_hi = p(b.hi);
      ++root_.evaluations;
      if ((b.f_lo < 0 && b.f_hi > 0) || (b.f_lo > 0 && b.f_hi < 0))
        out[n++] = find_root(method, p, b, method == method_ ? q_.tolerance : 0x1p-50, q_.max_iterations,
                             root_.evaluations);
    }
    return n;
  }

  // Roots of p in (0,1], and the places where it comes as near to zero as rounding can show without
  // changing its sign.
  void add_roots(const Poly &p, double error) {
    double least, largest;
    p.bounds(least, largest);
    if (least > error || largest < -error) return;
    double root[kMaxDegree], turn[kMaxDegree];
    int nturn;
    const int n = crossings(p, method_, root, turn, nturn);
    for (int k = 0; k < n; ++k) add(root[k]);
    for (int k = 0; k < nturn; ++k)
      if (std::fabs(p(turn[k])) <= error) add(turn[k]);
    if (std::fabs(p(1)) <= error) add(1);
  }

  // Two roots close together lie where the cubic is flat, and its rounding moves them: Newton steps on the
  // sharp one, unless a touch of an even root leaves nothing to find.
  void sharpen() {
    const Poly slope = plane_.f.derivative();
    for (int k = 0; k < ntime_; ++k) {
      if (!(plane_.error > kSharp * std::fabs(slope(time_[k])))) continue;
      const SharpCubic sharp = sharp_coplanarity(q_);
      for (int pass = 0; pass < 4; ++pass) {
        ++root_.evaluations;
        const double step = sharp(time_[k]) / slope(time_[k]), t = time_[k] - step;
        if (!(std::fabs(step) < kSharpenBy && t > 0 && t <= 1)) break;
        time_[k] = t;
      }
    }
  }

  // Nothing can touch between two times: all corners lie on one side along an axis, at both.
  bool apart_between(double lo, double hi) const {
    Vec3 at[8];
    for (int k = 0; k < q_.ncorner; ++k) {
      at[k] = q_.corner(k, lo);
      at[q_.ncorner + k] = q_.corner(k, hi);
    }
    for (int axis = 0; axis < 3; ++axis) {
      double low = at[0][axis], high = low;
      for (int k = 1; k < 2 * q_.ncorner; ++k) {
        low = std::min(low, at[k][axis]);
        high = std::max(high, at[k][axis]);
      }
      if (low > touch_ || high < -touch_) return true;
    }
    return false;
  }

  // Nearly every query. The cubic is monotonic between its turns, so its roots come in order: each is tested
  // at once, and one after a touch is never searched, nor one in a piece in which the corners stay on one
  // side. False where a root is not certain: those are sharpened and sorted first.
  bool in_order() {
    const Poly &p = plane_.f;
    double least, largest;
    p.bounds(least, largest);
    if (least > plane_.error || largest < -plane_.error) return true;
    const Poly slope = p.derivative();
    const auto certain = [&](double t) { return plane_.error <= kSharp * std::fabs(slope(t)); };
    double end[3];
    int n = quadratic_roots(slope, end);
    end[n++] = 1;
    Bracket b{0, 0, p(0), 0};
    for (int k = 0; k < n; ++k, b.lo = b.hi, b.f_lo = b.f_hi) {
      b.hi = end[k];
      b.f_hi = p(b.hi);
      ++root_.evaluations;
      if (((b.f_lo < 0 && b.f_hi > 0) || (b.f_lo > 0 && b.f_hi < 0)) &&
          !(n > 1 && apart_between(b.lo, b.hi))) {
        const double t = find_root(method_, p, b, q_.tolerance, q_.max_iterations, root_.evaluations);
        if (!certain(t)) return false;
        if (touches(t)) return true;
      }
      if (!(std::fabs(b.f_hi) <= plane_.error)) continue;
      if (b.hi < 1 || !certain(1)) return false;
      touches(1);
    }
    return true;
  }

  void contact() {
    add_roots(plane_.f, plane_.error);
    sharpen();
    if (!plane_.vanishes) return;
    for (int k = 0; k < q_.ncorner; ++k) {
      const int next = k + 1 < q_.ncorner ? k + 1 : 0;
      const VectorPoly from = path(q_.w0[k], q_.w1[k]), line = cross(from, path(q_.w0[next], q_.w1[next]));
      for (const Poly *p : {&line.x, &line.y, &line.z, &from.x, &from.y, &from.z}) add_roots(*p, kPolyRound);
    }
  }

  void separation() {
    const double m2 = q_.separation * q_.separation;
    const VectorPoly r = path(q_.w0[0], q_.w1[0]);
    const VectorPoly n = cross(path(q_.e1[0], q_.e1[1]), path(q_.e2[0], q_.e2[1]));
    const Poly f = r.x * n.x + r.y * n.y + r.z * n.z, ff = f * f, plane = ff - m2 * raised(raised(square(n)));
    add_roots(plane, kPolyRound * ff.size());
    for (int k = 0; k < q_.ncorner; ++k) {
      const int next = k + 1 < q_.ncorner ? k + 1 : 0;
      const VectorPoly from = path(q_.w0[k], q_.w1[k]), to = path(q_.w0[next], q_.w1[next]);
      const VectorPoly side{to.x - from.x, to.y - from.y, to.z - from.z};
      const Poly area = square(cross(from, to)), distance = square(from);
      add_roots(area - m2 * raised(raised(square(side))), kPolyRound * area.size());
      add_roots(distance - m2 * raised(raised(Poly{0, {1}})), kPolyRound * distance.size());
    }
  }

  // there are at most 6 + 4 sides x (3 quadratics x 4 + 3 lines x 2) = 78
  static constexpr int kMaxTimes = 128;
  const Query &q_;
  const int method_;
  Coplanarity plane_;
  double touch_ = 0;
  double time_[kMaxTimes];
  int ntime_ = 0;
  Root root_;
};

}  // namespace

Root by_roots(const Query &query, int method) { return Roots(query, method).run(); }

}  // namespace dfm::toi
