#include "contact/exchange.h"

#include <algorithm>
#include <tuple>

#include "math/vec3.h"

namespace dfm {

AreaExchange::AreaExchange(const Memory &m) {
  use_memory(m, corners_, last_, fresh_, triangles_, area_, pressure_);
}

void AreaExchange::list(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                        const uint32_t *law, const double *area) {
  const size_t n = contacts.size();
  area_.assign(area, area + n);
  pressure_.resize(n);
  fresh_.clear();
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    if (c.type_a == 0 && law[i] != kNone && area[i] > 0)
      fresh_.push_back({c.node[0], c.slot_b | (c.obstacle ? 0x80000000u : 0u), i, law[i]});
  }
  const bool same = std::equal(
      fresh_.begin(), fresh_.end(), last_.begin(), last_.end(), [](const Corner &l, const Corner &r) {
        return l.node == r.node && l.other == r.other && l.contact == r.contact && l.law == r.law;
      });
  if (!same) list_triangles(contacts, sources);
  for (Triangle &t : triangles_) {
    const Surface &s = *sources[t.slot].surface;
    const uint32_t *const c = &s.tri[3 * size_t{t.number}];
    const Vec3 x0 = load3(&s.x[4 * size_t{c[0]}]);
    const Vec3 twice = cross(load3(&s.x[4 * size_t{c[1]}]) - x0, load3(&s.x[4 * size_t{c[2]}]) - x0);
    for (int j = 0; j < 3; ++j) {
      if (t.contact[j] == kNone) continue;
      const ContactPoint &p = contacts[t.contact[j]];
      // A contact may stand for less than its triangles, of which detection gives it half between two meshes,
      // and for none where the guard added it: of each of them for the same share.
      const double part =
          p.area > 0 ? std::min(1.0, area_[t.contact[j]] / ((p.obstacle ? 1 : 2) * p.area)) : 0;
      t.area[j] = part * std::max(0.0, -0.5 * dot(load3(p.normal), twice));
    }
  }
}

const AreaExchange::Corner *AreaExchange::find(uint32_t node, uint32_t other) const {
  const auto at = std::lower_bound(corners_.begin(), corners_.end(), std::pair{node, other},
                                   [](const Corner &l, const std::pair<uint32_t, uint32_t> &r) {
                                     return std::tie(l.node, l.other) < std::tie(r.first, r.second);
                                   });
  return at != corners_.end() && at->node == node && at->other == other ? &*at : nullptr;
}

// Triangles of which two corners or more take part, each once: by the first of them. A corner that touches
// the other side twice takes no part.
void AreaExchange::list_triangles(std::span<const ContactPoint> contacts,
                                  std::span<const DofSource> sources) {
  last_.clear();  // what is half listed when memory runs out is listed anew
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

// What a corner takes from the next one of its triangle: a term of (1).
double AreaExchange::taken(const Triangle &t, int corner) const {
  const int next = (corner + 1) % 3;
  if (t.contact[corner] == kNone || t.contact[next] == kNone) return 0;
  double sum = 0;
  for (const uint32_t i : t.contact) sum += i != kNone ? pressure_[i] : 0;
  const double mine = pressure_[t.contact[corner]];
  const double its = pressure_[t.contact[next]];
  const double low = std::min(mine, its);
  const double high = std::max(mine, its);
  return low > 0 ? std::min(t.area[corner], t.area[next]) * (mine - its) / (3 * sum) *
                       std::min(1.0, 2 * low / high)
                 : 0;
}

void AreaExchange::pass(const double *impulse, double *area) {
  for (const Corner &c : corners_) pressure_[c.contact] = impulse[3 * size_t{c.contact}] / area_[c.contact];
  for (const Triangle &t : triangles_)
    for (int j = 0; j < 3; ++j) {
      const double moved = taken(t, j);
      if (moved != 0) {
        area[t.contact[j]] += moved;
        area[t.contact[(j + 1) % 3]] -= moved;
      }
    }
}

}  // namespace dfm
