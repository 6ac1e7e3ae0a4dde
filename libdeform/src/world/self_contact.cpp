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

bool has_stage(const Plan &plan, StageId id) {
  return std::any_of(plan.stages.begin(), plan.stages.end(), [&](const PlannedStage &s) { return s.id == id; });
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
  if (!has_stage(plan, StageId::narrow)) contacts.clear();
  for (auto &s : self_bodies) {
    const BodyView &view = body_views[s->body->slot];
    if (view.asleep) continue;
    s->list.update(h, offset);
    find_self_contacts(view, s->rest, s->list.vertex_face(), s->list.edge_edge(), h, offset, lent, contacts);
  }
}

}  // namespace dfm
