// One mode over a step: q'' + d q' + l q = f with f constant.
#pragma once
#include <deform/elementary.h>

#include <cmath>

namespace reduced {

// q(h) = qq q + qv v + qf f,  v(h) = vq q + vv v + vf f
struct Transition { double qq, qv, qf, vq, vv, vf; };

// By the solution itself: e^(-dt/2) times sines, or exponentials above critical damping. Where h is short
// against both periods, by the power series of q(t), in which nothing cancels.
inline Transition exact_step(double l, double d, double h) {
  Transition t;
  if (l * h * h < 0.05 && d * h < 0.05) {
    const auto series = [&](double q, double v, double f, double &position, double &velocity) {
      double before = q, now = v * h;  // c_n h^n
      position = before + now;
      velocity = now;
      for (int n = 2; n < 16; ++n) {
        const double next =
            ((n == 2 ? f * h * h : 0) - d * h * (n - 1) * now - l * h * h * before) / (n * (n - 1));
        position += next;
        velocity += n * next;
        before = now;
        now = next;
      }
      velocity /= h;
    };
    series(1, 0, 0, t.qq, t.vq);
    series(0, 1, 0, t.qv, t.vv);
    series(0, 0, 1, t.qf, t.vf);
    return t;
  }
  const double decay = 0.5 * d, square = decay * decay - l;
  double c, s;  // e^(-decay h) times cos and sin / w, or cosh and sinh / w
  if (square < 0) {
    const double w = std::sqrt(-square), e = dfm_exp(-decay * h);
    constexpr double kPi = 0x1.921fb54442d18p+1;
    c = e * dfm_cospi(w * h / kPi);
    s = w * h > 1e-4 ? e * dfm_sinpi(w * h / kPi) / w : e * h * (1 - w * w * h * h / 6);
  } else {
    // -l / (decay + w) is -decay + w without cancellation
    const double w = std::sqrt(square), slow = dfm_exp(-l / (decay + w) * h),
                 fast = dfm_exp(-(decay + w) * h);
    c = 0.5 * (slow + fast);
    s = w * h > 1e-4 ? (slow - fast) / (2 * w) : c * h * (1 + w * w * h * h / 6);
  }
  t.qq = c + decay * s;
  t.qv = s;
  t.qf = l > 0 ? (1 - t.qq) / l : (h - s) / d;
  t.vq = -l * s;
  t.vv = c - decay * s;
  t.vf = s;
  return t;
}

// Backward Euler.
inline Transition damped_step(double l, double d, double h) {
  const double b = 1 / (1 + h * (d + h * l));
  Transition t{1 - h * h * l * b, h * b, h * h * b, -h * l * b, b, h * b};
  t.qq = (1 + h * d) * b;
  return t;
}

}  // namespace reduced
