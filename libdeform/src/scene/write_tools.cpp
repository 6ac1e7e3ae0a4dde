// Tools as a scene says them.
#include <algorithm>
#include <cmath>

#include "scene/keys.h"
#include "scene/rotation.h"
#include "scene/write.h"
#include "state/obstacle.h"
#include "state/tool.h"

namespace dfm::writing {
namespace {

using scene::kRadian;

// In degrees, so that the reader gets the same radians where any number gives them.
double degrees_of(double radians) {
  const double near = radians / kRadian;
  double low = near, high = near;
  for (int k = 0; k < 4; ++k) {
    if (kRadian * low == radians) return low;
    if (kRadian * high == radians) return high;
    low = std::nextafter(low, 0);
    high = std::nextafter(high, 400);
  }
  return near;
}

void write_sizes(SceneWriter &to, const Tool &t, Written &out) {
  const dfm_tool_def &d = t.def;
  out["shape"] = scene::word_of("tool_shape", d.shape);
  const bool round = d.shape == DFM_TOOL_SPHERE || d.shape == DFM_TOOL_CAPSULE;
  if (round || (t.has_jaws() && d.radius > 0)) out["radius"] = d.radius;
  if (d.shape == DFM_TOOL_CAPSULE || (t.has_jaws() && d.radius > 0)) out["half_length"] = d.half_length;
  if (!round && d.shape != DFM_TOOL_MESH) out["half_size"] = vector_of(d.half_size);
  if (d.shape == DFM_TOOL_MESH) out["mesh"] = to.triangles(t.name, *to.w.find_obstacle(t.name + ".shape"));
}

void write_motion(const Tool &t, const ToolValues &v, Written &out) {
  // keys go on from where they are; without keys the tool does not move
  dfm_pose at = t.def.pose;
  if (v.keyed == 0) store_pose(at, t.motion.coupled() ? load_place(v.device) : load_pose(t.set->state[0]));
  put(out, "pose", pose_of(at));
  if (v.keyed == 0) return;
  Written &keys = out["motion"]["keyframes"] = Written::array();
  for (const dfm_pose_key &k : t.keys) keys.push_back(key_of(k));
}

void write_opening(const Tool &t, const ToolValues &v, Written &out) {
  if (!t.has_jaws()) return;
  if (v.opening_keyed == 0) {
    out["opening_deg"] = degrees_of(v.opening);
    return;
  }
  Written &keys = out["opening_deg"]["keyframes"] = Written::array();
  for (const dfm_scale_key &k : t.opening_keys) keys.push_back({{"t", k.t}, {"value", degrees_of(k.value)}});
}

void write_coupling(const Tool &t, Written &out) {
  if (!t.motion.coupled()) return;
  const dfm_tool_def &d = t.def;
  Written &c = out["coupling"];
  c = {{"stiffness", d.stiffness},       {"damping", d.damping}, {"turn_stiffness", d.turn_stiffness},
       {"turn_damping", d.turn_damping}, {"mass", d.mass},       {"inertia", d.inertia}};
  if (d.late > 0) c["late"] = d.late;
  if (d.flags & DFM_TOOL_PASSIVE) c["passive"] = true;
}

void write_cuts(const SceneWriter &to, const Tool &t, Written &out) {
  Written names = Written::array();
  for (const auto &b : to.w.bodies)
    if (t.cuts_body(*b)) names.push_back(b->name);
  if (names.empty()) return;
  out["cuts"] = {{"bodies", names}, {"mode", scene::word_of("cut_mode", t.cuts.how)}};
  if (t.cuts.most > 0) out["cuts"]["most"] = t.cuts.most;
}

void note_rigid_tool(SceneWriter &to, const Tool &t, const ToolValues &v) {
  const std::string own[] = {t.name + ".shape", t.name + ".shaft"};
  const auto is_own = [&](const auto &o) { return !o->added || o->name == own[0] || o->name == own[1]; };
  if (!std::all_of(to.w.obstacles.begin(), to.w.obstacles.end(),
                   [&](const auto &o) { return o->rigid != t.set || is_own(o); }))
    to.note(t, ": the shapes that were added to its parts are left out");
  const auto any_part = [&](const auto &f) {
    return std::any_of(to.w.obstacles.begin(), to.w.obstacles.end(),
                       [&](const auto &o) { return o->rigid == t.set && is_own(o) && f(*o); });
  };
  const Obstacle &first = *to.w.obstacle(t.set->obstacle[0]);
  if (any_part([](const Obstacle &o) { return o.sensor; }))
    to.note(t, ": in the scene its parts that are sensors touch");
  if (any_part([&](const Obstacle &o) {
        return o.material != first.material || o.zone.friction != first.zone.friction;
      }))
    to.note(t, ": in the scene all of its parts are of the material of the first");
  if (t.device.read) to.note(t, ": its device is left out; in the scene the tool stands");
  // a matter of the present state, which a snapshot holds
  const dfm_rigid_state &s = t.set->state[0];
  const Pose at = load_pose(s), device = load_place(v.device);
  const bool moves = std::any_of(s.velocity, s.velocity + 3, [](double x) { return x != 0; }) ||
                     std::any_of(s.spin, s.spin + 3, [](double x) { return x != 0; });
  if (!to.options.snapshot && t.motion.coupled() && (moves || !same_bits(&at, &device, sizeof at)))
    to.note(t, ": in the scene it rests where its device is");
  const bool led = !t.keys.empty() || !t.opening_keys.empty();
  if (led && ((v.keyed == 0 && !t.keys.empty()) || (v.opening_keyed == 0 && !t.opening_keys.empty())))
    to.note(t, ": the host leads it now and not its keys, which are left out");
}

}  // namespace

Written write_tool(SceneWriter &to, const Tool &t) {
  to.check_name("tool", t.name);
  const ToolValues v = t.values();
  Written out;
  out["name"] = t.name;
  out["id"] = t.set->obstacle[0];
  write_sizes(to, t, out);
  write_motion(t, v, out);
  write_opening(t, v, out);
  write_coupling(t, out);
  write_cuts(to, t, out);
  to.put_material(out, *to.w.obstacle(t.set->obstacle[0]));
  note_rigid_tool(to, t, v);
  return out;
}

}  // namespace dfm::writing
