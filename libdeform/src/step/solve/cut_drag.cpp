#include "step/solve/cut_drag.h"

#include <algorithm>

#include "state/material.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/tools.h"
#include "step/solve/attach.h"
#include "step/stages.h"

namespace dfm {
namespace {

// Share of what a sub-step has paid; a smaller rest is rounding.
constexpr double kRounding = 1e-9;

// f(body, track, slot of the part) where energy of a cut remains and the tool still cuts the body.
template <class F>
void each_debt(World &w, F &&f) {
  if (w.tools.empty() || w.prescribed.is_static()) return;
  for (auto &b : w.bodies)
    for (BladeTrack &track : b->blades) {
      if (track.cut_work.empty()) continue;
      const uint32_t slot = obstacle_slot_of(w, track.part);
      if (slot != kNone && passes_through(w, *b, *w.obstacles[slot])) f(*b, track, slot);
    }
}

// Surfels are in the order of their points. A point whose cells are all still connected is no surfel: its
// energy is kept until the cut continues.
uint32_t surfel_of(const Body &b, uint32_t point) {
  const auto at = std::lower_bound(b.surface.point.begin(), b.surface.point.end(), point);
  return at == b.surface.point.end() || *at != point ? kNone : uint32_t(at - b.surface.point.begin());
}

}  // namespace

bool tough(const Body &b) {
  const auto takes = [](const Material &m) {
    for (size_t i = 0; i < m.extra_keys.size(); ++i)
      if (m.extra_keys[i] == kToughnessKey && m.extra_values[i][0] > 0) return true;
    return false;
  };
  return std::any_of(b.composition.materials.begin(), b.composition.materials.end(), takes);
}

bool has_dues(const Body &b) {
  return std::any_of(b.blades.begin(), b.blades.end(), [](auto &t) { return !t.cut_work.empty(); });
}

void forget_dues(World &w, const Tool &t) {
  for (auto &b : w.bodies) {
    if (t.cuts.how == DFM_CUT_SPLIT && t.cuts_body(*b)) continue;
    std::erase_if(b->blades, [&](const BladeTrack &track) {
      return std::ranges::find(t.set->obstacle, track.part) != t.set->obstacle.end();
    });
  }
}

void make_cut_drags(World &w, StepContext &step, bool again) {
  each_debt(w, [&](const Body &b, const BladeTrack &track, uint32_t slot) {
    if (b.sleep_state.asleep) return;
    const Obstacle &part = *w.obstacles[slot];
    const BodyView &view = step.body_views[b.slot];
    for (const CutWork &d : track.cut_work) {
      const uint32_t surfel = surfel_of(b, d.point);
      if (surfel == kNone) continue;
      Bond row{};
      row.slot_a = b.slot;
      row.slot_b = slot;
      row.obstacle = 1;
      row.nnode = 1;
      row.node[0] = view.first_node + surfel;
      row.weight[0] = 1;
      row.velocity = place_velocity(part, load3(&b.p.x[size_t{kStride} * d.point]), step);
      row.along = rotate(attached_frame(part).rotation, load3(d.way));
      row.most = step.h * d.force;
      row.max_work = d.energy;
      step.bonds.push_back(row);
      if (!again)
        for (int k = 0; k < 3; ++k) step.bond_impulse.push_back(0);
    }
  });
}

void keep_cut_drags(World &w, StepContext &step) {
  const ContactRows &rows = step.rows;
  uint32_t k = 0;
  while (k < step.bonds.size() && !step.bonds[k].drags()) ++k;
  each_debt(w, [&](const Body &b, BladeTrack &track, uint32_t) {
    if (b.sleep_state.asleep) return;
    for (CutWork &d : track.cut_work) {
      if (surfel_of(b, d.point) == kNone) continue;
      const uint32_t row = rows.n + k++;
      // the frame of a bond is that of the world
      const double paid = -dot(load3(&rows.impulse[size_t{3} * row]), rows.velocity(row));
      d.energy -= paid;
      if (!(d.energy > kRounding * paid)) d.energy = 0;
    }
    std::erase_if(track.cut_work, [](const CutWork &d) { return !(d.energy > 0); });
  });
}

void wake_cut(World &w, StepContext &step) {
  if (w.sleepers == 0) return;
  each_debt(w, [&](Body &b, const BladeTrack &, uint32_t slot) {
    if (!b.sleep_state.asleep || !step.obstacle_views[slot].moves()) return;
    save_start(w, step);
    wake(w, b);
  });
}

}  // namespace dfm
