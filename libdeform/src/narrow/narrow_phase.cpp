#include "narrow/narrow_phase.h"

#include <algorithm>
#include <utility>

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

std::span<const Crossing> of_pair(std::span<const Crossing> all, uint64_t id_a, uint64_t id_b) {
  const auto begin = std::lower_bound(all.begin(), all.end(), Crossing{id_a, id_b, 0, 0});
  return {begin, std::upper_bound(begin, all.end(), Crossing{id_a, id_b, kNone, kNone})};
}

// Contacts of surfels of one body with one other side: a run of the list.
using Owners = std::span<const ContactPoint>;

// Areas of edge and triangle contacts, from corners without a contact with the other side; no area is given
// twice; 0 if none is free.
class Areas {
 public:
  Areas(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
        Array<ContactPoint> &contacts, Array<uint8_t> &lent)
      : bodies_(bodies), obstacles_(obstacles), contacts_(contacts), lent_(lent) {
    uint32_t nnode = 0;
    for (const BodyView &b : bodies) nnode = std::max(nnode, b.first_node + b.surface->nsurfel);
    lent_.assign(nnode, 0);
  }

  void share() {
    for (size_t i = 0; i < contacts_.size();) {
      if (contacts_[i].type_a == 0) {
        ++i;
        continue;
      }
      const ContactPoint &first = contacts_[i];
      size_t end = i + 1;
      while (end < contacts_.size() && contacts_[end].type_a != 0 && contacts_[end].slot_a == first.slot_a &&
             contacts_[end].slot_b == first.slot_b && contacts_[end].obstacle == first.obstacle)
        ++end;
      share(i, end);
      i = end;
    }
  }

 private:
  struct Place {
    uint64_t id_a, id_b;
    bool obstacle;
  };
  Place place_of(const ContactPoint &c) const {
    const uint64_t id_b = c.obstacle ? find_slot(obstacles_, c.slot_b)->id : find_slot(bodies_, c.slot_b)->id;
    return {find_slot(bodies_, c.slot_a)->id, id_b, c.obstacle != 0};
  }
  Owners owners(const Place &wanted) const {
    const auto before = [](const Place &p, const Place &w) {
      if (p.id_a != w.id_a) return p.id_a < w.id_a;
      return p.obstacle != w.obstacle ? p.obstacle < w.obstacle : p.id_b < w.id_b;
    };
    const ContactPoint *list = contacts_.data(), *last = list + contacts_.size();
    // Surfels come before edges and triangles of the same pair.
    const ContactPoint *begin = std::lower_bound(
        list, last, wanted, [&](const ContactPoint &c, const Place &w) { return before(place_of(c), w); });
    const ContactPoint *end = std::lower_bound(
        begin, last, wanted,
        [&](const ContactPoint &c, const Place &w) { return !before(w, place_of(c)) && c.type_a == 0; });
    return {begin, end};
  }
  void mark(const BodyView &body, Owners owners, uint8_t as) {
    for (const ContactPoint &c : owners) lent_[body.first_node + c.feature_a] = as;
  }

  void share(size_t begin, size_t end) {
    const Place pair = place_of(contacts_[begin]);
    const BodyView &a = *find_slot(bodies_, contacts_[begin].slot_a);
    const BodyView *b = pair.obstacle ? nullptr : find_slot(bodies_, contacts_[begin].slot_b);
    const Owners of_a = owners(pair), of_b = b ? owners({pair.id_b, pair.id_a, false}) : Owners{};
    mark(a, of_a, 1);
    if (b) mark(*b, of_b, 1);
    for (size_t i = begin; i < end; ++i) {
      ContactPoint &c = contacts_[i];
      const auto owner = [&](int k) {
        const bool own = c.node[k] - a.first_node < a.surface->nsurfel;
        return narrow::AreaOwner{own ? a : *b, own ? -load3(c.normal) : load3(c.normal)};
      };
      narrow::take_area(c, b ? 0.5 : 1.0, owner, 0, lent_);
    }
    mark(a, of_a, 0);
    if (b) mark(*b, of_b, 0);
    for (size_t i = begin; i < end; ++i)
      if (contacts_[i].area_node_plus_1) lent_[contacts_[i].area_node_plus_1 - 1] = 0;
  }

  std::span<const BodyView> bodies_;
  std::span<const ObstacleView> obstacles_;
  Array<ContactPoint> &contacts_;
  Array<uint8_t> &lent_;  // per node: has a contact or has lent its area, in the pair at hand
};

}  // namespace

namespace {

// Contacts of one run, or of a part of it that ends between two features of body a.
struct Finder {
  std::span<const BodyView> bodies;
  std::span<const ObstacleView> obstacles;
  double h, offset;
  std::span<const Crossing> crossings;
  uint32_t nnode = 0;  // of all bodies

  bool skips(const Candidate &c) const {
    return find_slot(bodies, c.slot_a)->asleep &&
           !(c.obstacle ? find_slot(obstacles, c.slot_b)->moves() : !find_slot(bodies, c.slot_b)->asleep);
  }

  void operator()(narrow::Run run, const NarrowBlocks::Range &range, Array<ContactPoint> &out) const {
    const Candidate &c = run.front();
    const BodyView &a = *find_slot(bodies, c.slot_a);
    if (!c.obstacle) {
      const BodyView *const b = find_slot(bodies, c.slot_b);
      const narrow::Pair pair{a,
                              b,
                              nullptr,
                              h,
                              offset,
                              range.speed,
                              of_pair(crossings, a.id, b->id),
                              parts_of_one(*a.surface, a.id, *b->surface, b->id),
                              range.known};
      return (c.kind == 0 ? narrow::vertex_face : narrow::edge_edge)(pair, run, out);
    }
    const ObstacleView &view = *find_slot(obstacles, c.slot_b);
    if (view.shape == Shape::mesh) {
      const BodyView mesh{view.slot, nnode, view.category, view.collides_with, view.id, view.surface};
      const double fastest = norm(view.velocity) + norm(view.spin) * view.extent;
      return narrow::mesh_obstacle({a, &mesh, nullptr, h, offset, fastest, of_pair(crossings, a.id, view.id)},
                                   view, c.kind, run, out);
    }
    const ObstacleShape shape(view);
    const narrow::Pair pair{a, nullptr, &shape, h, offset, 0, of_pair(crossings, a.id, view.id)};
    const auto triangle = view.shape == Shape::voxels ? narrow::voxel_triangle : narrow::triangle_obstacle;
    (c.kind == 0 ? narrow::surfel_obstacle : c.kind == 1 ? narrow::edge_obstacle : triangle)(pair, run, out);
  }
};

// Candidates that are worth a block of their own: some five microseconds.
constexpr size_t kBlock = 96;

}  // namespace

void NarrowBlocks::add(const Array<Candidate> &list, Range run) {
  const size_t end = run.end;
  const auto add_to = [&](size_t at) {
    run.end = at;
    ranges_.push_back(run);
    if (run.known.apart) run.known.apart += at - run.begin;
    run.begin = at;
  };
  // a run of two surfaces may be divided between features of body a; other runs not
  if (!list[run.begin].obstacle)
    for (size_t at = run.begin + kBlock; at < end; ++at)
      if (list[at].feature_a != list[at - 1].feature_a) {
        add_to(at);
        at += kBlock - 1;
      }
  add_to(end);
}

void find_contacts(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                   const Array<Candidate> &candidates, double h, double offset,
                   std::span<const Crossing> crossings, Array<uint8_t> &lent, Array<ContactPoint> &out,
                   NarrowBlocks *blocks, Tasks *tasks, ListMemory *known) {
  out.clear();
  Finder find{bodies, obstacles, h, offset, crossings};
  for (const BodyView &b : bodies) find.nnode = std::max(find.nnode, b.first_node + b.surface->nsurfel);
  const bool parts = blocks && tasks && tasks->parallel() && candidates.size() > 2 * kBlock;
  if (parts) blocks->start();
  struct Fast {  // the body that was last looked at
    const BodyView *body = nullptr;
    double speed = 0;
  } fast[2];
  const auto speed_of = [&](int side, uint32_t slot) {
    const BodyView *const b = find_slot(bodies, slot);
    if (std::exchange(fast[side].body, b) != b)
      fast[side].speed = b->speed < 0 ? largest_speed(*b->surface) : b->speed;
    return fast[side].speed;
  };
  size_t number = 0;  // of the run
  for (size_t i = 0; i < candidates.size(); ++number) {
    const Candidate &c = candidates[i];
    NarrowBlocks::Range run{i, end_of_run(candidates, i), 0};
    i = run.end;
    if (find.skips(c)) continue;
    if (!c.obstacle) run.speed = speed_of(1, c.slot_b);
    if (!c.obstacle && known)
      run.known = {&known->apart[run.begin], known->runs[number].way, speed_of(0, c.slot_a) + run.speed};
    if (parts) blocks->add(candidates, run);
    else find(narrow::Run(&c, run.end - run.begin), run, out);
  }
  if (parts) blocks->run(*tasks, candidates, find, out);
  Areas(bodies, obstacles, out, lent).share();
}

}  // namespace dfm
