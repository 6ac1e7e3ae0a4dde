#include "broad/self_list.h"

#include <algorithm>
#include <cmath>

#include "contact/reach.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr double kSkinLeast = 0.02;  // of the median edge
// if wider, every surfel would list the triangles of the second ring around it
constexpr double kSkinMost = 0.2;
constexpr double kSpeedGrowth = 1.25;

}  // namespace

SelfList::SelfList(const Memory &m, const Surface &surface) : surface_(surface), tree_(m), at_(m) {
  use_memory(m, vf_, ee_, stack_);
}

// What one of two features adds to the reach of their contact. Two vertices of a pair are no further apart
// than the reach and two edges, so |relative speed| <= 2 |rest| + |omega| (reach + 2 edges).
double SelfList::share(double h, double offset, double growth) const {
  const double turn = growth * h * motion_.turn;
  return (reach_share(h, offset, growth * motion_.speed) + 2 * turn * (longest_ + 2 * moved_)) /
         (1 - 2 * std::min(turn, 0.3));
}

// What one of two features adds to the distance from which they come to each other in the sub-step. On
// straight ways the rigid part of a motion is |r + h omega x r| >= |r|: it brings nothing together.
double SelfList::covers(double h, double offset, double change) const {
  return offset + h * (motion_.speed + change);
}

bool SelfList::update(double h, double offset) {
  const Surface &s = surface_;
  if (s.ntri == 0) return false;
  motion_ = deforming_motion(s, h);
  if (margin_ >= 0) {
    moved_ = at_.displaced(s);
    if (kDistanceRounding * (moved_ + share(h, offset, 1)) <= margin_) return false;
  }
  renew(h, offset, 0);
  return true;
}

bool SelfList::cover(double h, double offset, double change) {
  if (surface_.ntri == 0 || kDistanceRounding * (moved_ + covers(h, offset, change)) <= margin_) return false;
  renew(h, offset, change);
  return true;
}

void SelfList::renew(double h, double offset, double change) {
  const Surface &s = surface_;
  margin_ = -1;  // until the lists are complete: a failed allocation leaves invalid lists
  at_.set(s);
  longest_ = longest_edge(s);
  moved_ = 0;
  tree_.renew(s.tri, s.x.data());
  const double now = std::max(share(h, offset, kSpeedGrowth), covers(h, offset, kSpeedGrowth * change));
  const double edge = s.median_edge;
  const double skin =
      wide_ ? kSkinMost * edge
            : std::clamp(skin_steps_ * 0.5 * (now - offset), kSkinLeast * edge, kSkinMost * edge);
  const double margin = kDistanceRounding * now + skin;
  limit_ = kDistanceRounding * 2 * margin + self_recovery_depth(s);
  list(limit_);
  margin_ = margin;
  ++renewals_;
}

void SelfList::list(double limit) {
  const Surface &s = surface_;
  const auto corner = [&](uint32_t t, uint32_t k) { return s.tri[3 * size_t{t} + k % 3]; };
  const auto at = [&](uint32_t surfel) { return load3(&s.x[4 * size_t{surfel}]); };
  const auto vertices = [&](uint32_t from, uint32_t face) {
    const uint32_t c0 = corner(face, 0), c1 = corner(face, 1), c2 = corner(face, 2);
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t p = corner(from, k);
      if (s.tri_owns[from] >> k & 1 && p != c0 && p != c1 && p != c2 &&
          triangle_within(at(p), at(c0), at(c1), at(c2), limit))
        vf_.push_back({p, face});
    }
  };
  vf_.clear();
  ee_.clear();
  near_self_pairs(tree_, limit, stack_, [&](uint32_t place_a, uint32_t place_b, double) {
    const uint32_t a = tree_.triangles()[place_a], b = tree_.triangles()[place_b];
    vertices(a, b);
    vertices(b, a);
    const uint32_t own_a = s.tri_owns[a] >> 3, own_b = s.tri_owns[b] >> 3;
    if (!own_a || !own_b) return;
    for (uint32_t k = 0; k < 3; ++k)
      for (uint32_t l = 0; l < 3; ++l) {
        if (!(own_a >> k & own_b >> l & 1)) continue;
        const uint32_t i = corner(a, k), j = corner(a, k + 1), m = corner(b, l), n = corner(b, l + 1);
        if (i == m || i == n || j == m || j == n || !segments_within(at(i), at(j), at(m), at(n), limit))
          continue;
        const uint32_t e = s.tri_edge[3 * size_t{a} + k], f = s.tri_edge[3 * size_t{b} + l];
        ee_.push_back({std::min(e, f), std::max(e, f)});
      }
  });
  const auto before = [](const SelfPair &l, const SelfPair &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; };
  std::sort(vf_.begin(), vf_.end(), before);
  std::sort(ee_.begin(), ee_.end(), before);
}

}  // namespace dfm
