// Conditions between the fields of a snapshot.
#include <algorithm>
#include <cstring>

#include "body/obstacle_mesh.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "world/snapshot_fields.h"

namespace dfm::snapshot {
namespace {

// Bodies of the world that is restored into; both lists are in id order.
struct Things {
  const World &w;
  const Body *body(uint64_t id) const { return find(w.bodies, id); }
  const Obstacle *obstacle(uint64_t id) const { return find(w.obstacles, id); }
  bool known(uint64_t id) const { return body(id) || obstacle(id); }
  template <class List>
  static auto find(const List &list, uint64_t id) -> decltype(list[0].get()) {
    const auto at = std::lower_bound(list.begin(), list.end(), id,
                                     [](const auto &x, uint64_t value) { return x->id < value; });
    return at != list.end() && (*at)->id == id ? at->get() : nullptr;
  }
  // Whether an edge may have this number. Edge numbers of primitives are only compared and index nothing.
  bool edge(uint64_t id, uint32_t number) const {
    if (const Body *const b = body(id)) return number < b->surface.nedge;
    const Obstacle *const o = obstacle(id);
    return o && (!o->mesh || number < o->mesh->surface.nedge);
  }
};

bool good_contacts(const Staged &t, const Things &things) {
  const ContactStore &c = t.store;
  if (c.n > 0 && !(c.h > 0)) return false;
  if (!c.due.empty() && c.due.size() != c.n) return false;
  for (uint32_t i = 0; i < c.n; ++i) {
    const Vec3 n = load3(&c.normal[3 * size_t{i}]), u = load3(&c.tangent[3 * size_t{i}]);
    if (!(norm2(n) < 1.01 && norm2(u) < 1.01)) return false;
    // Contacts of removed things remain until the next sub-step, without touching.
    if (c.id_a[i] >= t.next_id || c.id_b[i] >= t.next_id ||
        (c.touching[i] && !(things.body(c.id_a[i]) && things.known(c.id_b[i]))))
      return false;
  }
  if (c.crossings.size() > c.n || !std::is_sorted(c.crossings.begin(), c.crossings.end())) return false;
  for (const Crossing &x : c.crossings)
    if (things.known(x.id_a) && things.known(x.id_b) &&
        !(things.edge(x.id_a, x.edge_a) && things.edge(x.id_b, x.edge_b)))
      return false;
  return true;
}

bool good_tool_contacts(const Staged &t) {
  const ContactStore &c = t.tool_store;
  if ((c.n > 0 && !(c.h > 0)) || !c.due.empty() || !c.crossings.empty()) return false;
  for (uint32_t i = 0; i < c.n; ++i) {
    const Vec3 n = load3(&c.normal[3 * size_t{i}]), u = load3(&c.tangent[3 * size_t{i}]);
    if (!(norm2(n) < 1.01 && norm2(u) < 1.01) || c.id_a[i] >= t.next_id || c.id_b[i] >= t.next_id)
      return false;
  }
  return true;
}

bool good_work(const std::vector<PairWork> &work, const Things &things) {
  for (size_t i = 0; i < work.size(); ++i)
    if (!things.known(work[i].a) || !things.known(work[i].b) ||
        (i && !(std::pair(work[i - 1].a, work[i - 1].b) < std::pair(work[i].a, work[i].b))))
      return false;
  return true;
}

bool good_aside(const std::vector<PairAside> &pairs, const Things &things) {
  return std::all_of(pairs.begin(), pairs.end(), [&](const PairAside &p) {
    return things.body(p.a) && (p.obstacle ? things.obstacle(p.b) != nullptr : things.body(p.b) != nullptr);
  });
}

bool good_attachments(const std::vector<Attachment> &list, const Things &things) {
  return std::all_of(list.begin(), list.end(), [&](const Attachment &a) {
    const Body *const b = things.body(a.body), *const to = a.obstacle ? nullptr : things.body(a.to);
    if (!b || b == to || !(a.obstacle ? things.obstacle(a.to) != nullptr : to != nullptr)) return false;
    return !a.surfels.empty() && below(a.surfels, b->surface.nsurfel) &&
           (!to || below(a.node, to->surface.nsurfel));
  });
}

bool good_report(const Staged &t, const World &w) {
  const Report &r = t.report;
  if (r.n != t.store.n) return false;
  for (uint32_t i = 0; i < r.n; ++i) {
    const ContactPoint &c = r.contacts[i];
    const double *const values[] = {c.weight, c.point, c.normal, &c.distance, &c.area, c.velocity, &c.give};
    const size_t counts[] = {4, 3, 3, 1, 1, 3, 1};
    for (int k = 0; k < 7; ++k)
      if (!must::all_finite(values[k], counts[k])) return false;
    if (c.key != t.store.key[i] || c.kind > kPrimitive || c.obstacle > 1 || c.nnode > 4 || c.type_a > 2)
      return false;
    if (!t.store.touching[i] && c.slot_a == kNone) continue;  // of a removed body
    if (c.slot_a >= w.bodies.size()) return false;
    if (!t.store.touching[i]) continue;
    if (c.slot_b >= (c.obstacle ? w.obstacles.size() : w.bodies.size())) return false;
    if (w.bodies[c.slot_a]->id != t.store.id_a[i] ||
        (c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id) != t.store.id_b[i])
      return false;
    const Surface &s = w.bodies[c.slot_a]->surface;
    if (c.feature_a >= (c.type_a == 0 ? s.nsurfel : c.type_a == 1 ? s.nedge : s.ntri)) return false;
  }
  return true;
}

}  // namespace

void check(const SnapshotReader &s, const Staged &t, const World &w) {
  if (!s.at_end()) s.refuse("the end", "no bytes after the last field");
  if (!good_contacts(t, {w})) s.refuse("contacts", "contacts of bodies and obstacles that are there");
  if (!good_tool_contacts(t)) s.refuse("contacts of tools", "contacts that tools can have");
  if (!good_work(t.work, {w})) s.refuse("friction work", "pairs that are there, in order");
  if (!good_aside(t.overlaps.aside, {w}))
    s.refuse("pairs that are set aside", "bodies and obstacles that are there");
  if (!good_attachments(t.attachments, {w})) s.refuse("attachments", "surfels of bodies that are there");
  size_t sleepers = 0;
  for (const StagedBody &b : t.bodies) sleepers += b.slumber.asleep;
  if (sleepers != t.sleepers) s.refuse("sleepers", "as many as sleep");
  if (t.sleepers > 0 && !good_report(t, w)) s.refuse("report", "the contacts that are kept");
  for (size_t i = 0; i < t.rigid_sets.size(); ++i) {
    const RigidSet &set = *w.rigid_sets[i];
    for (size_t k = 0; k < set.group.size(); ++k)
      if (set.group[k] == DFM_RIGID_STILL &&
          std::memcmp(&t.rigid_sets[i].state[k], &set.state[k], sizeof(dfm_rigid_state)) != 0)
        s.refuse("rigid state", "a fixed body where it stands");
  }
}

}  // namespace dfm::snapshot
