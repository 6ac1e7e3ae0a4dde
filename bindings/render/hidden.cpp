#include "hidden.h"

#include <algorithm>
#include <limits>

namespace render {
namespace {

constexpr size_t kPlaces = 64;                    // of a surface, at which the line of sight is asked
constexpr double kSome = 0.7, kNearlyAll = 0.95;  // shares of them
constexpr float kLeft = 0.3f;                     // of a solid that hides a body completely
constexpr double kBefore = 0.999;                 // of the way: what a place touches does not hide it

// Between the segments a + s d and b + t e, 0 <= s, t <= 1.
double distance(const Vec &a, const Vec &d, const Vec &b, const Vec &e) {
  const Vec r = a - b;
  const double dd = dot(d, d), ee = dot(e, e), de = dot(d, e), dr = dot(d, r), er = dot(e, r);
  const double across = dd * ee - de * de;
  double s = across > 1e-12 * dd * ee ? std::clamp((de * er - dr * ee) / across, 0.0, 1.0) : 0;
  const double t = ee > 0 ? std::clamp((de * s + er) / ee, 0.0, 1.0) : 0;
  s = dd > 0 ? std::clamp((de * t - dr) / dd, 0.0, 1.0) : 0;
  return norm(r + d * s - e * t);
}

}  // namespace

Hidden::Hidden(const Scene &scene, const Vec &eye) : eye_(eye) {
  for (const Surface &s : scene.surfaces) {
    std::vector<Vec> &places = places_.emplace_back();
    const size_t step = std::max<size_t>(1, s.n / kPlaces);
    for (size_t i = 0; i < s.n; i += step)
      if (const Vec p = vec(s.xyz + 3 * i); finite(p)) places.push_back(p);
  }
}

// hides(way): whether the solid cuts the line from the eye along `way`.
template <class Hides>
float Hidden::shown_if(Hides hides) const {
  double most = 0;
  for (const std::vector<Vec> &places : places_) {
    const auto n = std::count_if(places.begin(), places.end(),
                                 [&](const Vec &p) { return hides((p - eye_) * kBefore); });
    if (n > 0) most = std::max(most, double(n) / double(places.size()));
  }
  const double u = std::clamp((most - kSome) / (kNearlyAll - kSome), 0.0, 1.0);
  return 1 - (1 - kLeft) * float(u * u * (3 - 2 * u));
}

float Hidden::shown(const Box &box) const {
  Vec axes[3];
  axes_of(box, axes);
  double at[3];
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    at[k] = dot(eye_ - vec(box.pose.position), axes[k]) / dot(axes[k], axes[k]);
    inside = inside && std::abs(at[k]) < 1;
  }
  if (inside) return 1;
  return shown_if([&](const Vec &way) {
    double first = 0, last = 1;
    for (int k = 0; k < 3; ++k) {
      const double along = dot(way, axes[k]) / dot(axes[k], axes[k]);
      const double side = along < 0 ? -1 : 1, none = std::numeric_limits<double>::min();
      const double per = side / std::max(std::abs(along), none);
      first = std::max(first, (-side - at[k]) * per);
      last = std::min(last, (side - at[k]) * per);
    }
    return first < last;
  });
}

float Hidden::shown(const Sphere &sphere) const {
  const Capsule ball{{sphere.center[0], sphere.center[1], sphere.center[2]},
                     {sphere.center[0], sphere.center[1], sphere.center[2]},
                     sphere.radius,
                     {}};
  return shown(ball);
}

float Hidden::shown(const Capsule &capsule) const {
  const Vec a = vec(capsule.a), axis = vec(capsule.b) - a;
  if (distance(eye_, {}, a, axis) < capsule.radius) return 1;
  return shown_if([&](const Vec &way) { return distance(eye_, way, a, axis) < capsule.radius; });
}

}  // namespace render
