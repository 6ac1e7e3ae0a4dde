#include "richardson.h"

#include <algorithm>
#include <cmath>

namespace cli::cost {
namespace {

constexpr double kLeastOrder = 0.8, kMostOrder = 3, kOrderOfCells = 2;
constexpr double kSameWay = 0.9;  // least cosine of the angle between differences that point the same way

// a + weight (a - b), at the times of a.
Quantity beyond(const Quantity &a, const Quantity &b, double weight) {
  Quantity out = a;
  double values[3], rates[3];
  for (size_t i = 0; i < a.t.size(); ++i) {
    value_at(b, a.t[i], values, rates);
    for (size_t k = 0, at = i * a.width; k < a.width; ++k, ++at) {
      out.values[at] += weight * (a.values[at] - values[k]);
      if (!a.rates.empty() && !b.rates.empty()) out.rates[at] += weight * (a.rates[at] - rates[k]);
    }
  }
  return out;
}

// Of a - b with b - c, over the times of a.
double cosine(const Quantity &a, const Quantity &b, const Quantity &c) {
  double uu = 0, uv = 0, vv = 0, at_b[3], at_c[3], rates[3];
  for (size_t i = 0; i < a.t.size(); ++i) {
    value_at(b, a.t[i], at_b, rates);
    value_at(c, a.t[i], at_c, rates);
    for (size_t k = 0; k < a.width; ++k) {
      const double u = a.values[i * a.width + k] - at_b[k], v = at_b[k] - at_c[k];
      uu += u * u;
      uv += u * v;
      vv += v * v;
    }
  }
  return uv / std::sqrt(uu * vv);
}

// p at which (h2^p - h1^p) / (h1^p - h0^p) is this; the quotient rises with p.
double order_of(double quotient, const double h[3]) {
  const auto at = [&](double p) { return (std::pow(h[2] / h[1], p) - 1) / (1 - std::pow(h[0] / h[1], p)); };
  double least = 1e-3, most = 20;
  if (!(quotient > at(least)) || !(quotient < at(most))) return std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 60; ++i) {
    const double p = 0.5 * (least + most);
    (at(p) < quotient ? least : most) = p;
  }
  return least;
}

// By which the distance of two meshes is to be multiplied to be that of the finer one from the limit.
double rest_of(double fine, double coarse, double order) { return 1 / (std::pow(coarse / fine, order) - 1); }

}  // namespace

Limit find_limit(const Quantity &fine, const Quantity &middle, const Quantity *coarse, const double h[3],
                 double scale, Quantity &limit) {
  Limit out;
  limit = fine;
  const double apart = error_of(middle, fine, scale);
  const bool alike = !(h[1] > h[0] * 1.001);
  out.error = apart * (alike ? 1 : rest_of(h[0], h[1], 1));
  if (fine.event) out.error = std::min(out.error, 1.0);
  if (!coarse || fine.event || alike || !(h[2] > h[1] * 1.001) || !(apart > 0)) return out;
  out.order = order_of(error_of(*coarse, middle, scale) / apart, h);
  out.used = out.order >= kLeastOrder && out.order <= kMostOrder && cosine(fine, middle, *coarse) >= kSameWay;
  if (!out.used) return out;
  const double p = std::min(out.order, kOrderOfCells);
  limit = beyond(fine, middle, rest_of(h[0], h[1], p));
  out.error = error_of(beyond(middle, *coarse, rest_of(h[1], h[2], p)), limit, scale);
  return out;
}

}  // namespace cli::cost
