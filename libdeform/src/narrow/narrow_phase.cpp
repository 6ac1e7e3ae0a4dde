#include "narrow/narrow_phase.h"

#include <algorithm>

#include "narrow/detail.h"

namespace dfm {
namespace {

template <class View>
const View *find_slot(std::span<const View> views, uint32_t slot) {
  if (slot < views.size() && views[slot].slot == slot) return &views[slot];
  for (const View &v : views)
    if (v.slot == slot) return &v;
  return nullptr;
}

double largest_speed(const Surface &s) {
  double v2[2] = {0, 0};
  const double *__restrict v = s.v.data();
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    const double w = v[4 * i] * v[4 * i] + v[4 * i + 1] * v[4 * i + 1] + v[4 * i + 2] * v[4 * i + 2];
    v2[i & 1] = w > v2[i & 1] ? w : v2[i & 1];
  }
  return std::sqrt(std::max(v2[0], v2[1]));
}

// Contacts of one surfel with one other side are neighbours in the sorted list.
class Owners {
 public:
  Owners(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles, const Array<ContactPoint> &contacts)
      : bodies_(bodies), obstacles_(obstacles), contacts_(contacts) {}

  bool has_contact(const BodyView &a, uint32_t surfel, uint64_t id_b, bool obstacle) const {
    const Place wanted{a.id, id_b, surfel, obstacle};
    const auto at = std::lower_bound(contacts_.begin(), contacts_.end(), wanted, [&](const ContactPoint &c, const Place &w) {
      const Place p = place_of(c);
      if (p.id_a != w.id_a) return p.id_a < w.id_a;
      if (p.obstacle != w.obstacle) return p.obstacle < w.obstacle;
      if (p.id_b != w.id_b) return p.id_b < w.id_b;
      return c.type_a == 0 && c.feature_a < w.surfel;
    });
    if (at == contacts_.end() || at->type_a != 0 || at->feature_a != surfel) return false;
    const Place p = place_of(*at);
    return p.id_a == wanted.id_a && p.id_b == wanted.id_b && p.obstacle == obstacle;
  }

 private:
  struct Place {
    uint64_t id_a, id_b;
    uint32_t surfel;
    bool obstacle;
  };
  Place place_of(const ContactPoint &c) const {
    return {find_slot(bodies_, c.slot_a)->id, c.obstacle ? find_slot(obstacles_, c.slot_b)->id : find_slot(bodies_, c.slot_b)->id, c.feature_a,
            c.obstacle != 0};
  }
  std::span<const BodyView> bodies_;
  std::span<const ObstacleView> obstacles_;
  const Array<ContactPoint> &contacts_;
};

// An edge or triangle contact takes over the area of the nearest of its corners that carries no contact of its own with the other side; none is
// given twice; 0 where none is free (mechanics, section 5). reserved2 holds the node that gave.
void share_areas(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles, Array<ContactPoint> &out) {
  const Owners owners(bodies, obstacles, out);
  size_t first = 0;                        // of this pair's edges and triangles
  for (size_t i = 0; i < out.size(); ++i) {
    ContactPoint &c = out[i];
    if (c.type_a == 0 || c.slot_a != out[first].slot_a || c.slot_b != out[first].slot_b || c.obstacle != out[first].obstacle) first = i;
    if (c.type_a == 0) continue;
    const BodyView &a = *find_slot(bodies, c.slot_a);
    const BodyView *b = c.obstacle ? nullptr : find_slot(bodies, c.slot_b);
    const uint64_t id_b = b ? b->id : find_slot(obstacles, c.slot_b)->id;
    double nearest = 0;
    for (int k = 0; k < c.nnode; ++k) {
      const bool side_a = c.weight[k] > 0;
      const BodyView &own = side_a ? a : *b;
      const uint32_t surfel = c.node[k] - own.first_node;
      const double d2 = norm2(load3(&own.surface->x[4 * size_t{surfel}]) - load3(c.point));
      if (c.reserved2 && !(d2 < nearest)) continue;
      bool free = !owners.has_contact(own, surfel, side_a ? id_b : a.id, c.obstacle != 0);
      for (size_t j = first; free && j < i; ++j) free = out[j].reserved2 != c.node[k] + 1;
      if (!free) continue;
      nearest = d2;
      c.reserved2 = c.node[k] + 1;
      c.area = own.surface->area[surfel] * (b ? 0.5 : 1.0);
    }
  }
}

}  // namespace

void find_contacts(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles, const Array<Candidate> &candidates, double h,
                   double offset, Array<ContactPoint> &out) {
  out.clear();
  const BodyView *fast = nullptr;
  double speed = 0;
  for (size_t i = 0; i < candidates.size();) {
    const Candidate &c = candidates[i];
    size_t end = i + 1;
    while (end < candidates.size() && candidates[end].slot_a == c.slot_a && candidates[end].slot_b == c.slot_b &&
           candidates[end].obstacle == c.obstacle && candidates[end].kind == c.kind)
      ++end;
    const narrow::Run run(&c, end - i);
    i = end;
    const BodyView &a = *find_slot(bodies, c.slot_a);
    if (c.obstacle) {
      const ObstacleShape shape(*find_slot(obstacles, c.slot_b));
      const narrow::Pair pair{a, nullptr, &shape, h, offset, 0};
      (c.kind == 0 ? narrow::surfel_obstacle : c.kind == 1 ? narrow::edge_obstacle : narrow::triangle_obstacle)(pair, run, out);
      continue;
    }
    const BodyView *b = find_slot(bodies, c.slot_b);
    if (b != fast) speed = largest_speed(*b->surface);
    fast = b;
    const narrow::Pair pair{a, b, nullptr, h, offset, speed};
    (c.kind == 0 ? narrow::vertex_face : narrow::edge_edge)(pair, run, out);
  }
  share_areas(bodies, obstacles, out);
}

}  // namespace dfm
