#include "richardson.h"

#include <algorithm>
#include <cmath>

namespace cli::cost {
namespace {

constexpr double kMinOrder = 0.8, kOrderOfCells = 2, kSlowest = 1e-3;
constexpr double kOfThree = 1.25, kWithoutOrder = 3;  // factors of safety
constexpr double kMinRatio = 1.001;                   // of sizes of cells: below, meshes are alike
constexpr double kNothing = 1e-12;                    // a distance of two runs that is rounding
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

// The cosine between a - b and b - c, over the times of a.
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

// (h2^p - h1^p) / (h1^p - h0^p): by how much differences fall; rises with p.
double quotient_of(double p, const double h[3]) {
  return (std::pow(h[2] / h[1], p) - 1) / (1 - std::pow(h[0] / h[1], p));
}

// p with this quotient.
double order_of(double quotient, const double h[3]) {
  double least = kSlowest, most = 20;
  if (!(quotient > quotient_of(least, h)) || !(quotient < quotient_of(most, h)))
    return std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 60; ++i) {
    const double p = 0.5 * (least + most);
    (quotient_of(p, h) < quotient ? least : most) = p;
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
  const auto of_event = [&](double e) { return fine.event ? std::min(e, 1.0) : e; };
  if (!(h[1] > h[0] * kMinRatio)) {
    out.basis = Basis::same_mesh;
    out.error = out.bound = of_event(apart);
    return out;
  }
  out.error = of_event(apart * rest_of(h[0], h[1], 1));
  if (!coarse || !(h[2] > h[1] * kMinRatio)) return out;

  const double before = error_of(*coarse, middle, scale), across = error_of(*coarse, fine, scale);
  const double quotient = before / apart;
  const bool same_way = !fine.event && apart > 0 && cosine(fine, middle, *coarse) >= kSameWay;
  if (same_way) out.order = order_of(quotient, h);
  out.used = out.order >= kMinOrder;
  if (out.used) {
    const double p = std::min(out.order, kOrderOfCells), rest = rest_of(h[0], h[1], p);
    limit = beyond(fine, middle, rest);
    out.basis = Basis::order;
    out.error = out.bound = std::max(error_of(beyond(middle, *coarse, rest_of(h[1], h[2], p)), limit, scale),
                                     (kOfThree - 1) * rest * apart);
  } else if (out.order < kMinOrder) {
    out.basis = Basis::slow_order;
    out.error = out.bound = kOfThree * rest_of(h[0], h[1], out.order) * apart;
  } else {
    out.error = std::max(out.error, of_event(across * rest_of(h[0], h[2], 1)));
    const bool falls = apart <= kNothing || quotient > quotient_of(kSlowest, h);
    out.basis = falls ? Basis::no_order : Basis::no_fall;
    if (falls) out.bound = std::max(out.error, of_event(kWithoutOrder * std::max({apart, before, across})));
  }
  return out;
}

}  // namespace cli::cost
