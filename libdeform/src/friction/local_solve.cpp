// The slip at which a smooth law is evaluated.
//
// Seen from one contact, with what all others do held still, slip and friction force lie on the line v = m (f
// - f_stop), m = h w_t; the law is a monotone curve f = ft(v), and the contact's answer is where they cross.
// Newton on all contacts together evaluates the law at the present slip v and takes its tangent there.
// That works while the line is steeper than the curve; a stiff bristle is the other way round:
//
//      f |   line               a law saturates within a slip of R / (h sigma0 A). Evaluated at a slip beyond
//        | \    ________ law    it the law is R, whatever the slip, and the solve reverses the slip by m R;
//        |  \ /                 there the law is -R, and so on: stick and slip alternate without end once
//        |   x                  h m sigma0 A > 2, at any accuracy of the sweeps.
//        |__/_\_________ v      Evaluated at the crossing x, it is as a function of f_stop the resolvent
//        | /   \                of a monotone map: it never moves further than f_stop does (Rockafellar
//          zero  v now          1976, prop. 1), as the projection of a set-valued law; and it has a slope
//                               there which the passes use. Passes are then the semi-smooth Newton method
//                               on the natural map (Alart 1997).
//
// The crossing itself by Newton: g(v) = v - m (ft(v) - f_stop) has slope >= 1. A law that saturates is
// concave in |v|, so that Newton steps that start at no slip stay on this side of the crossing and grow
// toward it. The present slip is tried first: it mostly is the answer.
#include <algorithm>
#include <cmath>

#include "friction/laws.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxPasses = 24;
// If the law is evaluated exactly at the edge of its cone, its tangent is that of slip, and the step is too
// long by a factor 1 + h m sigma0 A, which may be 1e12.
constexpr double kCut = 1.0 / 16, kMinFraction = 1e-15;  // of a Newton step that increases the residual

struct Residue { double a, b, square; };
inline Residue residue(const ContactState &s, uint32_t i, double m) {
  const uint32_t n = s.stride;
  const double a = s.vt[i] - m * (s.ft[i] - s.ft_stop[i]);
  const double b = s.vt[n + i] - m * (s.ft[n + i] - s.ft_stop[n + i]);
  return {a, b, a * a + b * b};
}

// Whether the slip at which the law was evaluated is close enough to the solution.
inline bool is_accurate(const ContactState &s, uint32_t i, double m, double least, double relative) {
  const Residue g = residue(s, i, m);
  const double v1 = s.vt[i], v2 = s.vt[s.stride + i];
  return g.square <= least * least || std::sqrt(g.square) <= least + relative * std::sqrt(v1 * v1 + v2 * v2);
}

// Starts from the present slip, which becomes v.
void newton_step(const ContactState &s, uint32_t i, double m, double v[2], double step[2]) {
  const Residue g = residue(s, i, m);
  const LinearLaw l = linear_law(s, i, m);
  v[0] = s.vt[i];
  v[1] = s.vt[s.stride + i];
  step[0] = -(l.m22 * g.a - l.m12 * g.b) / l.det;
  step[1] = -(l.m11 * g.b - l.m21 * g.a) / l.det;
}

}  // namespace

const LawInstance *LawBatches::evaluate_local(double h, const double *wt, double least, double relative,
                                              ContactState &state, bool all) {
  for (const Batch &batch : batches_) {
    if (!all && batch.law->form() != kSmoothLaw) continue;
    if (batch.law->form() == kNoFriction) {
      set_frictionless({&order_[batch.begin], batch.n}, state);
      continue;
    }
    if (const LawInstance *bad = evaluate(*batch.law, {&order_[batch.begin], batch.n}, h, state)) return bad;
    if (batch.law->ops->flags & DFM_FRIC_SET_VALUED) continue;
    if (const LawInstance *bad = solve_local(batch, h, wt, least, relative, state)) return bad;
  }
  return nullptr;
}

// All contacts of a batch side by side; finished contacts leave the batch.
const LawInstance *LawBatches::solve_local(const Batch &batch, double h, const double *wt, double least,
                                           double relative, ContactState &s) {
  const uint32_t n = s.stride;
  local_.clear();
  for (uint32_t k = 0; k < batch.n; ++k)
    if (const uint32_t i = order_[batch.begin + k];
        wt[i] > 0 && !is_accurate(s, i, h * wt[i], least, relative))
      local_.push_back({i, false, false, {0, 0}, INFINITY, {0, 0}, 0});
  for (uint32_t pass = 1; !local_.empty(); ++pass) {
    size_t kept = 0;
    selected_.clear();
    for (Local &c : local_) {
      const uint32_t i = c.contact;
      const double m = h * wt[i];
      const Residue g = residue(s, i, m);
      if (is_accurate(s, i, m, least, relative)) continue;
      const double size = std::sqrt(g.square);
      // Beyond the crossing, g points along the step. Deep in stick it is nearly as large there as before, so
      // its size is no criterion.
      const bool nearer =
          size < 0.5 * c.left || (c.from_zero && size < c.left && g.a * c.step[0] + g.b * c.step[1] < 0);
      if (std::isinf(c.left) || nearer) {
        if (pass == kMaxPasses) continue;
        c.left = size;
        c.fraction = 1;
        newton_step(s, i, m, c.v, c.step);
      } else if (!c.from_zero && pass < kMaxPasses) {  // tangents at the present slip do not converge
        c = {i, true, false, {0, 0}, INFINITY, {0, 0}, 0};
      } else {
        c.fraction *= kCut;
      }
      // The limit on passes, or on shortened steps, is reached: evaluate at the best slip again and
      // return that.
      c.last = pass >= kMaxPasses || (c.fraction > 0 && c.fraction < kMinFraction);
      if (c.last) c.fraction = 0;
      s.vt[i] = c.v[0] + c.fraction * c.step[0];
      s.vt[n + i] = c.v[1] + c.fraction * c.step[1];
      selected_.push_back(i);
      local_[kept++] = c;
    }
    local_.resize(kept);
    if (local_.empty()) break;
    if (const LawInstance *bad = evaluate(*batch.law, selected_, h, s)) return bad;
    local_.erase(std::remove_if(local_.begin(), local_.end(), [](const Local &c) { return c.last; }),
                 local_.end());
  }
  return nullptr;
}

}  // namespace dfm
