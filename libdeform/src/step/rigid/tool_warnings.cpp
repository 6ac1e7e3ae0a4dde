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

constexpr uint32_t kLooks = 16;   // pieces of an edge whose ends are tested
constexpr double kDeep = 0.02;    // of the smaller one's reach: a smaller depth is not reported
constexpr uint64_t kSeldom = 16;  // steps between two tests of driven tools against triangles

// m, depth of the center of a shape without corners inside another one; 0: it is outside.
double center_depth(const ToolShape &a, const ToolShape &b) {
  double deepest = 0;
  ObstaclePoint o;
  for (const auto &[own, other] : {std::pair(&a, &b), std::pair(&b, &a)})
    if (!own->endless() && other->closest(own->position(), HUGE_VAL, o))
      deepest = std::max(deepest, -o.distance);
  return deepest;
}

bool cuts(const World &w, const Obstacle &o) {
  return std::any_of(w.tools.begin(), w.tools.end(),
                     [&](const auto &t) { return t->set == o.rigid && !t->cuts.bodies.empty(); });
}

}  // namespace

// Whether the depth is reported.
bool ToolTouch::inside(const ToolShape &a, const ToolShape &b, double deep) const {
  const double smaller = std::min(a.endless() ? HUGE_VAL : a.reach(), b.endless() ? HUGE_VAL : b.reach());
  return deep > offset_ + kDeep * smaller;
}

// m, how deep one reaches into the other now, by its corners and, if `edges`, along its edges; 0: not at all.
double ToolTouch::depth(ToolShape &a, ToolShape &b, bool edges) const {
  if (!cull_facing(a, b, offset_, true)) return 0;
  double deepest = 0;
  ObstaclePoint o;
  const auto look = [&](const ToolShape &in, Vec3 p, double round) {
    if (in.closest(p, HUGE_VAL, o)) deepest = std::max(deepest, round - o.distance);
  };
  for (const auto &[own, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (const auto &corner : own->corners()) look(*other, corner.at, own->round());
    if (!edges) continue;
    for (const ToolShape::Edge &e : own->edges())
      for (uint32_t k = 1; k < kLooks; ++k)
        look(*other, e.from + (double(k) / kLooks) * (e.to - e.from), own->round());
  }
  return deepest;
}

bool ToolTouch::reported(const Pair &pair) const {
  return std::any_of(reported_.begin(), reported_.end(),
                     [&](const auto &known) { return known[0] == pair.id[0] && known[1] == pair.id[1]; });
}

// Warns, once for each pair, of rigid bodies of other hosts that pass through something. A host with a world
// of its own may let bodies overlap by a little.
void ToolTouch::warn_passing(const World &w, const StepContext &step) {
  for (const uint32_t k : near_) {
    const Pair &pair = pairs_[k];
    if (!pair.passes) continue;
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb) || reported(pair)) continue;
    ToolShape shape_a(va, a.mesh.get()), shape_b(vb, b.mesh.get());
    const bool corners = shape_a.has_corners() || shape_b.has_corners();
    const double deep = corners ? depth(shape_a, shape_b, true) : center_depth(shape_a, shape_b);
    if (!inside(shape_a, shape_b, deep)) continue;
    reported_.push_back({pair.id[0], pair.id[1]});
    const Obstacle &body = is_moved(a) ? a : b, &other = is_moved(a) ? b : a;
    w.context->warn(
        "'%s' is %.3g m deep in '%s' at %.6g s and goes through it; make both (what stands: \"fixed\") "
        "bodies of one host, of boxes or triangles, or filter the pair",
        body.name.c_str(), deep, other.name.c_str(), w.time);
  }
}

// Warns, once for each pair, of what the rows do not end: a tool without a coupling that passes through an
// obstacle, and something placed inside what keeps it out.
void ToolTouch::warn_deep(const World &w, const Pair &pair, double deep, bool driven) {
  if (reported(pair)) return;
  reported_.push_back({pair.id[0], pair.id[1]});
  const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
  const Obstacle &own = is_of_set(a) ? a : b, &other = is_of_set(a) ? b : a;
  if (driven)
    w.context->warn({"tool", own.name.c_str()},
                    " is %.3g m deep in '%s' at %.6g s and goes through it, because it goes exactly where it "
                    "is told; give it a \"coupling\" (stiffness), or filter the pair",
                    deep, other.name.c_str(), w.time);
  else
    w.context->warn(
        "'%s' is %.3g m deep in '%s' at %.6g s, which contact opens by %.2g m in a sub-step only; place it "
        "outside, or filter the pair",
        own.name.c_str(), deep, other.name.c_str(), w.time, kOpens * offset_);
}

// Warns of tools without a coupling that pass through each other or through obstacles. Tools that cut are
// left out: their edge goes into the table under what they cut.
void ToolTouch::warn_driven(const World &w, const StepContext &step) {
  const auto can_move = [&](const Side &side, const Obstacle &to) {
    const Moved &m = sides_[side.tool];
    return m.responds ||
           (m.gives(to) && std::any_of(m.jaws.begin(), m.jaws.end(),
                                       [&](const Moved::Jaw &jaw) { return jaw.part == side.part; }));
  };
  for (const uint32_t k : near_) {
    const Pair &pair = pairs_[k];
    if (pair.passes) continue;
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const bool wall_a = !is_of_set(a), wall_b = !is_of_set(b);
    const Side &at_a = side_of_[pair.a], &at_b = side_of_[pair.b];
    if ((!wall_a && can_move(at_a, b)) || (!wall_b && can_move(at_b, a)) || reported(pair)) continue;
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    const bool wall = wall_a || wall_b, mesh = va.surface || vb.surface;
    if (wall && (cuts(w, wall_a ? b : a) || (mesh && w.step_count % kSeldom != 0))) continue;
    ToolShape shape_a(va, a.mesh.get()), shape_b(vb, b.mesh.get());
    const double deep = depth(shape_a, shape_b, !(wall && mesh));
    if (wall) {
      if (inside(shape_a, shape_b, deep)) warn_deep(w, pair, deep, true);
      continue;
    }
    if (!(deep > offset_) && !(goes_far_for_size(pair) && meeting(w, step, pair, shape_a, shape_b) <= 1))
      continue;
    reported_.push_back({pair.id[0], pair.id[1]});
    w.context->warn(
        "tools '%s' and '%s' have met at %.6g s%s and pass each other, because both go exactly where they "
        "are told; give one of them a \"coupling\" (stiffness), or filter the pair",
        a.name.c_str(), b.name.c_str(), w.time, deep > offset_ ? format(" (%.3g m deep)", deep).c_str() : "");
  }
}

}  // namespace dfm
