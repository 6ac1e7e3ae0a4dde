#include "broad/self_list.h"

#include <algorithm>
#include <cmath>

#include "surfel/closest.h"
#include "surfel/reach.h"

namespace dfm {
namespace {

constexpr double kRounding = 1 + 1e-9;      // margins hold in spite of rounded distances
constexpr double kSkinLeast = 0.02;         // of the median edge
constexpr double kSkinMost = 0.2;           // wider than this, every surfel would list the triangles of the second ring around it
constexpr double kSpeedGrowth = 1.25;
constexpr double kQualityLimit = 2;         // boxes that have grown this much in sum are worth a new tree

// Sums over points r about their mean and vectors d: what the best rigid field theta x r + mean takes of d.
struct Fit {
  Vec3 mean, theta;
};
template <class Point, class Vector>
Fit fit(uint32_t n, Point r, Vector d) {
  Vec3 sum, moment;
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  for (uint32_t s = 0; s < n; ++s) {
    const Vec3 a = r(s), b = d(s);
    sum += b, moment += cross(a, b);
    xx += a.x * a.x, yy += a.y * a.y, zz += a.z * a.z, xy += a.x * a.y, yz += a.y * a.z, zx += a.z * a.x;
  }
  const Vec3 i{yy + zz, -xy, -zx}, j{-xy, xx + zz, -yz}, k{-zx, -yz, xx + yy}, jk = cross(j, k);
  const double det = dot(i, jk);
  const Vec3 theta = det > 0 ? (1 / det) * Vec3{dot(moment, jk), dot(moment, cross(k, i)), dot(moment, cross(i, j))} : Vec3{};
  return {(1.0 / n) * sum, theta};
}

Vec3 mean_place(const Surface &s) {
  Vec3 sum;
  for (uint32_t i = 0; i < s.nsurfel; ++i) sum += load3(&s.x[4 * size_t{i}]);
  return (1.0 / s.nsurfel) * sum;
}

}  // namespace

SelfList::SelfList(const Memory &m, const Surface &surface) : surface_(surface), tree_(m) { use_memory(m, x_, vf_, ee_, stack_); }

double SelfList::displaced() {
  const Surface &s = surface_;
  const Vec3 now = mean_place(s);
  const auto place = [&](uint32_t i) { return rotate(turn_, load3(&x_[4 * size_t{i}]) - centre_); };
  const auto off = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]) - now - place(i); };
  const Vec3 half = 0.5 * fit(s.nsurfel, place, off).theta;
  const double q[4] = {half.x, half.y, half.z, 1};
  turn_ = unit_quat(q) * turn_;
  const double unit[4] = {turn_.x, turn_.y, turn_.z, turn_.w};
  turn_ = unit_quat(unit);
  double most = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) most = std::max(most, norm2(off(i)));
  return std::sqrt(most);
}

// Velocities are v = mean + omega x r + rest.
SelfList::Motion SelfList::motion(double h) const {
  const Surface &s = surface_;
  const Vec3 centre = mean_place(s);
  const auto place = [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]) - centre; };
  const auto v = [&](uint32_t i) { return load3(&s.v[4 * size_t{i}]); };
  Fit f = fit(s.nsurfel, place, v);
  if (!(4 * h * norm(f.theta) < 1)) f.theta = {};
  Vec3 sum;   // the mean of what the turn leaves
  for (uint32_t i = 0; i < s.nsurfel; ++i) sum += v(i) - cross(f.theta, place(i));
  const Vec3 mean = (1.0 / s.nsurfel) * sum;
  double most = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) most = std::max(most, norm2(v(i) - cross(f.theta, place(i)) - mean));
  return {norm(f.theta), std::sqrt(most)};
}

// What one of two features adds to the reach of their contact. Two vertices of a pair are no further apart than the reach and two edges, so
// |relative speed| <= 2 |rest| + |omega| (reach + 2 edges).
double SelfList::share(double h, double offset, double growth) const {
  const double turn = growth * h * motion_.turn;
  return (reach_share(h, offset, growth * motion_.speed) + 2 * turn * (longest_ + 2 * moved_)) / (1 - 2 * std::min(turn, 0.3));
}

// What one of two features adds to the distance from which they come to each other in the sub-step. On straight ways the rigid part of a motion is
// |r + h omega x r| >= |r|: it brings nothing together.
double SelfList::covers(double h, double offset, double change) const { return offset + h * (motion_.speed + change); }

bool SelfList::update(double h, double offset) {
  const Surface &s = surface_;
  if (s.ntri == 0) return false;
  motion_ = motion(h);
  if (margin_ >= 0) {
    moved_ = displaced();
    if (kRounding * (moved_ + share(h, offset, 1)) <= margin_) return false;
  }
  renew(h, offset, 0);
  return true;
}

bool SelfList::cover(double h, double offset, double change) {
  if (surface_.ntri == 0 || kRounding * (moved_ + covers(h, offset, change)) <= margin_) return false;
  renew(h, offset, change);
  return true;
}

void SelfList::renew(double h, double offset, double change) {
  const Surface &s = surface_;
  margin_ = -1;   // until the lists are whole: a refused allocation leaves none that anyone believes
  x_.assign(s.x.begin(), s.x.end());
  centre_ = mean_place(s), turn_ = {}, longest_ = moved_ = 0;
  for (uint32_t e = 0; e < s.nedge; ++e)
    longest_ = std::max(longest_, norm(load3(&x_[4 * size_t{s.edge[2 * size_t{e}]}]) - load3(&x_[4 * size_t{s.edge[2 * size_t{e} + 1]}])));
  if (!tree_.empty()) tree_.refit(s, x_.data());
  if (tree_.empty() || tree_.quality() > kQualityLimit) tree_.build(s, x_.data());
  const double now = std::max(share(h, offset, kSpeedGrowth), covers(h, offset, kSpeedGrowth * change));
  const double skin = std::clamp(skin_steps_ * 0.5 * (now - offset), kSkinLeast * s.median_edge, kSkinMost * s.median_edge);
  const double margin = kRounding * now + skin;
  list(kRounding * 2 * margin + self_recovery_depth(s));
  margin_ = margin, ++renewals_;
}

void SelfList::list(double limit) {
  const Surface &s = surface_;
  const auto corner = [&](uint32_t t, uint32_t k) { return s.tri[3 * size_t{t} + k % 3]; };
  const auto at = [&](uint32_t surfel) { return load3(&x_[4 * size_t{surfel}]); };
  const auto vertices = [&](uint32_t from, uint32_t face) {
    const uint32_t c0 = corner(face, 0), c1 = corner(face, 1), c2 = corner(face, 2);
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t p = corner(from, k);
      if (s.tri_owns[from] >> k & 1 && p != c0 && p != c1 && p != c2 && triangle_within(at(p), at(c0), at(c1), at(c2), limit)) vf_.push_back({p, face});
    }
  };
  vf_.clear(), ee_.clear();
  near_self_pairs(tree_, limit, stack_, [&](uint32_t place_a, uint32_t place_b, double) {
    const uint32_t a = tree_.triangles()[place_a], b = tree_.triangles()[place_b];
    vertices(a, b), vertices(b, a);
    const uint32_t own_a = s.tri_owns[a] >> 3, own_b = s.tri_owns[b] >> 3;
    if (!own_a || !own_b) return;
    for (uint32_t k = 0; k < 3; ++k)
      for (uint32_t l = 0; l < 3; ++l) {
        if (!(own_a >> k & own_b >> l & 1)) continue;
        const uint32_t i = corner(a, k), j = corner(a, k + 1), m = corner(b, l), n = corner(b, l + 1);
        if (i == m || i == n || j == m || j == n || !segments_within(at(i), at(j), at(m), at(n), limit)) continue;
        const uint32_t e = s.tri_edge[3 * size_t{a} + k], f = s.tri_edge[3 * size_t{b} + l];
        ee_.push_back({std::min(e, f), std::max(e, f)});
      }
  });
  const auto before = [](const SelfPair &l, const SelfPair &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; };
  std::sort(vf_.begin(), vf_.end(), before), std::sort(ee_.begin(), ee_.end(), before);
}

}  // namespace dfm
