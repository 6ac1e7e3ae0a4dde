// Self contact. A body's surface touches itself where the effect is on for it:
//
//   the scene asks    contact.self, or "self_contact" among its effects
//   an effect needs   plan/plan.cpp: cutting, folding
//   a filter rule     that names the body on both sides decides for this body, whatever the above say
//
// and where its model does not promise the effect itself. Contacts come behind those of pairs, body by body, into the same solve; there
// both sides' weights fall on dofs of one body and are merged where they share one, so the operator is exact (contact/rows.cpp).
#include "world/self_contact.h"

#include <algorithm>

#include "narrow/self_contact.h"
#include "narrow/toi_guard_motion.h"
#include "surfel/pierce.h"
#include "world/world.h"

namespace dfm {
namespace {

double median(std::vector<double> &v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// The last rule that names the body on both sides.
bool rule_of(const World &w, const Body &b, bool otherwise) {
  for (const FilterRule &rule : w.filters)
    if (rule.between[0] == b.name && rule.between[1] == b.name) otherwise = rule.collide;
  return otherwise;
}

bool promises(const Body &b) {
  const std::vector<std::string> words = effects(*b.model.type);
  return std::find(words.begin(), words.end(), kSelfContact) != words.end() && b.model.works(kSelfContact);
}

SelfBody *self_body(World &w, uint32_t slot) {
  const auto at = std::lower_bound(w.self_bodies.begin(), w.self_bodies.end(), slot, [](auto &s, uint32_t v) { return s->body->slot < v; });
  return at != w.self_bodies.end() && (*at)->body->slot == slot ? at->get() : nullptr;
}

void find_tangled(SelfBody &b) {
  const Surface &s = b.body->surface;
  b.tangled.assign(s.nsurfel, 0), b.looked = true;
  b.list.near_triangles([&](uint32_t t, uint32_t u) {
    const uint32_t *const c = &s.tri[3 * size_t{t}], *const d = &s.tri[3 * size_t{u}];
    if (share_a_corner(c, d) || !(edges_pierce(s, t, s, u) || edges_pierce(s, u, s, t))) return;
    for (int k = 0; k < 3; ++k) b.tangled[c[k]] = b.tangled[d[k]] = 1;
  });
}

bool is_tangled(SelfBody &b, uint32_t surfel) {
  if (!b.looked) find_tangled(b);
  return b.tangled[surfel];
}

}  // namespace

SelfBody::SelfBody(const Memory &m, const Body &b) : id(b.id), body(&b), list(m, b.surface) {
  const Surface &s = b.surface;
  rest.x = Array<double>(size_t{4} * s.nsurfel, 0.0, HookAllocator<double>(m));
  const auto at = [&](uint32_t phyxel) { return load3(&b.p.rest[size_t{3} * phyxel]); };
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    Vec3 x;
    s.each_phyxel(i, [&](uint32_t phyxel, double weight) { x += weight * at(phyxel); });
    store3(&rest.x[4 * size_t{i}], x);
  }
  std::vector<double> cells;
  for (size_t e = 0; e < b.edges.size(); e += 2) cells.push_back(norm(at(b.edges[e]) - at(b.edges[e + 1])));
  rest.thin = 2 * std::max(s.median_edge, median(cells));
}

bool asks_self_contact(const World &w) {
  return w.def.self_contact || std::find(w.asked_effects.begin(), w.asked_effects.end(), kSelfContact) != w.asked_effects.end();
}

void choose_self_bodies(World &w, SceneFacts &facts, std::vector<uint32_t> &used) {
  facts.self = w.def.self_contact != 0;
  const bool asked = !self_asked_by(facts).empty();
  std::vector<std::unique_ptr<SelfBody>> before;
  before.swap(w.self_bodies);
  for (auto &b : w.bodies) {
    if (promises(*b) || !rule_of(w, *b, asked)) continue;
    const auto same = std::find_if(before.begin(), before.end(), [&](auto &s) { return s && s->id == b->id; });
    w.self_bodies.push_back(same != before.end() ? std::move(*same) : std::make_unique<SelfBody>(w.memory(), *b));
    w.find_law(b->slot, b->slot, used);
    for (const uint32_t law : used)
      for (const std::string &e : effects(*w.laws[law]->type)) facts.offered.push_back({e, w.laws[law]->type->id});
  }
  facts.self_bodies = static_cast<unsigned>(w.self_bodies.size());
}

void World::stage_self() {
  if (!plan.has(StageId::narrow)) contacts.clear();
  for (auto &s : self_bodies) {
    const BodyView &view = body_views[s->body->slot];
    s->looked = false;
    if (view.asleep) continue;
    s->list.update(h, offset);
    SelfBody *const self = s.get();
    const Tangled tangled = [self](uint32_t surfel) { return is_tangled(*self, surfel); };
    find_self_contacts(view, s->rest, s->list.vertex_face(), s->list.edge_edge(), h, offset, plan.has(StageId::guard) ? tangled : nullptr, lent, contacts);
  }
}

bool cover_self(World &w) {
  bool fresh = false;
  for (auto &s : w.self_bodies) {
    const uint32_t slot = s->body->slot;
    if (w.body_views[slot].asleep) continue;
    s->list.cover(w.h, w.offset, s->body->model.stepper ? w.guard.speed[slot] : w.guard.change[slot]);
    fresh |= s->joined != s->list.renewals();
  }
  return fresh;
}

void join_self(World &w, Array<Candidate> &to) {
  for (auto &s : w.self_bodies) {
    const uint32_t slot = s->body->slot;
    for (const SelfPair &p : s->list.vertex_face()) to.push_back({slot, slot, p.a, p.b, kVertexFace, 0});
    for (const SelfPair &p : s->list.edge_edge()) to.push_back({slot, slot, p.a, p.b, kEdgeEdge, 0});
    s->joined = s->list.renewals();
  }
}

double guarded_apart(World &w, const Candidate &c) {
  SelfBody &b = *self_body(w, c.slot_a);
  const Surface &s = b.body->surface;
  const bool edges = c.kind == kEdgeEdge;
  const auto any = [&](const uint32_t *corner, int n) { return std::any_of(corner, corner + n, [&](uint32_t surfel) { return is_tangled(b, surfel); }); };
  const bool a_is = any(narrow::corners_of(s, edges ? 1 : 0, c.feature_a), edges ? 2 : 1);
  const bool b_is = any(narrow::corners_of(s, edges ? 1 : 2, c.feature_b), edges ? 2 : 3);
  return a_is && b_is ? 0 : self_apart(s, b.rest, ContactKind(c.kind), c.feature_a, c.feature_b, w.offset);
}

}  // namespace dfm
