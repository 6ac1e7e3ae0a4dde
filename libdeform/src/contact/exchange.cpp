#include "contact/exchange.h"

#include <algorithm>
#include <tuple>

#include "math/vec3.h"

namespace dfm {

AreaExchange::AreaExchange(const Memory &m) {
  use_memory(m, corners_, last_, fresh_, triangles_, area_, part_, pressure_);
}

void AreaExchange::list(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                        const uint32_t *law, const double *area) {
  const size_t n = contacts.size();
  area_.assign(area, area + n);
  part_.resize(n);
  pressure_.resize(n);
  fresh_.clear();
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    // A contact may have less area than its triangles (detection gives it half between two meshes, and none
    // if the guard added it): it has the same share of each of them.
    part_[i] = c.area > 0 ? std::min(1.0, area[i] / ((c.obstacle ? 1 : 2) * c.area)) : 0;
    if (c.type_a == 0 && law[i] != kNone && area[i] > 0) fresh_.push_back({c.node[0], side_b(c), i, law[i]});
  }
  const bool same = std::equal(
      fresh_.begin(), fresh_.end(), last_.begin(), last_.end(), [](const Corner &l, const Corner &r) {
        return l.node == r.node && l.other == r.other && l.contact == r.contact && l.law == r.law;
      });
  if (!same) list_triangles(contacts, sources);
}

const AreaExchange::Corner *AreaExchange::find(uint32_t node, uint32_t other) const {
  const auto at = std::lower_bound(corners_.begin(), corners_.end(), std::pair{node, other},
                                   [](const Corner &l, const std::pair<uint32_t, uint32_t> &r) {
                                     return std::tie(l.node, l.other) < std::tie(r.first, r.second);
                                   });
  return at != corners_.end() && at->node == node && at->other == other ? &*at : nullptr;
}

// Triangles with at least two corners that take part, each once, listed by the first of these corners. A
// corner that touches the other side twice takes no part.
void AreaExchange::list_triangles(std::span<const ContactPoint> contacts,
                                  std::span<const DofSource> sources) {
  last_.clear();  // if memory runs out, an incomplete list is rebuilt
  corners_.assign(fresh_.begin(), fresh_.end());
  triangles_.clear();
  std::sort(corners_.begin(), corners_.end(), [](const Corner &l, const Corner &r) {
    return std::tie(l.node, l.other, l.contact) < std::tie(r.node, r.other, r.contact);
  });
  size_t kept = 0;
  for (size_t k = 0, end; k < corners_.size(); k = end) {
    for (end = k + 1; end < corners_.size() && corners_[k].node == corners_[end].node &&
                      corners_[k].other == corners_[end].other;
         ++end) {}
    if (end == k + 1) corners_[kept++] = corners_[k];
  }
  corners_.resize(kept);
  for (const Corner &corner : corners_) {
    const uint32_t slot = contacts[corner.contact].slot_a, surfel = corner.node - sources[slot].first_node;
    const Surface &s = *sources[slot].surface;
    for (uint32_t k = s.fan_begin[surfel]; k < s.fan_begin[surfel + 1]; ++k) {
      Triangle t{slot, s.fan[k], {kNone, kNone, kNone}, {0, 0, 0}};
      uint32_t first = kNone, count = 0;
      for (int j = 0; j < 3; ++j) {
        const uint32_t c = s.tri[3 * size_t{t.number} + size_t(j)];
        const Corner *const found = find(sources[slot].first_node + c, corner.other);
        if (found && found->law == corner.law) {
          t.contact[j] = found->contact;
          first = std::min(first, c);
          ++count;
        }
      }
      if (first == surfel && count > 1) triangles_.push_back(t);
    }
  }
  last_.assign(fresh_.begin(), fresh_.end());
}

// The share of each corner in its triangles.
void AreaExchange::measure(std::span<const ContactPoint> contacts, std::span<const DofSource> sources) {
  for (Triangle &t : triangles_) {
    const Surface &s = *sources[t.slot].surface;
    const uint32_t *const c = &s.tri[3 * size_t{t.number}];
    const Vec3 x0 = load3(&s.x[4 * size_t{c[0]}]);
    const Vec3 twice = cross(load3(&s.x[4 * size_t{c[1]}]) - x0, load3(&s.x[4 * size_t{c[2]}]) - x0);
    for (int j = 0; j < 3; ++j) {
      if (t.contact[j] == kNone) continue;
      const Vec3 normal = load3(contacts[t.contact[j]].normal);
      t.area[j] = part_[t.contact[j]] * std::max(0.0, -0.5 * dot(normal, twice));
    }
  }
}

void AreaExchange::pass(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                        const double *impulse, double *area) {
  measure(contacts, sources);
  for (const Corner &c : corners_) pressure_[c.contact] = impulse[3 * size_t{c.contact}] / area_[c.contact];
  for (const Triangle &t : triangles_) {
    double p[3], sum = 0;
    for (int j = 0; j < 3; ++j) sum += p[j] = t.contact[j] != kNone ? pressure_[t.contact[j]] : 0;
    for (int j = 0, next = 1; j < 3; ++j, next = next == 2 ? 0 : next + 1) {
      // the area that the corner takes from the next one: a term of (1)
      const double low = std::min(p[j], p[next]), high = std::max(p[j], p[next]);
      if (!(low > 0)) continue;
      const double moved =
          std::min(t.area[j], t.area[next]) * (p[j] - p[next]) / (3 * sum) * std::min(1.0, 2 * low / high);
      area[t.contact[j]] += moved;
      area[t.contact[next]] -= moved;
    }
  }
}

}  // namespace dfm
