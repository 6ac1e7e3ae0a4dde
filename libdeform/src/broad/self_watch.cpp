#include "broad/self_watch.h"

#include <algorithm>
#include <span>

#include "contact/reach.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr double kNear = 0.6;  // of the distance at rest; contacts rest at half of it at most
constexpr double kRounding = 1 + 1e-9;

double face_distance(const Surface &s, SelfPair pair, const double *x) {
  const auto at = [&](uint32_t i) { return load3(x + 4 * size_t{i}); };
  const uint32_t *const c = &s.tri[3 * size_t{pair.b}];
  return std::sqrt(closest_on_triangle(at(pair.a), at(c[0]), at(c[1]), at(c[2])).distance2);
}

double edge_distance(const Surface &s, SelfPair pair, const double *x) {
  const auto at = [&](uint32_t i) { return load3(x + 4 * size_t{i}); };
  const uint32_t *const a = &s.edge[2 * size_t{pair.a}], *const b = &s.edge[2 * size_t{pair.b}];
  return std::sqrt(closest_segments(at(a[0]), at(a[1]), at(b[0]), at(b[1])).distance2);
}

// Largest difference of two arrays [n,4], less that of their first rows; y null: of x itself. What all rows
// have in common brings no two of them together.
double largest_beside_first(uint32_t n, const double *x, const double *y) {
  alignas(16) double common[4];
  for (int k = 0; k < 4; ++k) common[k] = x[k] - (y ? y[k] : 0);
  return largest_norm(n, x, y, common);
}

}  // namespace

SelfWatch::SelfWatch(const Memory &m, const Surface &surface, const SelfRest &rest, SelfList &list)
    : surface_(surface),
      rest_(rest),
      list_(list),
      now_([&surface](uint32_t i) { return load3(&surface.v[4 * size_t{i}]); }) {
  use_memory(m, x_, apart_, safe_);
}

// Two features have moved, and move, against each other by no more than twice what a surfel does
// against the first.
bool SelfWatch::near(double h, double offset, double speed) {
  const Surface &s = surface_;
  speed_ = -1;
  left_ = -1;
  if (s.ntri == 0) return false;
  if (slack_ > 0 && offset == offset_)
    left_ = slack_ - kRounding * 2 * largest_beside_first(s.nsurfel, s.x.data(), x_.data());
  speed_ = speed;
  if (kRounding * 4 * h * speed_ < left_) return false;
  speed_ = largest_beside_first(s.nsurfel, s.v.data(), nullptr);
  if (kRounding * 4 * h * speed_ < left_) return false;
  list_.update(h, offset);
  return any_near(offset, {2 * h, HUGE_VAL, 4 * h * speed_, now_});
}

bool SelfWatch::meets(double h, double offset, double change, const std::function<Vec3(uint32_t)> &velocity) {
  if (surface_.ntri == 0 || kRounding * 2 * h * (speed_ + change) < left_) return false;
  list_.update(h, offset);
  list_.cover(h, offset, change);
  return any_near(offset, {h, 2 * h * (list_.deforming() + change), 2 * h * (speed_ + change), velocity});
}

// A pair that is not listed is not near: update() and cover() list all pairs within the reach of a contact,
// and those that are deeper than what contacts push back.
bool SelfWatch::any_near(double offset, const SelfQuery &query) {
  const Surface &s = surface_;
  const Array<SelfPair> &faces = list_.vertex_face(), &edges = list_.edge_edge();
  slack_ = left_ = -1;
  if (!x_.empty()) way_ += kRounding * 2 * largest_beside_first(s.nsurfel, s.x.data(), x_.data());
  x_.assign(s.x.begin(), s.x.end());
  if (renewals_ != list_.renewals() || offset != offset_) {
    renewals_ = 0;  // until it is whole
    apart_.clear();
    for (const SelfPair &pair : faces) apart_.push_back(face_distance(s, pair, rest_.x.data()));
    for (const SelfPair &pair : edges) apart_.push_back(edge_distance(s, pair, rest_.x.data()));
    safe_.assign(apart_.size(), -HUGE_VAL);
    way_ = 0;
    renewals_ = list_.renewals();
    offset_ = offset;
  }
  const double least = std::max(2 * offset, self_recovery_depth(s));
  double left = list_.covered() - least;
  const double needs = kRounding * query.fall;
  const auto is_safe = [&](size_t k) {
    const bool safe = safe_[k] - way_ > needs;
    if (safe) left = std::min(left, safe_[k] - way_);
    return safe || !(apart_[k] > kClosedAtRest * offset);
  };
  const auto is_near = [&](size_t k, double distance, std::span<const uint32_t> a,
                           std::span<const uint32_t> b) {
    const double reach = std::min(2 * offset, kNear * apart_[k]);
    const double closest = std::min(least, kNear * apart_[k]);
    safe_[k] = way_ + distance - closest;
    left = std::min(left, distance - closest);
    if (distance >= std::max(closest, reach + query.most)) return false;
    double speed2 = 0;
    for (const uint32_t i : a)
      for (const uint32_t j : b) speed2 = std::max(speed2, norm2(query.velocity(i) - query.velocity(j)));
    return distance < std::max(closest, reach + std::min(query.time * std::sqrt(speed2), query.most));
  };
  for (size_t k = 0; k < faces.size(); ++k)
    if (!is_safe(k) && is_near(k, face_distance(s, faces[k], s.x.data()), {&faces[k].a, 1},
                               {&s.tri[3 * size_t{faces[k].b}], 3}))
      return true;
  for (size_t k = 0; k < edges.size(); ++k) {
    if (is_safe(faces.size() + k)) continue;
    const uint32_t *const a = &s.edge[2 * size_t{edges[k].a}], *const b = &s.edge[2 * size_t{edges[k].b}];
    if (is_near(faces.size() + k, edge_distance(s, edges[k], s.x.data()), {a, 2}, {b, 2})) return true;
  }
  slack_ = left_ = left;
  return false;
}

}  // namespace dfm
