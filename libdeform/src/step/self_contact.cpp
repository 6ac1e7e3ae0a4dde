// Self contact. A body's surface touches itself where the effect is on for it:
//
//   the scene asks    contact.self, or "self_contact" among its effects
//   an effect needs   plan/plan.cpp: cutting, folding
//   a cut             has been made in the body
//   a filter rule     that names the body on both sides decides for this body, whatever the above say
//
// and where its model does not promise the effect itself. In sub-steps in which no two of its features are
// within reach of each other, nothing of it is listed or tested. Contacts come behind those of pairs, body by
// body, into the same solve; there both sides' weights fall on dofs of one body and are merged where they
// share one, so the operator is exact (contact/rows.cpp).
#include "step/self_contact.h"

#include <algorithm>
#include <array>

#include "body/make_surface.h"
#include "ccd/toi_guard_motion.h"
#include "core/disjoint_sets.h"
#include "geometry/pierce.h"
#include "plugin/registry.h"
#include "state/world.h"
#include "step/context.h"
#include "step/pair_table.h"
#include "step/stages.h"

namespace dfm {
namespace {

double median(std::vector<double> &v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// The last rule that names the body on both sides.
bool rule_of(const World &w, const Body &b, bool otherwise) {
  const auto named = [&](const std::string &side) {
    return side == b.name || (!b.whole_name.empty() && side == b.whole_name);
  };
  for (const FilterRule &rule : w.filters)
    if (named(rule.between[0]) && named(rule.between[1])) otherwise = rule.collide;
  return otherwise;
}

bool promises(const Body &b) {
  const std::vector<std::string> words = effects(*b.model.type);
  return std::find(words.begin(), words.end(), kSelfContact) != words.end() && b.model.works(kSelfContact);
}

SelfBody *self_body(StepContext &step, uint32_t slot) {
  const auto at = std::lower_bound(step.self_bodies.begin(), step.self_bodies.end(), slot,
                                   [](auto &s, uint32_t v) { return s->body->slot < v; });
  return at != step.self_bodies.end() && (*at)->body->slot == slot ? at->get() : nullptr;
}

using Corners = std::array<uint32_t, 3>;

// OpenedSurface::side. twin [ntri]: the triangle on the other side of the open face, or kNone.
// Where two open faces meet at an edge that they have not split, four triangles do: around the edge one ends
// where the next begins, and no face meets its own other side.
void find_sides(const Surface &s, const Array<uint32_t> &twin, Array<uint32_t> &side) {
  std::vector<std::pair<uint32_t, uint32_t>> of_edge;  // and a half edge: 3 t + k
  for (uint32_t h = 0; h < 3 * s.ntri; ++h)
    if (twin[h / 3] != kNone) of_edge.push_back({s.tri_edge[h], h});
  std::sort(of_edge.begin(), of_edge.end());
  DisjointSets sides(*side.get_allocator().memory, s.ntri);
  const auto forward = [&](uint32_t h) { return s.tri[h] < s.tri[h - h % 3 + (h + 1) % 3]; };
  for (size_t i = 0, j = 0; i < of_edge.size(); i = j) {
    for (j = i; j < of_edge.size() && of_edge[j].first == of_edge[i].first;) ++j;
    if (j > i + 4) continue;
    for (size_t k = i; k < j; ++k)
      for (size_t l = i; l < k; ++l) {
        const uint32_t a = of_edge[k].second, b = of_edge[l].second;
        if (forward(a) != forward(b) && twin[a / 3] != b / 3) sides.join(a / 3, b / 3);
      }
  }
  side.assign(s.ntri, kNone);
  for (uint32_t t = 0; t < s.ntri; ++t)
    if (twin[t] != kNone) side[t] = sides.root(t);
}

// OpenedSurface::copies.
void find_copies(const Surface &s, OpenedSurface &out) {
  std::vector<std::pair<uint32_t, uint32_t>> by_origin;
  for (uint32_t i = 0; i < s.nsurfel; ++i) by_origin.push_back({out.origin[i], i});
  std::sort(by_origin.begin(), by_origin.end());
  const auto first = [&](uint32_t a, uint32_t b) {
    for (uint32_t f = s.fan_begin[b]; f < s.fan_begin[b + 1]; ++f) {
      const uint32_t twin = out.twin[s.fan[f]];
      if (twin == kNone) continue;
      const uint32_t *const c = &s.tri[3 * size_t{twin}];
      if (c[0] == a || c[1] == a || c[2] == a) return s.fan[f];
    }
    return kNone;
  };
  for (size_t i = 0; i < by_origin.size(); ++i)
    for (size_t j = i; j-- > 0 && by_origin[j].first == by_origin[i].first;) {
      const uint32_t a = by_origin[i].second, b = by_origin[j].second;
      out.copies.push_back({a, b, first(a, b)});
    }
  std::sort(out.copies.begin(), out.copies.end(),
            [](auto &l, auto &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; });
  out.copies_begin.assign(s.nsurfel + 1, 0);
  for (const OpenedSurface::Copies &c : out.copies) ++out.copies_begin[c.a + 1];
  for (uint32_t i = 0; i < s.nsurfel; ++i) out.copies_begin[i + 1] += out.copies_begin[i];
}

OpenedSurface opened_surface(const Memory &m, const Body &b) {
  OpenedSurface out;
  use_memory(m, out.origin, out.twin, out.side, out.begin, out.near, out.point, out.copies, out.copies_begin);
  if (!b.surface.slit) return out;
  const Surface &s = b.surface;
  out.point = s.point;
  for (const uint32_t p : s.point) out.origin.push_back(b.cut.point[p]);
  std::vector<std::pair<Corners, uint32_t>> by_corners;
  for (uint32_t t = 0; t < s.ntri; ++t) {
    Corners c;
    for (size_t k = 0; k < 3; ++k) c[k] = out.origin[s.tri[size_t{3} * t + k]];
    std::sort(c.begin(), c.end());
    by_corners.push_back({c, t});
  }
  std::sort(by_corners.begin(), by_corners.end());
  out.twin.assign(s.ntri, kNone);
  for (size_t i = 1; i < by_corners.size(); ++i) {
    if (by_corners[i].first != by_corners[i - 1].first) continue;
    out.twin[by_corners[i].second] = by_corners[i - 1].second;
    out.twin[by_corners[i - 1].second] = by_corners[i].second;
  }
  find_sides(s, out.twin, out.side);
  find_copies(s, out);
  std::vector<std::vector<uint32_t>> near(b.p.n);
  for (size_t e = 0; e < b.edges.size(); e += 2) {
    near[b.edges[e]].push_back(b.edges[e + 1]);
    near[b.edges[e + 1]].push_back(b.edges[e]);
  }
  out.begin.push_back(0);
  for (const uint32_t p : s.point) {
    std::sort(near[p].begin(), near[p].end());
    out.near.insert(out.near.end(), near[p].begin(), near[p].end());
    out.begin.push_back(uint32_t(out.near.size()));
  }
  return out;
}

enum Crosses : uint8_t { unasked, no, yes };

// Tested for few triangles only, where something is deeper than it should be: testing the whole surface would
// take longer than the rest of a step.
bool crosses_another(SelfBody &b, uint32_t triangle) {
  const Surface &s = b.body->surface;
  if (b.crosses.empty()) b.crosses.assign(s.ntri, unasked);
  if (b.crosses[triangle] != unasked) return b.crosses[triangle] == yes;
  b.crosses[triangle] = no;
  b.list.near_triangle(triangle, [&](uint32_t other) {
    if (b.crosses[triangle] != yes &&
        !share_a_corner(&s.tri[3 * size_t{triangle}], &s.tri[3 * size_t{other}]) &&
        triangles_cross(s, triangle, s, other))
      b.crosses[triangle] = b.crosses[other] = yes;
  });
  return b.crosses[triangle] == yes;
}

// Whether the surfel is of a triangle that crosses another one at the start of the sub-step.
bool is_tangled(SelfBody &b, uint32_t surfel) {
  const Surface &s = b.body->surface;
  const auto fan = s.fan.begin();
  return std::any_of(fan + s.fan_begin[surfel], fan + s.fan_begin[surfel + 1],
                     [&](uint32_t triangle) { return crosses_another(b, triangle); });
}

// Continues the lists of the surface before a cut. The cut moves the surfels that it sets back again. ways:
// as SelfRest::way, before the cut.
void follow_cut(const World &w, const SelfList &before, const Array<double> &ways, const FeatureMap &features,
                SelfBody &now) {
  constexpr double kSame = 1e-6;  // ways are of length one or so
  Array<uint8_t> moved(now.body->surface.nsurfel, 0, w.meters.detection.memory());
  const auto way = [](const Array<double> &all, size_t i) {
    return all.empty() ? Vec3{} : load3(&all[4 * i]);
  };
  for (uint32_t i = 0; i < features.of[0].size(); ++i)
    if (const uint32_t to = features.of[0][i]; to != kNone)
      moved[to] = norm2(way(now.rest.way, to) - way(ways, i)) > kSame * kSame;
  now.list.follow(before, features, moved);
}

}  // namespace

SelfRest self_rest_of(const Memory &m, Body &b) {
  SelfRest rest;
  Surface &s = b.surface;
  rest.x = Array<double>(size_t{4} * s.nsurfel, 0.0, m);
  const auto at = [&](uint32_t phyxel) { return load3(&b.p.rest[size_t{3} * phyxel]); };
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    Vec3 x;
    s.each_phyxel(i, [&](uint32_t phyxel, double weight) { x += weight * at(phyxel); });
    store3(&rest.x[4 * size_t{i}], x);
  }
  std::vector<double> cells;
  for (size_t e = 0; e < b.edges.size(); e += 2) cells.push_back(norm(at(b.edges[e]) - at(b.edges[e + 1])));
  rest.thin = 2 * std::max(s.median_edge, median(cells));
  rest.opened = opened_surface(m, b);
  if (!rest.opened.any()) return rest;
  rest.way = Array<double>(size_t{4} * s.nsurfel, 0.0, m);
  ways_back(s, rest.x.data(), [&](uint32_t i, Vec3 way) { store3(&rest.way[4 * size_t{i}], way); });
  return rest;
}

SelfBody::SelfBody(const Memory &m, Body &b)
    : id(b.id),
      shape(b.shape),
      body(&b),
      rest(b.self_rest ? std::move(*b.self_rest) : self_rest_of(m, b)),
      list(m, b.surface) {
  use_memory(m, pairs.of_face, pairs.of_edges, pairs.copies, pairs.slack);
  b.self_rest.reset();
}

bool uses_self_contact(const World &w) {
  return w.selection.lists(kSelfContact) || w.def.self_contact != DFM_SELF_OFF;
}

uint32_t count_self(const World &w, StepContext &step) {
  if (step.self_bodies.empty()) return 0;
  for (auto &s : step.self_bodies) s->touches = false;
  const ContactStore &c = w.store;
  for (uint32_t i = 0; i < c.n; ++i)
    if (c.touching[i] && c.id_a[i] == c.id_b[i])
      if (SelfBody *const s = self_body(step, slot_of(w, c.id_a[i]))) s->touches = true;
  return static_cast<uint32_t>(
      std::count_if(step.self_bodies.begin(), step.self_bodies.end(), [](auto &s) { return s->touches; }));
}

bool lists_after_cut(const World &w, const Body &b) {
  const std::vector<std::unique_ptr<SelfBody>> &all = w.steps->self_bodies;
  return !b.cut.whole && w.selection.wants(kSelfContact) && !promises(b) && rule_of(w, b, true) &&
         std::none_of(all.begin(), all.end(), [&](auto &s) { return s->id == b.id; });
}

void choose_self_bodies(World &w, StepContext &step, SceneFacts &facts, std::vector<uint32_t> &used) {
  facts.self = w.def.self_contact != DFM_SELF_OFF;
  const bool requested = !self_requested_by(facts).empty();
  std::vector<std::unique_ptr<SelfBody>> before;
  before.swap(step.self_bodies);
  for (auto &b : w.bodies) {
    const std::unique_ptr<FormerSurface> former = std::move(b->former_surface);
    const bool cut = b->cut.whole != nullptr;
    if (promises(*b) || !w.selection.wants(kSelfContact) || !rule_of(w, *b, requested || cut)) continue;
    facts.self_cut = facts.self_cut || cut;
    const auto same = std::find_if(before.begin(), before.end(),
                                   [&](auto &s) { return s && s->id == b->id && s->shape == b->shape; });
    step.self_bodies.push_back(same != before.end()
                                   ? std::move(*same)
                                   : std::make_unique<SelfBody>(w.meters.detection.memory(), *b));
    SelfBody &self = *step.self_bodies.back();
    if (former && former->now == b->shape) {
      const auto own = std::find_if(before.begin(), before.end(), [&](auto &s) {
        return s && s->id == b->id && s->shape == former->shape;
      });
      if (own != before.end()) follow_cut(w, (*own)->list, (*own)->rest.way, former->features, self);
      else if (former->list) follow_cut(w, *former->list, {}, former->features, self);
    }
    find_law(w, b->slot, b->slot, used);
    for (const uint32_t law : used) offer_law(*w.laws[law], facts);
  }
  facts.self_bodies = static_cast<unsigned>(step.self_bodies.size());
}

void follow_list(SelfBody &s, double offset) {
  s.pairs.vertex_face = s.list.vertex_face();
  s.pairs.edge_edge = s.list.edge_edge();
  s.pairs.follow(s.body->surface, s.rest, s.list.renewals(), offset);
}

void stage_self(const Derived &derived, const SubStepTimes &times, Views &views, Detection &detection) {
  const Plan &plan = derived.plan;
  const double h = times.h, offset = derived.offset;
  if (!plan.has(StageRole::finds_contacts)) detection.contacts.clear();
  const bool listed = plan.has(StageRole::lists_pairs);  // that stage has computed the speeds
  for (auto &s : views.self_bodies) {
    const BodyView &view = views.body_views[s->body->slot];
    s->crosses.clear();
    if (view.asleep) continue;
    // copies of a point are nearer than they are set back
    const bool opened = s->rest.opened.any();
    if (opened) s->list.update(h, offset);
    s->on = opened || !s->list.far(h, offset, listed ? detection.broad.speed(s->body->slot) : HUGE_VAL);
    if (!s->on) continue;
    s->pairs.within = s->list.within(h, offset);
    SelfBody *const self = s.get();
    const Tangled tangled = [self](uint32_t surfel) { return is_tangled(*self, surfel); };
    follow_list(*s, offset);
    find_self_contacts(view, s->rest, h, offset, plan.has(StageRole::guards) ? tangled : nullptr, s->pairs,
                       detection.lent, detection.contacts);
  }
}

bool cover_self(World &w, StepContext &step) {
  bool fresh = false;
  for (auto &s : step.self_bodies) {
    const uint32_t slot = s->body->slot;
    if (step.body_views[slot].asleep) continue;
    const double change = step.guard.change[slot];
    // An impact may fold a surface within the sub-step that was far from itself before the solve.
    if (!s->on) s->on = !s->list.stays_far(step.h, w.offset, change);
    else if (s->list.cover(step.h, w.offset, change)) follow_list(*s, w.offset);
    fresh |= s->joined != (s->on ? s->list.renewals() : 0);
  }
  return fresh;
}

bool join_self(Views &views, const Array<Candidate> *pairs, Array<Candidate> &to) {
  if (std::none_of(views.self_bodies.begin(), views.self_bodies.end(), [](auto &s) { return s->on; })) {
    for (auto &s : views.self_bodies) s->joined = 0;
    if (pairs) return false;
    to.clear();  // what the broad phase lists is of an earlier plan, whose bodies may be gone
    return true;
  }
  to.clear();
  if (pairs) to.insert(to.end(), pairs->begin(), pairs->end());
  for (auto &s : views.self_bodies) {
    const uint32_t slot = s->body->slot;
    s->joined = 0;
    if (!s->on) continue;
    for (const SelfPair &p : s->list.vertex_face()) to.push_back({slot, slot, p.a, p.b, kVertexFace, 0});
    for (const SelfPair &p : s->list.edge_edge()) to.push_back({slot, slot, p.a, p.b, kEdgeEdge, 0});
    s->joined = s->list.renewals();
  }
  return true;
}

double guarded_apart(World &w, StepContext &step, const Candidate &c) {
  SelfBody &b = *self_body(step, c.slot_a);
  const Surface &s = b.body->surface;
  const bool edges = c.kind == kEdgeEdge;
  const auto any = [&](const uint32_t *corner, int n) {
    return std::any_of(corner, corner + n, [&](uint32_t surfel) { return is_tangled(b, surfel); });
  };
  if (any(narrow::corners_of(s, edges ? 1 : 0, c.feature_a), edges ? 2 : 1) &&
      any(narrow::corners_of(s, edges ? 1 : 2, c.feature_b), edges ? 2 : 3))
    return 0;
  return self_apart(s, b.rest, ContactKind(c.kind), c.feature_a, c.feature_b, w.offset);
}

}  // namespace dfm
