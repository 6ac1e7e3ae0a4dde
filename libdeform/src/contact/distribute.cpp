#include "contact/distribute.h"

#include <algorithm>

namespace dfm {

namespace {

const ImpulseSink &sink_of(std::span<const ImpulseSink> sinks, uint32_t node) {
  return *(std::upper_bound(sinks.begin(), sinks.end(), node,
                            [](uint32_t value, const ImpulseSink &s) { return value < s.first_node; }) -
           1);
}

// A surfel that is a point passes its impulse to that point.
void pass_on(const ImpulseSink &s, uint32_t surfel) {
  if (s.phyxel && s.surface->identity())
    store3(s.phyxel + size_t(4) * s.surface->point[surfel], load3(s.surfel + size_t(3) * surfel));
}

void zero(std::span<const ImpulseSink> sinks, const WrittenNodes &given) {
  if (given.known) {
    for (const uint32_t node : given.list) {
      const ImpulseSink &s = sink_of(sinks, node);
      store3(s.surfel + size_t(3) * (node - s.first_node), {});
      pass_on(s, node - s.first_node);
    }
    return;
  }
  for (const ImpulseSink &s : sinks) {
    std::fill(s.surfel, s.surfel + size_t(3) * s.nnode, 0.0);
    for (uint32_t j = 0; j < s.nnode; ++j) pass_on(s, j);
  }
}

}  // namespace

void distribute(std::span<const ContactPoint> contacts, const double *frame, const double *impulse,
                std::span<const ImpulseSink> sinks, WrittenNodes &given, std::span<const Bond> bonds,
                const double *bond_impulse) {
  zero(sinks, given);
  given.known = false;  // until all that follows is in the list
  given.list.clear();
  const auto add = [&](const auto &c, Vec3 p) {
    for (uint32_t k = 0; k < c.nnode; ++k) {
      const uint32_t node = c.node[k];
      const ImpulseSink &sink = sink_of(sinks, node);
      add3(sink.surfel + size_t(3) * (node - sink.first_node), c.weight[k] * p);
      pass_on(sink, node - sink.first_node);
      given.list.push_back(node);
    }
  };
  for (size_t i = 0; i < contacts.size(); ++i) {
    const double *const f = frame + 9 * i, *const l = impulse + 3 * i;
    if (l[0] == 0 && l[1] == 0 && l[2] == 0) continue;
    const Vec3 p = from_frame(f, load3(l));
    add(contacts[i], p);
  }
  for (size_t k = 0; k < bonds.size(); ++k) add(bonds[k], load3(bond_impulse + 3 * k));
  for (const ImpulseSink &s : sinks)
    if (s.phyxel && !s.surface->identity()) scatter_surface(*s.surface, s.surfel, s.npoint, s.phyxel);
  given.known = true;
}

void scatter_surface(const Surface &surface, const double *surfel, uint32_t npoint, double *phyxel) {
  std::fill(phyxel, phyxel + size_t(4) * npoint, 0.0);
  using Point = double __attribute__((vector_size(32)));
  Point *const to = reinterpret_cast<Point *>(phyxel);
  for (uint32_t s = 0; s < surface.nsurfel; ++s) {
    const double *const f = surfel + size_t(3) * s;
    if (f[0] == 0 && f[1] == 0 && f[2] == 0) continue;
    const Point p{f[0], f[1], f[2], 0};
    for (uint32_t j = surface.row[s]; j < surface.row[s + 1]; ++j)
      to[surface.col[j]] += surface.weight[j] * p;
  }
}

}  // namespace dfm
