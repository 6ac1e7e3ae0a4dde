#include "broad/self_list.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "contact/reach.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

// of the median edge: if wider, every surfel would list the triangles of the second ring around it
constexpr double kSkin = 0.2;
constexpr double kSpeedGrowth = 1.25;
// share of the surfels above which the whole lists are renewed: a part takes twice as long for each triangle,
// and what is left is out of date earlier
constexpr double kMaxAnew = 0.25;

bool before(const SelfPair &l, const SelfPair &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; }

void sort_pairs(Array<SelfPair> &list, size_t from) {
  if (!std::is_sorted(list.begin() + std::ptrdiff_t(from), list.end(), before))
    std::sort(list.begin() + std::ptrdiff_t(from), list.end(), before);
}

// Largest difference of two arrays [n,4], less that of their first rows; y null: of x itself. What all rows
// have in common brings no two of them together.
double largest_beside_first(uint32_t n, const double *x, const double *y) {
  alignas(16) double common[4];
  for (int k = 0; k < 4; ++k) common[k] = x[k] - (y ? y[k] : 0);
  return largest_norm(n, x, y, common);
}

}  // namespace

SelfList::SelfList(const Memory &m, const Surface &surface) : surface_(surface), tree_(m), at_(m) {
  use_memory(m, x_, vf_, ee_, scratch_, stack_, anew_[0], anew_[1], anew_[2]);
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
    place();
    if (!begun_ && kDistanceRounding * (moved_ + share(h, offset, 1)) <= margin_) return false;
  }
  if (!renew_part(h, offset, 0)) renew(h, offset, 0);
  return true;
}

// Keeps where the surfels are for moved_.
void SelfList::place() {
  x_.assign(surface_.x.begin(), surface_.x.end());
  left_ = least_ - kDistanceRounding * 2 * moved_;
}

bool SelfList::beyond(double reach) const {
  return kDistanceRounding * std::max(reach, self_recovery_depth(surface_)) < left_;
}

double SelfList::within(double h, double offset) const {
  return kDistanceRounding * (std::max(2 * share(h, offset, 1), self_recovery_depth(surface_)) + 2 * moved_);
}

// A contact is made of a pair nearer than its reach, or than the recovery depth, so no pair that is further
// apart makes one. Distances have fallen by no more than twice what a surfel has moved from where the lists
// refer to, beyond any rigid motion: at the last update() beyond the one that fits best, and since then
// beside the first surfel. What turns is measured anew once that does not suffice.
bool SelfList::far(double h, double offset, double speed) {
  const Surface &s = surface_;
  if (s.ntri == 0) return true;
  if (margin_ >= 0 && !begun_) {
    const double moved = moved_ + largest_beside_first(s.nsurfel, s.x.data(), x_.data());
    left_ = least_ - kDistanceRounding * 2 * moved;
    motion_ = {0, speed};
    if (beyond(2 * reach_share(h, offset, speed))) return true;
    motion_.speed = largest_beside_first(s.nsurfel, s.v.data(), nullptr);
    if (beyond(2 * reach_share(h, offset, motion_.speed))) return true;
  }
  update(h, offset);
  return beyond(2 * share(h, offset, 1));
}

bool SelfList::stays_far(double h, double offset, double change) {
  if (surface_.ntri == 0 || beyond(2 * covers(h, offset, change))) return true;
  update(h, offset);
  cover(h, offset, change);
  return beyond(2 * covers(h, offset, change));
}

bool SelfList::cover(double h, double offset, double change) {
  if (surface_.ntri == 0 || kDistanceRounding * (moved_ + covers(h, offset, change)) <= margin_) return false;
  if (!renew_part(h, offset, change)) renew(h, offset, change);
  return true;
}

void SelfList::renew(double h, double offset, double change) {
  const Surface &s = surface_;
  margin_ = -1;  // until the lists are complete: a failed allocation leaves invalid lists
  begun_ = false;
  at_.set(s);
  longest_ = longest_edge(s, s.x.data());
  moved_ = 0;
  if (tree_.empty() && s.tree) tree_.take(*s.tree);
  tree_.renew(s.tri, s.x.data());
  const double now = std::max(share(h, offset, kSpeedGrowth), covers(h, offset, kSpeedGrowth * change));
  const double margin = kDistanceRounding * now + kSkin * s.median_edge;
  limit_ = kDistanceRounding * 2 * margin + self_recovery_depth(s);
  list(limit_);
  find_least();
  margin_ = margin;
  ++renewals_;
}

// False: the lists are to be renewed as a whole, because too much has moved, or because the margin no longer
// suits the motion.
bool SelfList::renew_part(double h, double offset, double change) {
  const Surface &s = surface_;
  if (margin_ < 0) return false;
  const double margin = std::exchange(margin_, -1);  // as in renew()
  const double now = std::max(share(h, offset, kSpeedGrowth), covers(h, offset, kSpeedGrowth * change));
  const double room = margin / kDistanceRounding - now, wanted = kSkin * s.median_edge;
  if (!begun_)
    for (const auto &[list, n] : {std::pair(&anew_[0], s.nsurfel), {&anew_[1], s.nedge}, {&anew_[2], s.ntri}})
      list->assign(n, 0);
  begun_ = false;
  if (!(room >= 0.5 * wanted && room <= 4 * wanted)) return false;
  if (!at_.set_again(s, 0.5 * room, uint32_t(kMaxAnew * s.nsurfel), anew_[0])) return false;
  mark_features();
  longest_ = longest_edge(s, at_.x().data());
  moved_ = at_.displaced(s);
  if (tree_.empty() && s.tree) tree_.take(*s.tree);
  tree_.renew(s.tri, at_.x().data());
  list_anew(limit_);
  find_least();
  ++renewals_;
  if (!(kDistanceRounding * (moved_ + share(h, offset, 1)) <= margin &&
        kDistanceRounding * (moved_ + covers(h, offset, change)) <= margin))
    return false;
  margin_ = margin;
  ++parts_;
  return true;
}

void SelfList::find_least() {
  least_ = limit_;
  for (const Array<SelfPair> *list : {&vf_, &ee_})
    for (const SelfPair &pair : *list) least_ = std::min(least_, pair.apart);
  place();
}

// An edge with a marked surfel, and a triangle with a marked surfel or edge, are marked.
void SelfList::mark_features() {
  const Surface &s = surface_;
  auto &[surfels, edges, triangles] = anew_;
  for (size_t e = 0; e < s.nedge; ++e) edges[e] |= surfels[s.edge[2 * e]] | surfels[s.edge[2 * e + 1]];
  for (size_t t = 0; t < s.ntri; ++t)
    for (size_t k = 3 * t; k < 3 * t + 3; ++k) triangles[t] |= surfels[s.tri[k]] | edges[s.tri_edge[k]];
}

void SelfList::follow(const SelfList &list, const FeatureMap &features, std::span<const uint8_t> moved) {
  const Surface &s = surface_;
  // begun: it has not been completed since the cut before
  if (list.margin_ < 0 || list.begun_ || s.ntri == 0) return;
  const uint32_t counts[3] = {s.nsurfel, s.nedge, s.ntri};
  for (size_t kind = 0; kind < 3; ++kind) {
    anew_[kind].assign(counts[kind], 1);
    for (const uint32_t now : features.of[kind])
      if (now != kNone) anew_[kind][now] = 0;
  }
  for (uint32_t i = 0; i < s.nsurfel; ++i) anew_[0][i] |= moved[i];
  at_.follow(list.at_, features.of[0], s, anew_[0]);
  const auto take = [](const Array<SelfPair> &from, const std::vector<uint32_t> &a,
                       const std::vector<uint32_t> &b, bool swap, Array<SelfPair> &to) {
    to.reserve(from.size());
    for (const SelfPair &pair : from) {
      SelfPair now{a[pair.a], b[pair.b], pair.apart};
      if (now.a == kNone || now.b == kNone) continue;
      if (swap && now.b < now.a) std::swap(now.a, now.b);
      to.push_back(now);
    }
    sort_pairs(to, 0);
  };
  take(list.vf_, features.of[0], features.of[2], false, vf_);
  take(list.ee_, features.of[1], features.of[1], true, ee_);
  longest_ = longest_edge(s, at_.x().data());
  limit_ = list.limit_;  // the median edge may be another one now
  margin_ = std::min(list.margin_, (limit_ - self_recovery_depth(s)) / (2 * kDistanceRounding));
  begun_ = true;
}

// Pairs of features of two triangles. wanted(kind of a, a, kind of b, b) by kinds of anew_.
template <class Wanted>
void SelfList::add(uint32_t a, uint32_t b, double limit, const Wanted &wanted) {
  const Surface &s = surface_;
  const auto corner = [&](uint32_t t, uint32_t k) { return s.tri[3 * size_t{t} + k % 3]; };
  const double *const x = at_.x().data();
  const auto at = [x](uint32_t surfel) { return load3(x + 4 * size_t{surfel}); };
  // most triangles own few features: only these are looked at
  const auto vertices = [&](uint32_t from, uint32_t face) {
    for (uint32_t left = s.tri_owns[from] & 7u; left; left &= left - 1) {
      const uint32_t p = corner(from, uint32_t(std::countr_zero(left)));
      const uint32_t c0 = corner(face, 0), c1 = corner(face, 1), c2 = corner(face, 2);
      if (p != c0 && p != c1 && p != c2 && wanted(0, p, 2, face) &&
          triangle_within(at(p), at(c0), at(c1), at(c2), limit))
        vf_.push_back({p, face, std::sqrt(closest_on_triangle(at(p), at(c0), at(c1), at(c2)).distance2)});
    }
  };
  vertices(a, b);
  vertices(b, a);
  const uint32_t own_a = s.tri_owns[a] >> 3, own_b = s.tri_owns[b] >> 3;
  for (uint32_t left_a = own_a; left_a; left_a &= left_a - 1) {
    const uint32_t k = uint32_t(std::countr_zero(left_a)), i = corner(a, k), j = corner(a, k + 1);
    const uint32_t e = s.tri_edge[3 * size_t{a} + k];
    for (uint32_t left_b = own_b; left_b; left_b &= left_b - 1) {
      const uint32_t l = uint32_t(std::countr_zero(left_b)), m = corner(b, l), n = corner(b, l + 1);
      if (i == m || i == n || j == m || j == n) continue;
      const uint32_t f = s.tri_edge[3 * size_t{b} + l];
      if (!wanted(1, e, 1, f) || !segments_within(at(i), at(j), at(m), at(n), limit)) continue;
      const double apart = std::sqrt(closest_segments(at(i), at(j), at(m), at(n)).distance2);
      ee_.push_back({std::min(e, f), std::max(e, f), apart});
    }
  }
}

void SelfList::list(double limit) {
  vf_.clear();
  ee_.clear();
  const auto all = [](int, uint32_t, int, uint32_t) { return true; };
  near_self_pairs(tree_, limit, stack_, [&](uint32_t place_a, uint32_t place_b, double) {
    add(tree_.triangles()[place_a], tree_.triangles()[place_b], limit, all);
  });
  std::sort(vf_.begin(), vf_.end(), before);
  std::sort(ee_.begin(), ee_.end(), before);
}

// Replaces the pairs of marked features. Each of them has a marked triangle that owns it or is it.
void SelfList::list_anew(double limit) {
  const auto marked = [this](int kind, uint32_t feature) { return anew_[kind][feature] != 0; };
  std::erase_if(vf_, [&](const SelfPair &p) { return marked(0, p.a) || marked(2, p.b); });
  std::erase_if(ee_, [&](const SelfPair &p) { return marked(1, p.a) || marked(1, p.b); });
  const size_t faces = vf_.size(), edges = ee_.size();
  const auto wanted = [&](int kind_a, uint32_t a, int kind_b, uint32_t b) {
    return marked(kind_a, a) || marked(kind_b, b);
  };
  for (uint32_t place = 0; place < tree_.triangles().size(); ++place) {
    const uint32_t t = tree_.triangles()[place];
    if (!marked(2, t)) continue;
    const Box &own = tree_.triangle_boxes()[place];
    near_triangles(
        tree_, [&](const Box &b) { return box_distance2(own, b) <= limit * limit; },
        [&](uint32_t other) {
          if (other != t && !(marked(2, other) && other < t)) add(t, other, limit, wanted);
        });
  }
  const auto join = [this](Array<SelfPair> &list, size_t kept) {
    std::sort(list.begin() + std::ptrdiff_t(kept), list.end(), before);
    scratch_.resize(list.size());
    std::merge(list.begin(), list.begin() + std::ptrdiff_t(kept), list.begin() + std::ptrdiff_t(kept),
               list.end(), scratch_.begin(), before);
    list.swap(scratch_);
  };
  join(vf_, faces);
  join(ee_, edges);
}

}  // namespace dfm
