#include "held_tools.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "messages.h"

namespace cli {
namespace {

constexpr double kLag = 0.03;   // s, with which a tool follows the hand
constexpr double kTurning = 6;  // rad/s, the most that a hand turns a tool
constexpr double kOpening = 2;  // rad/s, the most that it opens or closes the jaws

void product(const double a[4], const double b[4], double out[4]) {
  const double q[4] = {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
                       a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                       a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
                       a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
  std::copy_n(q, 4, out);
}

// The rotation vector that leads from one rotation to the other, the short way.
void turn_between(const double from[4], const double to[4], double out[3]) {
  const double back[4] = {-from[0], -from[1], -from[2], from[3]};
  double q[4];
  product(to, back, q);
  const double sign = q[3] < 0 ? -1 : 1, s = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
  const double angle = 2 * std::atan2(s, sign * q[3]);
  for (int k = 0; k < 3; ++k) out[k] = s > 0 ? sign * angle * q[k] / s : 0;
}

// The share of a path that is covered in a step of h at that speed at most.
double share_of(double way, double speed, double h) { return way > speed * h ? speed * h / way : 1; }

}  // namespace

void turned(const double from[4], const double turn[3], double out[4]) {
  const double angle = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  const double s = angle > 0 ? std::sin(0.5 * angle) / angle : 0;
  const double q[4] = {s * turn[0], s * turn[1], s * turn[2], std::cos(0.5 * angle)};
  product(q, from, out);
}

HeldTools::Held &HeldTools::held(const std::string &name) {
  for (Held &h : held_)
    if (h.name == name) return h;
  Held made;
  made.name = name;
  need(dfm_world_find_tool(scene_.world(), name.c_str(), &made.tool));
  dfm_tool_def def = dfm_tool_def_default();
  need(dfm_tool_get_def(made.tool, &def));
  made.jaws = def.shape == DFM_TOOL_GRASPER || def.shape == DFM_TOOL_SCISSORS;
  held_.push_back(made);
  return held_.back();
}

void HeldTools::lead(const JsonValue &line) {
  const std::vector<double> to = line.numbers("to", 3), rotation = line.numbers("rotation", 4);
  Held &h = held(line.get("tool"));
  std::copy_n(to.data(), 3, h.to.position);
  std::copy_n(rotation.data(), 4, h.to.rotation);
  h.opening = line.scalar("opening");
  h.speed = line.scalar("speed");
  h.returns = false;
  h.line = line;
}

void HeldTools::let(const JsonValue &line) {
  Held &h = held(line.get("tool"));
  h.returns = true;
  h.speed = line.scalar("speed");
  h.line = line;
}

// False: it is led no more.
bool HeldTools::walk(Held &held, double now, double h) {
  const dfm_tool_state state = got<dfm_tool_state>(dfm_tool_get_state, held.tool);
  dfm_pose from = state.device, start = {}, to = held.to;
  double opening = state.opening, first = 0, last = held.opening;
  double way[3], turn[3];
  if (held.returns) {
    // what is between the tool and its keys goes away, while the keys go on
    if (dfm_tool_keys_at(held.tool, now, &start, &first) != DFM_OK) return false;  // it has none
    need(dfm_tool_keys_at(held.tool, now + h, &to, &last));
    for (int k = 0; k < 3; ++k) way[k] = from.position[k] - start.position[k];
    turn_between(start.rotation, from.rotation, turn);
    const double left = 1 - share_of(norm(way), held.speed, h);
    const double left_turn = 1 - share_of(norm(turn), kTurning, h);
    const double left_open = 1 - share_of(std::abs(opening - first), kOpening, h);
    if (left <= 0 && left_turn <= 0 && left_open <= 0) {
      need(dfm_tool_follow_keys(held.tool));
      return false;
    }
    for (int k = 0; k < 3; ++k) {
      to.position[k] += left * way[k];
      turn[k] *= left_turn;
    }
    turned(to.rotation, turn, to.rotation);
    last += left_open * (opening - first);
  } else {
    const double lag = 1 - std::exp(-h / kLag);
    for (int k = 0; k < 3; ++k) way[k] = to.position[k] - from.position[k];
    turn_between(from.rotation, to.rotation, turn);
    const double share = std::min(lag, share_of(norm(way), held.speed, h));
    const double turning = std::min(lag, share_of(norm(turn), kTurning, h));
    for (int k = 0; k < 3; ++k) {
      to.position[k] = from.position[k] + share * way[k];
      turn[k] *= turning;
    }
    turned(from.rotation, turn, to.rotation);
    last = opening + share_of(std::abs(last - opening), kOpening, h) * (last - opening);
  }
  need(dfm_tool_set_pose(held.tool, &to, nullptr));
  if (held.jaws) need(dfm_tool_set_opening(held.tool, std::clamp(last, 0.0, 3.0)));
  return true;
}

void HeldTools::before_step(double h) {
  const double now = dfm_world_time(scene_.world());
  std::erase_if(held_, [&](Held &held) { return !walk(held, now, h); });
}

std::vector<JsonValue> HeldTools::lines() const {
  std::vector<JsonValue> out;
  for (const Held &h : held_) out.push_back(h.line);
  return out;
}

}  // namespace cli
