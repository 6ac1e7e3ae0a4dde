#include "contact/exchange.h"

#include <algorithm>
#include <tuple>

#include "math/vec3.h"
#include "surfel/area.h"

namespace dfm {
namespace {

// Corners whose normals are further apart than 60 degrees are on two sides of a sharp edge.
constexpr double kSharp = 0.5;
constexpr int kPairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};

// What contact i of a triangle takes from contact j: a term of (1).
double passes(double area, double pi, double pj, double sum) {
  const double low = std::min(pi, pj), high = std::max(pi, pj);
  return low > 0 ? area * (pi - pj) / (3 * sum) * std::min(1.0, 2 * low / high) : 0.0;
}

}  // namespace

AreaExchange::AreaExchange(const Memory &m) { use_memory(m, corners_, triangles_, area_, before_, now_, moves_); }

// Contacts of corners in ascending order; where a corner touches the other side twice, none of the two.
void AreaExchange::list_corners(std::span<const ContactPoint> contacts, const uint32_t *law, const double *area) {
  corners_.clear();
  for (uint32_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint &c = contacts[i];
    if (c.type_a == 0 && law[i] != kNone && area[i] > 0) corners_.push_back({c.node[0], c.slot_b | (c.obstacle ? 0x80000000u : 0u), i});
  }
  std::sort(corners_.begin(), corners_.end(),
            [](const Corner &l, const Corner &r) { return std::tie(l.node, l.other, l.contact) < std::tie(r.node, r.other, r.contact); });
  const auto same = [](const Corner &l, const Corner &r) { return l.node == r.node && l.other == r.other; };
  size_t kept = 0;
  for (size_t k = 0, end; k < corners_.size(); k = end) {
    for (end = k + 1; end < corners_.size() && same(corners_[k], corners_[end]); ++end) {}
    if (end == k + 1) corners_[kept++] = corners_[k];
  }
  corners_.resize(kept);
}

uint32_t AreaExchange::contact_at(uint32_t node, uint32_t other) const {
  const auto at = std::lower_bound(corners_.begin(), corners_.end(), std::pair{node, other}, [](const Corner &l, const std::pair<uint32_t, uint32_t> &r) {
    return std::tie(l.node, l.other) < std::tie(r.first, r.second);
  });
  return at != corners_.end() && at->node == node && at->other == other ? at->contact : kNone;
}

// Triangles of which two corners or more take part, each once: by the first of them.
void AreaExchange::list_triangles(std::span<const ContactPoint> contacts, std::span<const DofSource> sources, const uint32_t *law) {
  triangles_.clear();
  for (const Corner &corner : corners_) {
    const DofSource &source = sources[contacts[corner.contact].slot_a];
    const Surface &s = *source.surface;
    const uint32_t surfel = corner.node - source.first_node;
    for (uint32_t k = s.fan_begin[surfel]; k < s.fan_begin[surfel + 1]; ++k) {
      const uint32_t *const c = &s.tri[3 * size_t{s.fan[k]}];
      Triangle t{{kNone, kNone, kNone}, {0, 0, 0}};
      uint32_t first = kNone, count = 0;
      for (int j = 0; j < 3; ++j) {
        const uint32_t i = contact_at(source.first_node + c[j], corner.other);
        if (i == kNone || law[i] != law[corner.contact] || dot(load3(contacts[i].normal), load3(contacts[corner.contact].normal)) < kSharp) continue;
        t.contact[j] = i, first = std::min(first, c[j]), ++count;
      }
      if (first != surfel || count < 2) continue;
      const Vec3 x0 = load3(&s.x[4 * size_t{c[0]}]), twice = cross(load3(&s.x[4 * size_t{c[1]}]) - x0, load3(&s.x[4 * size_t{c[2]}]) - x0);
      for (int j = 0; j < 3; ++j)
        if (t.contact[j] != kNone) t.area[j] = std::max(0.0, -0.5 * dot(load3(contacts[t.contact[j]].normal), twice));
      triangles_.push_back(t);
    }
  }
}

void AreaExchange::share(std::span<const ContactPoint> contacts, std::span<const DofSource> sources, const uint32_t *law, const double *impulse, double *area) {
  const size_t n = contacts.size();
  list_corners(contacts, law, area);
  list_triangles(contacts, sources, law);
  area_.assign(area, area + n), before_.assign(n, 0.0), now_.assign(n, 0.0);
  moves_.reserve(3 * triangles_.size());
  // A contact between two meshes stands for less, or more, than its triangles: of each of them for the same share.
  for (const Corner &c : corners_) {
    const ContactPoint &p = contacts[c.contact];
    const DofSource &source = sources[p.slot_a];
    const double whole = facing_area(*source.surface, c.node - source.first_node, -load3(p.normal));
    now_[c.contact] = whole > 0 ? area[c.contact] / whole : 0, before_[c.contact] = impulse[3 * size_t{c.contact}] / area[c.contact];
  }
  for (Triangle &t : triangles_) {
    for (int j = 0; j < 3; ++j) t.area[j] *= t.contact[j] != kNone ? now_[t.contact[j]] : 0;
    double p[3];
    for (int j = 0; j < 3; ++j) p[j] = t.contact[j] != kNone ? before_[t.contact[j]] : 0;
    for (const auto &[a, b] : kPairs) {
      const double moved = passes(std::min(t.area[a], t.area[b]), p[a], p[b], p[0] + p[1] + p[2]);
      if (moved != 0) area[t.contact[a]] += moved, area[t.contact[b]] -= moved;
    }
  }
}

std::span<const AreaExchange::Move> AreaExchange::moves(const double *impulse) {
  moves_.clear();
  if (triangles_.empty()) return {};
  for (const Corner &c : corners_) now_[c.contact] = impulse[3 * size_t{c.contact}] / area_[c.contact];
  for (const Triangle &t : triangles_) {
    double p[3], q[3];
    for (int j = 0; j < 3; ++j) {
      const bool takes_part = t.contact[j] != kNone;
      p[j] = takes_part ? before_[t.contact[j]] : 0, q[j] = takes_part ? now_[t.contact[j]] : 0;
    }
    for (const auto &[a, b] : kPairs) {
      const double area = std::min(t.area[a], t.area[b]);
      const double more = passes(area, q[a], q[b], q[0] + q[1] + q[2]) - passes(area, p[a], p[b], p[0] + p[1] + p[2]);
      if (more > 0) moves_.push_back({t.contact[b], t.contact[a], more});
      if (more < 0) moves_.push_back({t.contact[a], t.contact[b], -more});
    }
  }
  return moves_;
}

}  // namespace dfm
