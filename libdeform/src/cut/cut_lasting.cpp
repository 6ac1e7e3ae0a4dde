#include "cut/cut_lasting.h"

#include <algorithm>

#include "step/stages.h"
#include "world/attach.h"

namespace dfm {
namespace {

// Where a feature is now; target kNone: it is gone.
struct Found { uint32_t target = kNone, feature = kNone; };
Found find(const std::vector<CutTarget> &targets, size_t kind, uint32_t feature) {
  for (uint32_t t = 0; t < targets.size(); ++t)
    if (const uint32_t now = targets[t].map.of[kind][feature]; now != kNone) return {t, now};
  return {};
}

// Gives a place the numbers of the target that has the corners that carry it; kNone: none has. A fourth
// anchor that this target does not have is replaced.
uint32_t carry_place(const BodyShape &before, const std::vector<CutTarget> &targets, Place &p) {
  Vec3 x;
  for (size_t k = 0; k < kAnchors; ++k) x += p.weight[k] * before.surface.sum(p.node[k], before.p.x.data());
  Found now[kAnchors];
  uint32_t target = kNone;
  for (size_t k = 0; k < kAnchors; ++k) {
    now[k] = find(targets, 0, p.node[k]);
    p.node[k] = now[k].feature == kNone ? 0 : now[k].feature;
    if (k == 3 || p.weight[k] == 0) continue;
    if (now[k].target == kNone || (target != kNone && now[k].target != target)) return kNone;
    target = now[k].target;
  }
  if (p.weight[3] == 0 || now[3].target == target) return target;
  if (!std::all_of(now, now + 3, [&](const Found &f) { return f.target == target; })) return kNone;
  p.weight[0] += p.weight[3];
  lift(*targets[target].body, x, p);
  return target;
}

// Divides an attachment: each target gets those of its places that are still there. The stiffness of the
// whole is the sum over its places.
void carry(const Attachment &a, const BodyShape &before, const std::vector<CutTarget> &targets,
           std::vector<Attachment> &out) {
  const uint64_t id = targets[0].id;
  const bool own = a.body == id, anchored = !a.obstacle && a.to == id;
  if (!own && !anchored) return out.push_back(a);
  const size_t begin = out.size();
  for (const CutTarget &t : targets) {
    Attachment &part = out.emplace_back(a);
    part.surfels.clear();
    part.place.clear();
    part.node.clear();
    part.weight.clear();
    part.impulse.clear();
    (own ? part.body : part.to) = t.id;
  }
  for (size_t i = 0; i < a.surfels.size(); ++i) {
    const Found surfel = own ? find(targets, 0, a.surfels[i]) : Found{0, a.surfels[i]};
    uint32_t target = surfel.target;
    Place at{};
    if (!a.obstacle) {
      std::copy_n(&a.node[kAnchors * i], kAnchors, at.node);
      std::copy_n(&a.weight[kAnchors * i], kAnchors, at.weight);
    }
    if (anchored && target != kNone) target = carry_place(before, targets, at);
    if (target == kNone) continue;
    Attachment &part = out[begin + target];
    part.surfels.push_back(surfel.feature);
    for (size_t k = 0; k < 3; ++k) {
      if (a.obstacle) part.place.push_back(a.place[3 * i + k]);
      part.impulse.push_back(a.impulse[3 * i + k]);
    }
    for (size_t k = 0; !a.obstacle && k < kAnchors; ++k) {
      part.node.push_back(at.node[k]);
      part.weight.push_back(at.weight[k]);
    }
  }
  for (size_t t = begin; t < out.size(); ++t) {
    const double share = double(out[t].surfels.size()) / double(a.surfels.size());
    out[t].stiffness *= share;
    out[t].damping *= share;
    if (targets.size() > 1) out[t].release *= share;
    out[t].total = {};
  }
  // an attachment without points is reported only if none of its parts has any
  const auto holds = [](const Attachment &x) { return !x.surfels.empty(); };
  const auto first = out.begin() + std::ptrdiff_t(begin);
  const bool any = std::any_of(first, out.end(), holds);
  if (!any) out.resize(begin + 1);
  else out.erase(std::remove_if(first, out.end(), [&](auto &x) { return !holds(x); }), out.end());
  out[begin].total = a.total;
}

// Gives a side of a contact, or of a crossing of edges, its present numbers; false: it is gone, and its
// feature has number 0.
bool renumber(const std::vector<CutTarget> &targets, size_t kind, uint64_t &id, uint32_t &feature) {
  if (id != targets[0].id) return true;
  const Found now = find(targets, kind, feature);
  feature = now.feature == kNone ? 0 : now.feature;
  if (now.target == kNone) return false;
  id = targets[now.target].id;
  return true;
}

bool renumber(Crossing &c, const std::vector<CutTarget> &targets, const World &w) {
  bool there = renumber(targets, 1, c.id_a, c.edge_a);
  there &= renumber(targets, 1, c.id_b, c.edge_b);
  // of two bodies the older one is side a, and new pieces have no slot yet; an obstacle is side b
  if (c.id_b < c.id_a && obstacle_slot_of(w, c.id_b) == kNone) {
    std::swap(c.id_a, c.id_b);
    std::swap(c.edge_a, c.edge_b);
  }
  return there;
}

}  // namespace

Lasting::Lasting(const World &w, const BodyShape &before, const std::vector<CutTarget> &targets)
    : crossings(w.store.crossings.get_allocator()),
      id_a(w.store.id_a),
      id_b(w.store.id_b),
      feature_a(w.store.feature_a),
      feature_b(w.store.feature_b) {
  for (const Attachment &a : w.attachments) carry(a, before, targets, attachments);
  std::ranges::stable_sort(attachments, {}, &Attachment::body);
  for (Crossing c : w.store.crossings)
    if (renumber(c, targets, w)) crossings.push_back(c);
  std::sort(crossings.begin(), crossings.end());
  ended.assign(w.store.n, 0);
  for (uint32_t i = 0; i < w.store.n; ++i) {
    bool there = renumber(targets, w.store.type_a[i], id_a[i], feature_a[i]);
    there &= renumber(targets, w.store.type_b[i], id_b[i], feature_b[i]);
    ended[i] = !there;
  }
}

namespace {

void exchange(World &w, Lasting &other) noexcept {
  w.attachments.swap(other.attachments);
  w.store.crossings.swap(other.crossings);
  w.store.id_a.swap(other.id_a);
  w.store.id_b.swap(other.id_b);
  w.store.feature_a.swap(other.feature_a);
  w.store.feature_b.swap(other.feature_b);
}

}  // namespace

void reserve_ends(World &w, size_t pieces) {
  reserve_events(w, w.store.n + w.attachments.size() + pieces);
  w.overlaps.placed.reserve(w.overlaps.placed.size() + w.attachments.size());
}

void prepare_with(World &w, Lasting &lasting) {
  exchange(w, lasting);
  try {
    prepare(w);
  } catch (...) {
    exchange(w, lasting);
    throw;
  }
  for (uint32_t i = 0; i < w.store.n; ++i) {
    if (!lasting.ended[i]) continue;
    if (w.store.touching[i])  // of the pair that began
      add_event(w, DFM_EVENT_END, lasting.id_a[i], lasting.id_b[i], w.store.key[i], w.time);
    w.store.touching[i] = 0;
  }
  for (Attachment &a : w.attachments) {
    if (!a.surfels.empty() || a.released) continue;
    a.released = true;
    add_event(w, DFM_EVENT_RELEASE, a.body, a.to, a.number, w.time);
  }
  if (std::erase_if(w.attachments, [](const Attachment &a) { return a.surfels.empty(); })) w.changed = true;
  for (const Attachment &a : lasting.attachments) {
    const auto same = [&](const Attachment &b) {
      return b.body == a.body && b.to == a.to && b.obstacle == a.obstacle;
    };
    if (!a.released && std::none_of(w.attachments.begin(), w.attachments.end(), same))
      w.overlaps.place(a.body);
  }
}

}  // namespace dfm
