#include "step/tools.h"

#include <algorithm>

#include "math/turn.h"
#include "state/bounds.h"
#include "state/world.h"
#include "step/rigid.h"

namespace dfm {
namespace {

// Of a passivity controller, in steps: what it adds to a coupling of stiffness k is at most a damper of so
// many k dt. A step of delay takes k dt to make up for (Colgate, Stanley and Brown 1995, eq. 12).
constexpr double kMostDamping = 20;

Pose pose_of(const ToolPlace &p) { return {p.position, p.rotation}; }

// Of the step that begins: where it leads, by keys or by what was said.
ToolValues aimed(const Tool &tool, double end) {
  ToolValues v = tool.values();
  if (v.keyed != 0) {
    const Pose p = pose_at(tool.keys, end);
    store_place(v.target, {p.position, p.rotation});
  }
  if (v.opening_keyed != 0) v.target_opening = scale_at(tool.opening_keys, end);
  return v;
}

// Of whoever moves the tool, in the step that begins.
struct ToolForce { Vec3 force, torque; };
struct Way { Vec3 path, turn; };
Way way_of(const Tool &tool, const ToolValues &v) {
  const ToolPlace from = tool.motion.coupled() ? load_place(v.device) : place_of(tool.set->state[0]);
  const ToolPlace to = load_place(v.target);
  return {to.position - from.position, rotation_vector(to.rotation * conjugate(from.rotation))};
}

// What the hand feels while it makes the step that begins: the last force, or of a late device an older one.
ToolForce felt(const Tool &tool, const ToolValues &v, double now) {
  if (!(tool.motion.late > 0)) return {load3(v.given), load3(v.given + 3)};
  const double then = now - tool.motion.late, slack = 1e-9 * tool.motion.late;
  const size_t n = static_cast<size_t>(v.ngiven), kept = std::min(n, kToolPast);
  for (size_t k = 1; k <= kept; ++k) {
    const ToolGiven g = tool.past((n - k) % kToolPast);
    if (g.t <= then + slack) return {load3(g.force), load3(g.force + 3)};
  }
  return {};
}

// For as long as the hand has got more than it gave: damping in the ratio of the coupling's two stiffnesses, so
// much that what is missing goes in the next step, if that is as fast as the last one. A late device feels it
// when the hand moves otherwise, and damping alone may then drive it; so a late hand gets a share of the force,
// the smaller the more it has got, and with a small share every delay is stable.
void keep_passive(const ToolMotion &m, const Way &way, ToolValues &v) {
  if (!(v.port_work < 0)) return;
  if (m.late > 0) {
    const double stored =
        0.5 * (norm2(load3(v.given)) / m.stiffness + norm2(load3(v.given + 3)) / m.turn_stiffness);
    const double share = stored > 0 ? stored / (stored - v.port_work) : 0;
    for (double &x : v.given) x *= share;
    return;
  }
  const double weight = m.stiffness * norm2(way.path) + m.turn_stiffness * norm2(way.turn);
  if (!(weight > 0)) return;
  const double a = std::min(-v.port_work / weight, kMostDamping);  // steps
  store3(v.given, load3(v.given) - a * m.stiffness * way.path);
  store3(v.given + 3, load3(v.given + 3) - a * m.turn_stiffness * way.turn);
}

}  // namespace

void check_tool_ways(const World &w, double dt) {
  for (auto &t : w.tools) {
    if (t->motion.coupled()) continue;
    const ToolValues v = aimed(*t, w.time + dt);
    for (auto &o : w.obstacles) {
      if (o->rigid != t->set) continue;
      const ToolPlace end =
          part_place(t->motion.parts[o->rigid_body], load_place(v.target), v.target_opening);
      check_way(w, *o, pose_of(place_of(t->set->state[o->rigid_body])), pose_of(end), dt);
    }
  }
}

void begin_tools(World &w, double dt) {
  for (auto &t : w.tools) {
    ToolValues v = aimed(*t, w.time + dt);
    const Way way = way_of(*t, v);
    const ToolForce hand = felt(*t, v, w.time);
    v.port_work -= dot(hand.force, way.path) + dot(hand.torque, way.turn);
    v.measured = v.measured == kToolMeasuredNext ? kToolMeasured : 0;
    v.goal = w.time + dt;
    v.time = 0;
    std::fill(v.contact, v.contact + 6, 0.0);
    std::fill(v.coupling, v.coupling + 6, 0.0);
    store3(v.last_way, way.path);
    store3(v.last_way + 3, way.turn);
    t->store(v);
  }
}

void end_tools(World &w, double dt) {
  for (auto &t : w.tools) {
    ToolValues v = t->values();
    // the hand gets the other side of what holds the tool
    for (int k = 0; k < 6; ++k) v.given[k] = -v.coupling[k] / dt;
    if (t->def.flags & DFM_TOOL_PASSIVE)
      keep_passive(t->motion, {load3(v.last_way), load3(v.last_way + 3)}, v);
    if (t->motion.late > 0) t->remember(w.time, v);
    t->store(v);
  }
}

}  // namespace dfm
