// Rows between rigid things whose bodies soft bodies touch as well. They are solved together with the
// contacts of soft bodies (solve.cpp): a light body between a heavy and a soft one has one motion, which two
// solves in turns do not find. Before that they are solved alone, so that detection knows where rigid things
// go, and after it once more, to the accuracy that places of rigid things need.
//
//   left out   islands of rows with jaws, whose springs soft bodies do not move, and with motors, which are
//              decided between solves (tool_joints.cpp)
#include <algorithm>

#include "dynamics/rigid/rigid_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"

namespace dfm {

void ToolTouch::find_shared(const World &w, const StepContext &step) {
  shared_.clear();
  shared_sides_.clear();
  for (Moved &m : sides_) m.shared.assign(m.first.size(), 0);
  if (rows_.empty()) return;
  std::vector<uint8_t> &touched = shared_groups_;  // world-wide groups that soft bodies touch
  touched.assign(step.rigid_groups.size(), 0);
  const auto touch = [&](const auto &c) {
    if (c.obstacle && step.rigid_places[c.slot_b].group != kNone)
      touched[step.rigid_places[c.slot_b].group] = 1;
  };
  for (const ContactPoint &c : step.contacts) touch(c);
  for (const Bond &b : step.bonds) touch(b);
  std::vector<uint8_t> &open = shared_islands_;  // 1: soft bodies touch it; 2: left out
  open.assign(runs_.size(), 0);
  const auto group_of = [&](uint32_t i) {
    return places_[i].a.group != kNone ? places_[i].a.group : places_[i].b.group;
  };
  const auto world_wide = [&](const Group &g) { return sides_[g.tool].set->first_group + g.group; };
  for (uint32_t k = 0; k < groups_.size(); ++k) {
    const Group &g = groups_[k];
    uint8_t &island = open[islands_.of[k]];
    const Moved &m = sides_[g.tool];
    if (g.group == kNone || (m.drives && m.jointed[g.group])) island = 2;
    else if (island == 0 && touched[world_wide(g)]) island = 1;
  }
  for (uint32_t i = 0; i < rows_.size(); ++i)
    if (rows_[i].jaw && group_of(i) != kNone) open[islands_.of[group_of(i)]] = 2;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    if (group_of(i) == kNone || open[islands_.of[group_of(i)]] != 1) continue;
    RigidSides sides = places_[i];
    for (RigidPlace *const place : {&sides.a, &sides.b}) {
      if (place->group == kNone) continue;
      const Group &g = groups_[place->group];
      sides_[g.tool].shared[g.group] = 1;
      place->group = world_wide(g);
    }
    shared_.push_back(i);
    shared_sides_.push_back(sides);
  }
}

const double *ToolTouch::shared_response(const RigidSet &set, uint32_t group) const {
  if (shared_.empty()) return nullptr;
  for (const Moved &m : sides_)
    if (m.set == &set) return m.shared[group] ? &m.response[m.first[group]] : nullptr;
  return nullptr;
}

void ToolTouch::take_off_shared(const RigidSet &set, uint32_t body, Vec3 &velocity, Vec3 &spin) const {
  if (shared_.empty()) return;
  for (const Moved &m : sides_) {
    if (m.set != &set || !m.shared[set.group[body]]) continue;
    const double *const known = &m.known[6 * size_t{body}], *const turn = &m.turn[6 * size_t{body}];
    velocity -= load3(known) - load3(turn);
    spin -= load3(known + 3) - load3(turn + 3);
  }
}

void ToolTouch::put_shared(ContactRows &to, ContactState &state, bool again) {
  if (shared_.empty()) return;
  if (std::any_of(shared_.begin(), shared_.end(), [&](uint32_t i) { return rows_[i].frees; }))
    for (Array<double> *arc : {&to.arc, &to.arc_a}) arc->assign(9 * size_t{to.all()}, 0.0);
  for (uint32_t k = 0; k < shared_.size(); ++k) {
    const uint32_t i = shared_[k], r = to.soft() + k;
    fill_row(rows_[i], to, r, true);
    // what rigid things do without soft bodies is no start: the stack would fall in each sub-step anew
    if (!again) {
      if (3 * size_t{i} < start_.size()) std::copy_n(&start_[3 * size_t{i}], 3, &to.impulse[3 * size_t{r}]);
      else std::fill_n(&to.impulse[3 * size_t{r}], 3, 0.0);
    }
    state.law[r] = state_.law[i];
    state.area[r] = state_.area[i];
    state.dwell[r] = state_.dwell[i];
    for (size_t s = 0; s < state.nstate; ++s)
      state.bristle[s * state.stride + r] = s < state_.nstate ? state_.bristle[s * state_.stride + i] : 0;
  }
}

void ToolTouch::take_shared(const ContactRows &from) {
  if (shared_.empty()) return;
  for (uint32_t k = 0; k < shared_.size(); ++k) {
    Row &row = rows_[shared_[k]];
    const double *const l = &from.impulse[3 * size_t{from.soft() + k}];
    row.impulse = l[0];
    std::copy_n(l + 1, 2, row.along);
  }
  shared_.clear();
  push_all();
  for (Moved &m : sides_)
    for (size_t i = 0; i < m.known.size(); ++i) {
      const uint32_t g = m.set ? m.set->group[i / 6] : DFM_RIGID_STILL;
      if (g != DFM_RIGID_STILL && m.shared[g]) m.known[i] = m.change[i] + m.turn[i];
    }
}

}  // namespace dfm
