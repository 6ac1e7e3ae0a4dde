// What is reported of contact between rigid things: places that carry load, and which pairs touch.
//
// A pair begins and ends to touch as a whole. Places come and go while a box rocks or rolls, so events of
// places would tell a host nothing about what touches what.
#include <algorithm>

#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "step/watch/pair_energy.h"

namespace dfm {
namespace {

// Of the offset: a pair that carries nothing ends to touch where it has opened by this, as contacts of soft
// bodies do (step/keep_contacts.cpp).
constexpr double kApart = 0.1;

}  // namespace

// Whether the first of the two is side b of reports.
bool ToolTouch::b_first(const Obstacle &a, const Obstacle &b) { return is_moved(b) && !is_moved(a); }

std::string ToolTouch::row_names(const World &w, uint32_t row) const {
  const uint64_t *const ids = rows_[row].pair->id;
  return format("'%s' and '%s'", name_of(w, ids[0]).c_str(), name_of(w, ids[1]).c_str());
}

// Seen from the other side the normal and the first tangent are the opposite ones, and the second tangent,
// their product, stays: forces, slips and deflections change their sign along it alone.
void ToolTouch::list_contact(const World &w, const StepContext &step, uint32_t i) {
  const Row &row = rows_[i];
  const Pair &pair = *row.pair;
  const uint32_t r = step.rows.soft() + i;
  const double side = pair.b_first ? -1 : 1;
  const Vec3 v = slip(row);
  RigidContact c{};
  c.key = row.key;
  c.a = pair.id[pair.b_first];
  c.b = pair.id[!pair.b_first];
  c.point = row.at;
  c.normal = side * row.normal;
  c.tangent = side * row.tangent[0];
  c.impulse[0] = row.impulse;
  c.impulse[1] = row.along[0];
  c.impulse[2] = side * row.along[1];
  c.slip[0] = dot(row.tangent[0], v);
  c.slip[1] = side * dot(row.tangent[1], v);
  c.gap = row.gap - offset_;
  c.law = pair.law;
  c.sticks = step.rows.wt[r] > 0 && step.state.mode[r] == 1;
  c.began = match_[i] == kNone;
  for (size_t s = 0; s < std::min<size_t>(2, w.pairs.laws[pair.law]->nstate); ++s)
    c.bristle[s] = (s == 1 ? side : 1) * step.state.bristle_out[s * step.state.stride + r];
  next_report_.contacts.push_back(c);
}

// Memory for it is needed before the sub-step is final.
void ToolTouch::list(const World &w, const StepContext &step) {
  keep_next(step);
  RigidReport &to = next_report_;
  const Array<RigidPair> &before = w.rigid_report.touching;
  to.h = h_;
  to.contacts.clear();
  to.touching.clear();
  to.contacts.reserve(rows_.size());
  to.touching.reserve(rows_.size());
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    const Row &row = rows_[i];
    const RigidPair pair{row.pair->id[row.pair->b_first], row.pair->id[!row.pair->b_first]};
    if (row.impulse > 0) list_contact(w, step, i);
    else if (!(row.gap - offset_ < kApart * offset_) ||
             !std::binary_search(before.begin(), before.end(), pair))
      continue;
    to.touching.push_back(pair);
  }
  std::sort(to.touching.begin(), to.touching.end());
  to.touching.erase(std::unique(to.touching.begin(), to.touching.end()), to.touching.end());
}

size_t ToolTouch::most_events(const World &w) const {
  return next_report_.touching.size() + w.rigid_report.touching.size();
}

// Allocates nothing.
void ToolTouch::keep(World &w) noexcept {
  if (w.tool_store.n > 0 || next_.n > 0) std::swap(w.tool_store, next_);
  RigidReport &now = next_report_;
  if (now.touching.empty() && now.contacts.empty() && w.rigid_report.touching.empty() &&
      w.rigid_report.contacts.empty())
    return;
  const double end = w.time + w.steps->h;
  const auto add_events = [&](uint32_t kind, const Array<RigidPair> &of, const Array<RigidPair> &but) {
    for (const RigidPair &p : of)
      if (!std::binary_search(but.begin(), but.end(), p)) add_event(w, kind, p.a, p.b, 0, end);
  };
  add_events(DFM_EVENT_BEGIN, now.touching, w.rigid_report.touching);
  add_events(DFM_EVENT_END, w.rigid_report.touching, now.touching);
  for (const RigidContact &c : now.contacts) {
    const double work = c.impulse[1] * c.slip[0] + c.impulse[2] * c.slip[1];
    if (work != 0) work_of(w, {c.a, c.b, true}).friction += work;
  }
  std::swap(w.rigid_report, now);
  now.contacts.clear();
  now.touching.clear();
  add_rigid_impulses(w);
}

void end_rigid_contacts(World &w, uint64_t id) {
  RigidReport &r = w.rigid_report;
  reserve_events(w, r.touching.size());
  const auto gone = [&](const auto &x) { return x.a == id || x.b == id; };
  for (const RigidPair &p : r.touching)
    if (gone(p)) add_event(w, DFM_EVENT_END, p.a, p.b, 0, w.time);
  std::erase_if(r.touching, gone);
  std::erase_if(r.contacts, gone);
  w.tool_store.drop(id);
}

void find_touching(const World &w, const ContactStore &of, Array<RigidPair> &out) {
  out.clear();
  for (uint32_t i = 0; i < of.n; ++i) {
    const Obstacle *const a = w.obstacle(of.id_a[i]), *const b = w.obstacle(of.id_b[i]);
    if (!a || !b) continue;
    const bool turned = ToolTouch::b_first(*a, *b);
    out.push_back(turned ? RigidPair{b->id, a->id} : RigidPair{a->id, b->id});
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
}

}  // namespace dfm
