// Warnings of rigid things that are deep in each other, or pass through each other because neither yields.
#include <algorithm>

#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr uint32_t kEdgeParts = 16;  // pieces of an edge whose ends are tested
constexpr double kDeep = 0.02;       // of the smaller one's reach: a smaller depth is not reported
constexpr uint64_t kSeldom = 16;     // steps between two tests of driven tools against triangles

bool cuts(const Entities &entities, const Obstacle &o) {
  return std::any_of(entities.tools.begin(), entities.tools.end(),
                     [&](const auto &t) { return t->set == o.rigid && !t->cuts.bodies.empty(); });
}

}  // namespace

// Whether the depth is reported.
bool ToolTouch::inside(const ToolShape &a, const ToolShape &b, double deep) const {
  const double smaller = std::min(a.endless() ? HUGE_VAL : a.reach(), b.endless() ? HUGE_VAL : b.reach());
  return deep > offset_ + kDeep * smaller;
}

// m, how deep one reaches into the other now, by its corners and, if `edges`, along its edges; of two without
// corners, by a center. 0: not at all.
double ToolTouch::depth(ToolShape &a, ToolShape &b, bool edges) const {
  if (!cull_facing(a, b, offset_, true)) return 0;
  double deepest = 0;
  ObstaclePoint o;
  const auto look = [&](const ToolShape &in, Vec3 p, double round) {
    if (in.closest(p, HUGE_VAL, o)) deepest = std::max(deepest, round - o.distance);
  };
  for (const auto &[own, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (const auto &corner : own->corners()) look(*other, corner.at, own->round());
    if (!a.has_corners() && !b.has_corners() && !own->endless()) look(*other, own->position(), 0);
    if (!edges) continue;
    for (const ToolShape::Edge &e : own->edges())
      for (uint32_t k = 1; k < kEdgeParts; ++k)
        look(*other, e.from + (double(k) / kEdgeParts) * (e.to - e.from), own->round());
  }
  return deepest;
}

bool ToolTouch::reported(const Pair &pair) const {
  return std::ranges::find(reported_, pair.id) != reported_.end();
}

// Warns, once for each pair, of what its rows open too slowly: something placed inside what keeps it out.
void ToolTouch::warn_deep(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                          const Pair &pair, double deep) {
  if (reported(pair)) return;
  reported_.push_back(pair.id);
  const Obstacle &a = *entities.obstacles[pair.a], &b = *entities.obstacles[pair.b];
  memory.context->warn(
      "'%s' is %.3g m deep in '%s' at %.6g s, which contact opens by %.2g m in a sub-step only; place it "
      "outside, or filter the pair",
      (is_of_set(a) ? a : b).name.c_str(), deep, (is_of_set(a) ? b : a).name.c_str(), state.time,
      kOpens * offset_);
}

// Warns, once for each pair, of things that pass through each other: rigid bodies of other hosts (one with a
// world of its own may let bodies overlap by a little), and tools without a coupling. Tools that cut are left
// out: their edge goes into the table under what they cut.
void ToolTouch::warn_passing(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                             const Views &views) {
  const auto can_move = [&](const Obstacle &o, const Obstacle &to) {
    if (!is_of_set(o)) return false;
    const Side &side = side_of_[o.slot];
    const Moved &m = sides_[side.tool];
    return m.responds ||
           (m.gives(to) && std::ranges::find(m.jaws, side.part, &Moved::Jaw::part) != m.jaws.end());
  };
  for (const uint32_t k : near_) {
    const Pair &pair = pairs_[k];
    const Obstacle *a = entities.obstacles[pair.a].get(), *b = entities.obstacles[pair.b].get();
    if (reported(pair) || (!pair.passes && (can_move(*a, *b) || can_move(*b, *a)))) continue;
    if (pair.passes ? !is_moved(*a) : !is_of_set(*a)) std::swap(a, b);
    const bool wall = !pair.passes && !is_of_set(*b);
    const ObstacleView &va = views.obstacle_views[a->slot], &vb = views.obstacle_views[b->slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    const bool mesh = wall && (va.surface || vb.surface);
    if ((wall && cuts(entities, *a)) || (mesh && state.step_count % kSeldom != 0)) continue;
    ToolShape shape_a(va, a->mesh.get()), shape_b(vb, b->mesh.get());
    const double deep = depth(shape_a, shape_b, !mesh);
    if (pair.passes || wall) {
      if (!inside(shape_a, shape_b, deep)) continue;
    } else if (!(deep > offset_) &&
               !(goes_far_for_size(pair) && meeting(entities, views, pair, shape_a, shape_b) <= 1))
      continue;
    reported_.push_back(pair.id);
    if (pair.passes)
      memory.context->warn(
          "'%s' is %.3g m deep in '%s' at %.6g s and goes through it; make both (what stands: \"fixed\") "
          "bodies of one host, of boxes or triangles, or filter the pair",
          a->name.c_str(), deep, b->name.c_str(), state.time);
    else if (wall)
      memory.context->warn(
          {"tool", a->name.c_str()},
          " is %.3g m deep in '%s' at %.6g s and goes through it, because it goes exactly where it "
          "is told; give it a \"coupling\" (stiffness), or filter the pair",
          deep, b->name.c_str(), state.time);
    else
      memory.context->warn(
          "tools '%s' and '%s' have met at %.6g s%s and pass each other, because both go exactly where they "
          "are told; give one of them a \"coupling\" (stiffness), or filter the pair",
          a->name.c_str(), b->name.c_str(), state.time,
          deep > offset_ ? format(" (%.3g m deep)", deep).c_str() : "");
  }
}

}  // namespace dfm
