#include "step/rigid/tools.h"

#include <algorithm>

#include "math/turn.h"
#include "state/bounds.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"

namespace dfm {
namespace {

// Settings of the passivity controller. Where the hand has got as much as the coupling stores at the force
// that it is to get, it gets an eleventh of that force; what it has got is forgiven within about a second, so
// that a steady push is felt again once the loop is quiet.
constexpr double kSteep = 10;
constexpr double kForgiven = 1;  // s

// Where the step that begins leads a tool: by keys or by what was said; by its device if it has one.
ToolValues aimed(const Tool &tool, double end) {
  ToolValues v = tool.values();
  if (v.keyed != 0 && !tool.device.read) store_place(v.target, pose_at(tool.keys, end));
  if (v.opening_keyed != 0) v.target_opening = scale_at(tool.opening_keys, end);
  return v;
}

// The work of the hand that moves the tool, in the step that begins.
struct ToolForce { Vec3 force, torque; };
struct Way { Vec3 path, turn; };
Way way_of(const Tool &tool, const ToolValues &v) {
  const Pose from = tool.motion.coupled() ? load_place(v.device) : load_pose(tool.set->state[0]);
  const Pose to = load_place(v.target);
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

// J, of the hand that goes this way against what it feels.
double work_of(const ToolForce &hand, const Way &way) {
  return -dot(hand.force, way.path) - dot(hand.torque, way.turn);
}

// What is left of a tank after a step of dt.
double forgiven(double tank, double dt) { return tank < 0 ? tank * (kForgiven / (kForgiven + dt)) : tank; }

// A share of the force, the smaller the more the hand has got that it never gave. A loop with a small gain is
// stable with every delay; damping, which would act as late as the force does, is not.
void keep_passive(const ToolMotion &m, ToolValues &v) {
  if (!(v.tank < 0)) return;
  const double stored =
      0.5 * (norm2(load3(v.given)) / m.stiffness + norm2(load3(v.given + 3)) / m.turn_stiffness);
  const double share = stored > 0 ? stored / (stored - kSteep * v.tank) : 0;
  for (double &x : v.given) x *= share;
}

}  // namespace

void check_tool_ways(const World &w, double dt) {
  for (auto &t : w.tools) {
    if (t->motion.coupled()) continue;
    const ToolValues v = aimed(*t, w.time + dt);
    for (auto &o : w.obstacles) {
      if (o->rigid != t->set) continue;
      const Pose end = part_place(t->motion.parts[o->rigid_body], load_place(v.target), v.target_opening);
      check_way(w, *o, load_pose(t->set->state[o->rigid_body]), end, dt);
    }
  }
}

bool passes_through(const World &w, const Body &b, const Obstacle &o) {
  if (!o.rigid || !o.rigid->of_tool) return false;
  const auto at = std::find_if(w.tools.begin(), w.tools.end(), [&](auto &t) { return t->set == o.rigid; });
  if (at == w.tools.end() || !(*at)->cuts_body(b)) return false;
  const Tool &t = **at;
  return t.def.shape == DFM_TOOL_ELLIPSOID ? o.name == t.name + ".shape"
                                           : !o.added && o.rigid_body >= t.first_cutting_part();
}

void begin_tools(World &w, double dt) {
  for (auto &t : w.tools) {
    ToolValues v = aimed(*t, w.time + dt);
    const double work = work_of(felt(*t, v, w.time), way_of(*t, v));
    v.port_work += work;
    v.tank = forgiven(v.tank + work, dt);
    v.measured = v.measured == kToolMeasuredNext ? kToolMeasured : 0;
    v.goal = w.time + dt;
    v.time = 0;
    if (!t->cuts.bodies.empty() && !w.prescribed.is_static()) t->cuts.waits = true;
    std::fill(v.contact, v.contact + 6, 0.0);
    store3(v.about, load_pose(t->set->state[0]).position);
    std::fill(v.coupling, v.coupling + 6, 0.0);
    t->store(v);
  }
}

void take_back_work(World &w, double start) {
  for (auto &t : w.tools) {
    ToolValues v = t->values();
    if (!(w.time < v.goal)) continue;
    const double work = work_of(felt(*t, v, start), way_of(*t, v)), dt = v.goal - start;
    v.port_work -= work;
    if (v.tank < 0) v.tank *= (kForgiven + dt) / kForgiven;
    v.tank = forgiven(v.tank - work, w.time - start);
    t->store(v);
  }
}

void end_tools(World &w, double dt) {
  for (auto &t : w.tools) {
    ToolValues v = t->values();
    // the hand gets the other side of what holds the tool
    for (int k = 0; k < 6; ++k) v.given[k] = -v.coupling[k] / dt;
    if (t->def.flags & DFM_TOOL_PASSIVE) keep_passive(t->motion, v);
    if (t->is_to_remember(w.time, v)) t->remember(w.time, v);
    t->store(v);
  }
}

}  // namespace dfm
