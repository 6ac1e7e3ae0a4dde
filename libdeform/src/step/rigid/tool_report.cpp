// What is reported of contact between rigid things: places that carry load, and which pairs touch.
//
// A pair begins and ends to touch as a whole. Places come and go while a box rocks or rolls, so events of
// places would tell a host nothing about what touches what.
#include <algorithm>

#include "core/error.h"
#include "core/lists.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"
#include "step/sides.h"
#include "step/stages.h"
#include "step/step_impulses.h"

namespace dfm {
namespace {

// Share of the offset: a pair that carries nothing ends to touch where it has opened by this, as contacts of
// soft bodies do (step/keep_contacts.cpp).
constexpr double kApart = 0.1;

}  // namespace

// Whether the first of the two is side b of reports.
bool ToolTouch::b_first(const Obstacle &a, const Obstacle &b) { return is_moved(b) && !is_moved(a); }

bool b_first(const Entities &w, const ContactStore &s, uint32_t i) {
  const Obstacle *const a = w.obstacle(s.id_a[i]);  // of two rigid things alone
  return a && ToolTouch::b_first(*a, *w.obstacle(s.id_b[i]));
}

PairSides pair_sides(const World &w, const ContactStore &s, uint32_t i) {
  const uint64_t a = s.id_a[i], b = s.id_b[i];
  const bool turned = b_first(w, s, i) || (b < a && !w.obstacle(b));
  return turned ? PairSides{b, a, true} : PairSides{a, b, false};
}

std::string ToolTouch::row_names(const Entities &entities, uint32_t row) const {
  const auto &ids = rows_[row].pair->id;
  return format("'%s' and '%s'", name_of(entities, ids[0]).c_str(), name_of(entities, ids[1]).c_str());
}

// Memory for it is needed before the sub-step is final.
void ToolTouch::list(const WorldState &state, const Solution &solution) {
  keep_next(solution);
  const Array<RigidPair> &before = state.rigid_touching;
  next_touching_.clear();
  next_touching_.reserve(rows_.size());
  for (const Row &row : rows_) {
    const RigidPair pair{row.pair->id[row.pair->b_first], row.pair->id[!row.pair->b_first]};
    const bool goes_on =
        row.gap - offset_ < kApart * offset_ && std::binary_search(before.begin(), before.end(), pair);
    if (row.impulse > 0 || goes_on) next_touching_.push_back(pair);
  }
  sort_unique(next_touching_);
}

// Allocates nothing.
void ToolTouch::keep(World &w) noexcept {
  if (w.tool_store.n > 0 || next_.n > 0) std::swap(w.tool_store, next_);
  const double end = w.time + w.steps->h;
  const auto add_events = [&](uint32_t kind, const Array<RigidPair> &of, const Array<RigidPair> &but) {
    for (const RigidPair &p : of)
      if (!std::binary_search(but.begin(), but.end(), p)) add_event(w, kind, p.a, p.b, 0, end);
  };
  add_events(DFM_EVENT_BEGIN, next_touching_, w.rigid_touching);
  add_events(DFM_EVENT_END, w.rigid_touching, next_touching_);
  w.rigid_touching.swap(next_touching_);
  next_touching_.clear();
  const ContactStore &s = w.tool_store;
  for (uint32_t i = 0; i < s.n; ++i) {
    const double *const l = &s.impulse[size_t{3} * i], *const slip = &s.slip[size_t{2} * i];
    const double work = l[1] * slip[0] + l[2] * slip[1];
    if (work == 0) continue;
    const PairSides sides = pair_sides(w, s, i);
    add_friction_work(w, sides.a, sides.b, work);
  }
  dfm::add_impulses(w, s);
}

void end_rigid_contacts(World &w, uint64_t id) {
  reserve_events(w, w.rigid_touching.size());
  const auto gone = [&](const RigidPair &p) { return p.a == id || p.b == id; };
  for (const RigidPair &p : w.rigid_touching)
    if (gone(p)) add_event(w, DFM_EVENT_END, p.a, p.b, 0, w.time);
  std::erase_if(w.rigid_touching, gone);
  w.tool_store.drop(id);
}

void find_touching(const World &w, const ContactStore &of, Array<RigidPair> &out) {
  out.clear();
  for (uint32_t i = 0; i < of.n; ++i) {
    const PairSides sides = pair_sides(w, of, i);
    out.push_back({sides.a, sides.b});
  }
  sort_unique(out);
}

}  // namespace dfm
