#include "live/grip.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "messages.h"
#include "run.h"

namespace live {

using render::Vec;

Grip::Grip(Simulation &simulation, double size) : simulation_(simulation), speed_(2 * size) {
  const dfm_world world = simulation.scene().world();
  for (const dfm_tool tool : cli::listed<dfm_tool>(dfm_world_tools, world)) {
    dfm_tool_def def = dfm_tool_def_default();
    cli::need(dfm_tool_get_def(tool, &def));
    tools_.push_back({tool, def.name, def.shape == DFM_TOOL_GRASPER || def.shape == DFM_TOOL_SCISSORS});
  }
}

Felt Grip::felt(size_t tool) const {
  const dfm_tool_state state = cli::got<dfm_tool_state>(dfm_tool_get_state, tools_[tool].tool);
  double force[3], torque[3], out[3];
  cli::need(dfm_tool_force(tools_[tool].tool, force, torque));
  Felt felt;
  felt.at = render::vec(state.pose.position);
  cli::rotate(state.pose.rotation, force, out);
  felt.force = render::vec(out);
  cli::rotate(state.pose.rotation, torque, out);
  felt.torque = render::vec(out);
  return felt;
}

int Grip::tool_of(const std::string &part) const {
  for (size_t i = 0; i < tools_.size(); ++i)
    for (const char *ending : {"", ".left", ".right", ".shaft", ".shape"})
      if (part == tools_[i].name + ending) return int(i);
  return -1;
}

void Grip::take(int tool) {
  taken_ = tool;
  if (tool < 0) return;
  const dfm_tool_state state = cli::got<dfm_tool_state>(dfm_tool_get_state, tools_[size_t(tool)].tool);
  put(state.device, state.opening);
}

void Grip::next() { take(taken_ + 1 < int(tools_.size()) ? taken_ + 1 : -1); }

void Grip::let_go() {
  if (taken_ < 0) return;
  cli::JsonObject line;
  simulation_.act(line.add("do", "\"let\"", "tool", cli::quoted(name(size_t(taken_))), "speed", speed_));
  taken_ = -1;
}

void Grip::put(const dfm_pose &pose, double opening) {
  to_ = render::vec(pose.position);
  std::copy_n(pose.rotation, 4, rotation_);
  opening_ = opening;
  update_pull();
}

dfm_pose Grip::pose() const {
  return {{to_.x, to_.y, to_.z}, {rotation_[0], rotation_[1], rotation_[2], rotation_[3]}};
}

void Grip::move_to(const Vec &to) {
  if (to.x == to_.x && to.y == to_.y && to.z == to_.z) return;
  to_ = to;
  update_pull();
}

void Grip::turn(const Vec &axis, double angle) {
  const Vec a = render::unit(axis) * angle;
  const double by[3] = {a.x, a.y, a.z};
  double q[4];
  cli::turned(rotation_, by, q);
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int k = 0; k < 4; ++k) rotation_[k] = q[k] / length;
  update_pull();
}

void Grip::open(double by) {
  if (!jaws()) return;
  opening_ = std::clamp(opening_ + by, 0.0, 0.5 * std::numbers::pi);
  update_pull();
}

void Grip::update_pull() {
  const double to[3] = {to_.x, to_.y, to_.z};
  cli::JsonObject line;
  simulation_.act(line.add("do", "\"tool\"", "tool", cli::quoted(name(size_t(taken_))), "to",
                           cli::json_vector(to), "rotation", cli::json_numbers(rotation_), "opening",
                           opening_, "speed", speed_));
}

// The spring would swing all bodies six times a second, and the ball moves as lightly as a hundredth of them:
// it yields before it crushes what it meets.
std::string tools_with_probe(const cli::SceneFile &scene, const render::Bounds &bodies) {
  if (scene.bodies().empty())
    throw cli::Failure(cli::kBadInput, "There is no soft body for a tool to touch.");
  cli::JsonValue tools;
  cli::parse_json(scene.value("/tools"), tools);
  std::vector<std::string> all;
  std::string name = "probe";
  const auto taken = [&] {
    const auto same = [&](const auto &thing) { return thing.name == name; };
    return std::any_of(scene.bodies().begin(), scene.bodies().end(), same) ||
           std::any_of(scene.obstacles().begin(), scene.obstacles().end(), same);
  };
  for (int n = 2; taken(); ++n) name = "probe" + std::to_string(n);
  for (const cli::JsonValue &tool : tools.items) all.push_back(cli::json_text(tool));
  double mass = 0;
  for (const cli::BodyView &body : scene.bodies()) mass += cli::body_measure(body).mass;
  const Vec low = render::vec(bodies.lo), high = render::vec(bodies.hi), size = high - low;
  const double radius = 0.08 * std::max({size.x, size.y, size.z});
  const double rate = 2 * std::numbers::pi * 6, k = mass * rate * rate, light = 0.01 * mass;
  const double at[3] = {0.5 * (low.x + high.x), 0.5 * (low.y + high.y), high.z + 2 * radius};
  const double damping = 2 * std::sqrt(k * light), arm = radius * radius;
  cli::JsonObject coupling, pose, probe;
  coupling.add("stiffness", k, "damping", damping, "turn_stiffness", k * arm, "turn_damping", damping * arm,
               "mass", light, "inertia", light * arm);
  pose.add("position", cli::json_vector(at));
  probe.add("name", cli::quoted(name), "shape", "\"sphere\"", "radius", radius, "pose", pose.text(),
            "coupling", coupling.text());
  all.push_back(probe.text());
  return cli::json_array(all);
}

}  // namespace live
