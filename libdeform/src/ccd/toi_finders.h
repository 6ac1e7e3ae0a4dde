// Root finders on a bracket [lo, hi] with f of opposite sign at its ends: those of Zerbato 2010, 4.2.2,
// ending with a bracket narrower than `width` that holds the root. They return the best estimate inside it
// and add the values of f that they took to `evaluations`.
#pragma once
#include <cmath>
#include <cstdint>

#include "deform/toi.h"

namespace dfm::toi {

struct Bracket { double lo, hi, f_lo, f_hi; };

// (4.8). The middle is all there is to remember: the sign of its value says on which side the next one lies,
// half as far. That makes the chain from one value to the next a copied sign and a sum; moving the ends takes
// three times as long, and a branch would be foretold wrongly half the time.
template <class F>
double bisection(const F &f, Bracket b, double width, int max_iterations, uint32_t &evaluations) {
  const bool falls = b.f_lo > 0;
  double length = b.hi - b.lo, x = b.lo + 0.5 * length;
  for (int i = 0; i < max_iterations && length > width; ++i) {
    const double value = f(x);
    ++evaluations;
    if (value == 0) return x;
    length *= 0.5;
    const double step = std::copysign(0.5 * length, value);
    x = falls ? x + step : x - step;
  }
  return x;
}

// (4.9) keeps one end for ever on a convex function; halving the value kept (Illinois, Dowell and Jarratt
// 1971) makes it super-linear. The end that approaches the root gives no information on the other one, so
// finally the other end is moved by a step of half the width over the root. Meant for smooth functions: at a
// kink it converges slowly, up to the cap.
template <class F>
double regula_falsi(const F &f, Bracket b, double width, int max_iterations, uint32_t &evaluations) {
  int kept = 0;  // the end that stayed last time: -1 lo, 1 hi
  double x = b.lo;
  for (int i = 0; i < max_iterations && b.hi - b.lo > width; ++i) {
    x = (b.lo * b.f_hi - b.hi * b.f_lo) / (b.f_hi - b.f_lo);
    const double inset = 0.5 * width;
    if (!(x > b.lo + inset)) x = b.lo + inset;
    if (!(x < b.hi - inset)) x = b.hi - inset;
    const double value = f(x);
    ++evaluations;
    if (value == 0) return x;
    if ((value > 0) == (b.f_lo > 0)) {
      b.lo = x;
      b.f_lo = value;
      if (kept == 1) b.f_hi *= 0.5;
      kept = 1;
    } else {
      b.hi = x;
      b.f_hi = value;
      if (kept == -1) b.f_lo *= 0.5;
      kept = -1;
    }
  }
  return b.hi - b.lo > width ? x : b.lo + 0.5 * (b.hi - b.lo);
}

// (4.10), (4.11): inverse quadratic interpolation where it converges fast, else secant, else bisection (Brent
// 1973, chapter 4).
template <class F>
double brent(const F &f, Bracket bracket, double width, int max_iterations, uint32_t &evaluations) {
  double a = bracket.lo;
  double fa = bracket.f_lo;
  double b = bracket.hi;
  double fb = bracket.f_hi;
  double c = a;
  double fc = fa;
  double step = b - a;
  double before = step;
  const double tolerance = 0.5 * width;
  for (int i = 0; i < max_iterations; ++i) {
    if (std::fabs(fc) < std::fabs(fb)) {
      a = b;
      b = c;
      c = a;
      fa = fb;
      fb = fc;
      fc = fa;  // b: best; [b, c] holds the root; a: last b
    }
    const double half = 0.5 * (c - b);
    if (std::fabs(half) <= tolerance || fb == 0) return b;
    if (std::fabs(before) < tolerance || std::fabs(fa) <= std::fabs(fb)) {
      step = before = half;
    } else {
      const double s = fb / fa;
      double p, q;
      if (a == c) {
        p = 2 * half * s;
        q = 1 - s;
      } else {
        const double u = fa / fc, r = fb / fc;
        p = s * (2 * half * u * (u - r) - (b - a) * (r - 1));
        q = (u - 1) * (r - 1) * (s - 1);
      }
      if (p > 0) q = -q;
      else p = -p;
      const double last = before;
      before = step;
      if (2 * p < 3 * half * q - std::fabs(tolerance * q) && p < std::fabs(0.5 * last * q)) step = p / q;
      else step = before = half;
    }
    a = b;
    fa = fb;
    b += std::fabs(step) > tolerance ? step : half > 0 ? tolerance : -tolerance;
    fb = f(b);
    ++evaluations;
    if ((fb > 0) == (fc > 0)) {
      c = a;
      fc = fa;
      step = before = b - a;
    }
  }
  return b;
}

template <class F>
double find_root(int method, const F &f, Bracket bracket, double width, int max_iterations,
                 uint32_t &evaluations) {
  switch (method) {
    case DFM_TOI_BISECTION: return bisection(f, bracket, width, max_iterations, evaluations);
    case DFM_TOI_REGULA_FALSI: return regula_falsi(f, bracket, width, max_iterations, evaluations);
    default: return brent(f, bracket, width, max_iterations, evaluations);
  }
}

}  // namespace dfm::toi
