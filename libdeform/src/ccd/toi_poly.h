// Polynomials in t on [0,1] as sum B[i] t^i (1-t)^(n-i): Bernstein's basis with the binomials left in the
// coefficients. A straight path is its two ends, products are convolutions, the hull of B[i]/binomial bounds
// the values, and no end of the interval is better than the other.
#pragma once
#include <algorithm>
#include <cmath>

#include "math/vec3.h"

namespace dfm::toi {

constexpr int kMaxDegree = 6;

struct Poly {
  int degree = 0;
  double b[kMaxDegree + 1] = {};

  double operator()(double t) const {
    const double s = 1 - t;
    // nearly all there is to do, in a short chain
    if (degree == 3) return (b[0] * s + b[1] * t) * (s * s) + (b[2] * s + b[3] * t) * (t * t);
    double value = b[0], power = 1;
    for (int i = 1; i <= degree; ++i) {
      power *= t;
      value = value * s + b[i] * power;
    }
    return value;
  }
  Poly derivative() const {
    Poly d;
    d.degree = degree - 1;
    for (int i = 0; i < degree; ++i) d.b[i] = (i + 1) * b[i + 1] - (degree - i) * b[i];
    return d;
  }
  double size() const {
    double largest = 0;
    for (int i = 0; i <= degree; ++i) largest = std::max(largest, std::fabs(b[i]));
    return largest;
  }
  // Least and largest value on [0,1], by the hull of the control values.
  void bounds(double &least, double &largest) const {
    double binomial = 1;
    least = largest = b[0];
    for (int i = 1; i <= degree; ++i) {
      binomial = binomial * (degree - i + 1) / i;
      least = std::min(least, b[i] / binomial);
      largest = std::max(largest, b[i] / binomial);
    }
  }
};

inline Poly operator*(const Poly &p, const Poly &q) {
  Poly r;
  r.degree = p.degree + q.degree;
  for (int i = 0; i <= p.degree; ++i)
    for (int j = 0; j <= q.degree; ++j) r.b[i + j] += p.b[i] * q.b[j];
  return r;
}
inline Poly operator+(Poly p, const Poly &q) {  // of one degree
  for (int i = 0; i <= p.degree; ++i) p.b[i] += q.b[i];
  return p;
}
inline Poly operator*(double k, Poly p) {
  for (int i = 0; i <= p.degree; ++i) p.b[i] *= k;
  return p;
}
inline Poly operator-(const Poly &p, const Poly &q) { return p + -1.0 * q; }

// A degree higher, the same values: times (1-t) + t.
inline Poly raised(const Poly &p) {
  Poly r;
  r.degree = p.degree + 1;
  for (int i = 0; i <= p.degree; ++i) {
    r.b[i] += p.b[i];
    r.b[i + 1] += p.b[i];
  }
  return r;
}
inline Poly linear(double at0, double at1) { return {1, {at0, at1}}; }

// Roots inside (0,1) of a quadratic, ascending, without cancellation; a root outside by rounding alone
// belongs to the caller's ends.
inline int quadratic_roots(const Poly &p, double out[2]) {
  // In x = t / (1-t): b0 + b1 x + b2 x^2, t = x / (1 + x). t of a ratio num / den is num / (num + den).
  const double a = p.b[2], h = 0.5 * p.b[1], c = p.b[0];
  const double square = h * h - a * c;
  if (!(square >= 0)) return 0;
  const double root = std::sqrt(square), q = h >= 0 ? -(h + root) : root - h;
  const double num[2] = {q, c}, den[2] = {a, q};
  int n = 0;
  for (int k = 0; k < 2; ++k) {
    const double t = num[k] / (num[k] + den[k]);
    if (t > 0 && t < 1 && !(n == 1 && t == out[0])) out[n++] = t;
  }
  if (n == 2 && out[1] < out[0]) std::swap(out[0], out[1]);
  return n;
}

}  // namespace dfm::toi
