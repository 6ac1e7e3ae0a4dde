// The coplanarity cubic once more in pairs of doubles, from the vertices themselves. A needle a million
// times longer than wide leaves six digits fewer in the plain one, so its roots would be known to 1e-5
// only; here they are known to the last digits of a double. Sums and products of pairs after Dekker (1971),
// from + - * alone.
#include "ccd/toi_query.h"

namespace dfm::toi {
namespace {

struct Pair { double high, low; };

Pair sum(double a, double b) {
  const double s = a + b, t = s - a;
  return {s, (a - (s - t)) + (b - t)};
}
// |a| >= |b|, or a is 0.
Pair quick_sum(double a, double b) {
  const double s = a + b;
  return {s, b - (s - a)};
}
// Off by 2^-104 of |a| + |b|, which is what the bounds count on; of a sum that cancels it may be more.
Pair operator+(Pair a, Pair b) {
  const Pair s = sum(a.high, b.high);
  return quick_sum(s.high, s.low + (a.low + b.low));
}
Pair operator-(Pair a, Pair b) { return a + Pair{-b.high, -b.low}; }
Pair operator*(Pair a, Pair b) {
  const auto split = [](double x) {
    const double c = 134217729.0 * x, high = c - (c - x);
    return Pair{high, x - high};
  };
  const Pair x = split(a.high), y = split(b.high);
  const double p = a.high * b.high;
  const double rest = ((x.high * y.high - p) + x.high * y.low + x.low * y.high) + x.low * y.low;
  return quick_sum(p, rest + (a.high * b.low + a.low * b.high));
}

struct Pairs { Pair x, y, z; };
Pairs operator+(const Pairs &a, const Pairs &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Pair dot(const Pairs &a, const Pairs &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Pairs cross(const Pairs &a, const Pairs &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Pairs difference(const Query &q, const double *a, const double *b) {
  const auto component = [&](int i) {
    const Pair d = sum(q.before[1] * (q.before[0] * a[i]), -(q.before[1] * (q.before[0] * b[i])));
    return Pair{q.after[1] * (q.after[0] * d.high), q.after[1] * (q.after[0] * d.low)};
  };
  return {component(0), component(1), component(2)};
}

}  // namespace

SharpCubic sharp_coplanarity(const Query &q) {
  Pairs r[2], e1[2], e2[2];
  for (int end = 0; end < 2; ++end) {
    const auto at = [end](const dfm_motion *m) { return end ? m->p1 : m->p0; };
    r[end] = difference(q, at(q.to[0]), at(q.from[0]));
    e1[end] = difference(q, at(q.to[1]), at(q.from[1]));
    e2[end] = difference(q, at(q.to[2]), at(q.from[2]));
  }
  const Pairs n0 = cross(e1[0], e2[0]);
  const Pairs n1 = cross(e1[0], e2[1]) + cross(e1[1], e2[0]);
  const Pairs n2 = cross(e1[1], e2[1]);
  const Pair b[4] = {dot(r[0], n0), dot(r[1], n0) + dot(r[0], n1), dot(r[1], n1) + dot(r[0], n2),
                     dot(r[1], n2)};
  SharpCubic c;
  c.high.degree = c.low.degree = 3;
  for (int i = 0; i < 4; ++i) {
    c.high.b[i] = b[i].high;
    c.low.b[i] = b[i].low;
  }
  return c;
}

double SharpCubic::operator()(double at) const {
  const Pair t{at, 0}, s = sum(1, -at);
  Pair value{high.b[0], low.b[0]}, power{1, 0};
  for (int i = 1; i <= 3; ++i) {
    power = power * t;
    value = value * s + Pair{high.b[i], low.b[i]} * power;
  }
  return value.high;
}

}  // namespace dfm::toi
