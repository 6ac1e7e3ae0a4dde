#include "state/motion.h"

#include <algorithm>

#include "core/error.h"
#include "math/elementary.h"
#include "math/turn.h"

namespace dfm {
namespace {

// The key interval around t: index of its left key and the fraction in it.
template <class Key>
size_t locate(const std::vector<Key> &keys, double t, double *s) {
  *s = 0;
  if (t <= keys.front().t) return 0;
  if (t >= keys.back().t) return keys.size() - 1;
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), t, [](double time, const Key &key) { return time < key.t; });
  const size_t i = static_cast<size_t>(after - keys.begin()) - 1;
  *s = (t - keys[i].t) / (keys[i + 1].t - keys[i].t);
  return i;
}

template <class Key, class Finite>
void check(const std::vector<Key> &keys, const char *what, Finite finite) {
  for (size_t i = 0; i < keys.size(); ++i) {
    if (!std::isfinite(keys[i].t) || !finite(keys[i]))
      fail(DFM_E_ARG, "%s: key %zu is not finite; give finite numbers", what, i);
    if (i && !(keys[i].t > keys[i - 1].t))
      fail(DFM_E_ARG, "%s: times must increase, but key %zu has t = %g after %g", what, i, keys[i].t,
           keys[i - 1].t);
  }
}

}  // namespace

Vec3 spin_between(Quat a, Quat b, double h) {
  Quat d = b * conjugate(a);
  if (d.w < 0) d = {-d.x, -d.y, -d.z, -d.w};
  // Half-angle by five halvings, then sin x = x to rounding order: angle = 2 * 2^5 * 2 asin(...) ~ series.
  const Quat one{};
  double scale = 2;
  for (int i = 0; i < 5; ++i) {
    d = unit({d.x + one.x, d.y + one.y, d.z + one.z, d.w + one.w});
    scale *= 2;
  }
  const Vec3 v{d.x, d.y, d.z};
  const double q = norm2(v);
  // asin(x)/x
  const double asin_ratio = 1 + q * (1.0 / 6 + q * (3.0 / 40 + q * (15.0 / 336 + q * (105.0 / 3456))));
  return (scale * asin_ratio / h) * v;
}

Pose pose_at(const std::vector<dfm_pose_key> &keys, double t) {
  double s;
  const size_t i = locate(keys, t, &s);
  const Pose a = to_pose(keys[i].pose);
  if (s == 0) return a;
  const Pose b = to_pose(keys[i + 1].pose);
  return {a.position + s * (b.position - a.position), slerp(a.rotation, b.rotation, s)};
}

Vec3 vector_at(const std::vector<dfm_vector_key> &keys, double t) {
  double s;
  const size_t i = locate(keys, t, &s);
  const Vec3 a = load3(keys[i].value);
  return s == 0 ? a : a + s * (load3(keys[i + 1].value) - a);
}

double scale_at(const std::vector<dfm_scale_key> &keys, double t) {
  double s;
  const size_t i = locate(keys, t, &s);
  return s == 0 ? keys[i].value : keys[i].value + s * (keys[i + 1].value - keys[i].value);
}

double sine_at(const dfm_sine &s, double t) {
  return dfm_sinpi(2 * (s.frequency * t) + s.phase / 3.14159265358979323846);
}

void check_keys(const std::vector<dfm_pose_key> &keys, const char *what) {
  check(keys, what, [](const dfm_pose_key &k) {
    return all_finite(k.pose.position, 3) && all_finite(k.pose.rotation, 4);
  });
}
void check_keys(const std::vector<dfm_vector_key> &keys, const char *what) {
  check(keys, what, [](const dfm_vector_key &k) { return all_finite(k.value, 3); });
}
void check_keys(const std::vector<dfm_scale_key> &keys, const char *what) {
  check(keys, what, [](const dfm_scale_key &k) { return std::isfinite(k.value); });
}

}  // namespace dfm
