#include "broad/rigid_fit.h"

#include <algorithm>
#include <cmath>

#include "math/turn.h"

namespace dfm {
namespace {

// Sums over points r about their mean and vectors d, for the rigid field theta x r + mean that fits d best.
struct Fit { Vec3 mean, theta; };
template <class Point, class Vector>
Fit fit(uint32_t n, Point r, Vector d) {
  Vec3 sum, moment;
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  for (uint32_t s = 0; s < n; ++s) {
    const Vec3 a = r(s), b = d(s);
    sum += b;
    moment += cross(a, b);
    xx += a.x * a.x;
    yy += a.y * a.y;
    zz += a.z * a.z;
    xy += a.x * a.y;
    yz += a.y * a.z;
    zx += a.z * a.x;
  }
  const Vec3 i{yy + zz, -xy, -zx}, j{-xy, xx + zz, -yz}, k{-zx, -yz, xx + yy}, jk = cross(j, k);
  const double det = dot(i, jk);
  const Vec3 theta =
      det > 0 ? (1 / det) * Vec3{dot(moment, jk), dot(moment, cross(k, i)), dot(moment, cross(i, j))}
              : Vec3{};
  return {(1.0 / n) * sum, theta};
}

Vec3 mean_place(const Surface &s) {
  Vec3 sum;
  for (uint32_t i = 0; i < s.nsurfel; ++i) sum += load3(&s.x[4 * size_t{i}]);
  return (1.0 / s.nsurfel) * sum;
}

}  // namespace

void RigidReference::set(const Surface &s) {
  x_.assign(s.x.begin(), s.x.end());
  center_ = mean_place(s);
  turn_ = {};
}

double RigidReference::displaced(const Surface &s) {
  const Vec3 now = mean_place(s);
  const auto place = [&](uint32_t i) { return rotate(turn_, load3(&x_[4 * size_t{i}]) - center_); };
  const auto off = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]) - now - place(i); };
  const Vec3 half = 0.5 * fit(s.nsurfel, place, off).theta;
  turn_ = unit(unit({half.x, half.y, half.z, 1}) * turn_);
  double most = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) most = std::max(most, norm2(off(i)));
  return std::sqrt(most);
}

bool RigidReference::set_again(const Surface &s, double far, uint32_t most, std::span<uint8_t> marked) {
  const Vec3 now = mean_place(s);
  uint32_t count = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    double *const then = &x_[4 * size_t{i}];
    const Vec3 place = load3(&s.x[4 * size_t{i}]) - now;
    if (!marked[i] && norm2(place - rotate(turn_, load3(then) - center_)) <= far * far) continue;
    if (++count > most) return false;
    marked[i] = 1;
    store3(then, rotate_back(turn_, place) + center_);
  }
  return true;
}

// Any positions do for those that are marked; where they are now they count as unmoved.
void RigidReference::follow(const RigidReference &before, std::span<const uint32_t> now, const Surface &s,
                            std::span<const uint8_t> marked) {
  x_.assign(4 * size_t{s.nsurfel}, 0.0);
  Vec3 then, place;  // means over the others
  uint32_t n = 0;
  for (size_t i = 0; i < now.size(); ++i) {
    if (now[i] == kNone || marked[now[i]]) continue;
    std::copy_n(&before.x_[4 * i], 4, &x_[4 * size_t{now[i]}]);
    then += load3(&before.x_[4 * i]);
    place += load3(&s.x[4 * size_t{now[i]}]);
    ++n;
  }
  then = (1.0 / std::max(n, 1u)) * then;
  place = (1.0 / std::max(n, 1u)) * place;
  turn_ = before.turn_;
  center_ = {};
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    double *const x = &x_[4 * size_t{i}];
    if (marked[i]) store3(x, rotate_back(turn_, load3(&s.x[4 * size_t{i}]) - place) + then);
    center_ += load3(x);
  }
  center_ = (1.0 / s.nsurfel) * center_;
}

// Velocities are v = mean + omega x r + rest.
DeformingMotion deforming_motion(const Surface &s, double h) {
  const Vec3 center = mean_place(s);
  const auto place = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]) - center; };
  const auto v = [&](uint32_t i) { return load3(&s.v[4 * size_t{i}]); };
  Fit f = fit(s.nsurfel, place, v);
  if (!(4 * h * norm(f.theta) < 1)) f.theta = {};
  Vec3 sum;  // the mean of the remainder after rotation
  for (uint32_t i = 0; i < s.nsurfel; ++i) sum += v(i) - cross(f.theta, place(i));
  const Vec3 mean = (1.0 / s.nsurfel) * sum;
  double most = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i)
    most = std::max(most, norm2(v(i) - cross(f.theta, place(i)) - mean));
  return {norm(f.theta), std::sqrt(most)};
}

double longest_edge(const Surface &s, const double *x) {
  double most = 0;
  const auto at = [&](size_t k) { return load3(x + 4 * size_t{s.edge[k]}); };
  for (size_t e = 0; e < 2 * size_t{s.nedge}; e += 2) most = std::max(most, norm2(at(e) - at(e + 1)));
  return std::sqrt(most);
}

}  // namespace dfm
