// Tools by keys and mouse, and what of them is drawn into the picture.
#include <algorithm>
#include <numbers>

#include "app.h"
#include "messages.h"

namespace view {

using render::Vec;

namespace {

constexpr double kMove = 0.01;  // of the size of what is shown, for a key
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kTurned = 3 * kDegree, kOpened = 2 * kDegree;  // for a key
constexpr double kArrow = 0.22;  // of an arrow of full length, of the size of what is shown
constexpr float kForce[3] = {0.10f, 0.30f, 0.85f}, kTorque[3] = {0.60f, 0.15f, 0.70f};

}  // namespace

bool App::tool_key(const std::string &name) {
  static const struct {
    const char *key;
    double right, up, back;  // a way, or with shift an axis to turn about
  } kWays[] = {{"left", -1, 0, 0}, {"right", 1, 0, 0},   {"up", 0, 1, 0},
               {"down", 0, -1, 0}, {"pageup", 0, 0, -1}, {"pagedown", 0, 0, 1}};
  static const char *const kOthers[] = {"tab", "l", "j", "k", "b"};
  const bool turns = name.rfind("shift+", 0) == 0;
  const std::string way = turns ? name.substr(6) : name;
  const auto found = std::find_if(std::begin(kWays), std::end(kWays), [&](auto &w) { return way == w.key; });
  const bool other = std::any_of(std::begin(kOthers), std::end(kOthers), [&](auto *k) { return name == k; });
  if (found == std::end(kWays) && !other) return false;
  if (replay_) return true;
  live::Grip &grip = stage_->grip;
  if (name == "b") {
    request_probe();
  } else if (name == "tab") {
    attempt([&] { grip.next(); });
    if (grip.count() == 0) message_ = "The scene has no tool: b adds a ball.";
  } else if (!grip.holds()) {
    message_ = "No tool is in hand: tab takes one, b adds a ball.";
  } else if (name == "l") {
    attempt([&] { grip.let_go(); });
  } else if (name == "j" || name == "k") {
    attempt([&] { grip.open(name == "j" ? -kOpened : kOpened); });
  } else {
    const render::View v = render::view_of(orbit_.camera());
    attempt([&] {
      // right turns about up, up turns about right backwards: what faces the user goes the key's way
      if (turns) grip.turn(v.up * found->right - v.right * found->up + v.back * found->back, kTurned);
      else
        grip.move_to(grip.to() + (v.right * found->right + v.up * found->up + v.back * found->back) *
                                     (kMove * stage_->size));
    });
  }
  return true;
}

// Left: in the plane through where it shall go that faces the camera. Right: turns it.
void App::lead(double dx, double dy) {
  live::Grip &grip = stage_->grip;
  if (!grip.holds()) return;
  const render::View v = render::view_of(orbit_.camera());
  if (held_ == kRight) {
    grip.turn(v.up, kTurn * dx / canvas_.height());
    grip.turn(v.right, kTurn * dy / canvas_.height());
    return;
  }
  const double x = across(), y = above();
  const Vec now = orbit_.at_depth(x, y, aspect(), grip.to());
  const Vec then =
      orbit_.at_depth(x - 2 * dx / canvas_.width(), y + 2 * dy / canvas_.height(), aspect(), grip.to());
  grip.move_to(grip.to() + now - then);
}

// Each move is an act like those of mouse and keys, so that it is recorded.
void App::lead_by_space_mouse(double now) {
  live::Grip &grip = stage_->grip;
  if (!space_mouse_ || !grip.holds() || replay_) return;
  space_mouse_->lead(grip.pose(), grip.opening(), render::view_of(orbit_.camera()), 0.5 * stage_->size);
  const dfm_device device = space_mouse_->device();
  dfm_device_sample sample = {};
  sample.size = sizeof sample;
  if (device.read(device.user, now, &sample) == DFM_OK) grip.put(sample.pose, sample.opening);
}

// Away from the user.
bool App::leads_deeper(double turns) {
  if (leads_ && stage_->grip.holds()) {
    const Vec back = render::view_of(orbit_.camera()).back;
    attempt([&] { stage_->grip.move_to(stage_->grip.to() - back * (2 * kMove * stage_->size * turns)); });
  }
  return leads_;
}

// What was simulated is lost by it.
void App::request_probe() {
  if (stage_->simulation.time() == 0 || confirmed_) return add_probe();
  confirmed_ = true;
  message_ = "A ball starts the scene again from 0 s: press b once more, or any other key to go on as it is.";
}

// The scene with one tool more, from its start: states and recordings are then those of a scene that
// `deform run` reads.
void App::add_probe() {
  attempt([&] {
    Options more = options_;
    more.from.clear();
    more.set.push_back("/tools=" + live::tools_with_probe(stage_->scene, stage_->bodies));
    auto fresh = std::make_unique<Stage>(more, globals_, nullptr);
    fresh->drawing.set_color(stage_->drawing.color());
    stage_ = std::move(fresh);
    options_ = more;
    confirmed_ = false;
    stage_->plots.sample();
    wanted_ = stage_->simulation.time();
    saved_.clear();
    strongest_[0] = strongest_[1] = 0;
    stage_->grip.take(int(stage_->grip.count()) - 1);
    message_ = "The scene starts again, with " + stage_->grip.name(stage_->grip.count() - 1) + " in hand.";
  });
}

void App::add_tool_arrows(const render::Camera &camera, render::Scene &picture) {
  const live::Grip &grip = stage_->grip;
  for (std::vector<double> &xyz : felt_) xyz.clear();
  for (size_t i = 0; i < grip.count(); ++i) {
    const live::Felt felt = grip.felt(i);
    const Vec vectors[2] = {felt.force, felt.torque};
    for (int k = 0; k < 2; ++k) {
      const double length = render::norm(vectors[k]);
      // follows a rise at once and a fall slowly, so that neighboring pictures can be compared
      strongest_[k] = std::max(length, 0.98 * strongest_[k]);
      if (!(length > 0)) continue;
      const Vec way = vectors[k] * (kArrow * stage_->size / strongest_[k]);
      add_arrow(felt_[k], felt.at, felt.at + way, camera, stage_->size);
      if (k == 1) add_arrow(felt_[k], felt.at, felt.at + way * 0.9, camera, stage_->size);  // two heads
    }
  }
  for (int k = 0; k < 2; ++k) {
    render::Lines lines;
    lines.xyz = felt_[k].data();
    lines.n = uint32_t(felt_[k].size() / 6);
    std::copy_n(k == 0 ? kForce : kTorque, 3, lines.rgb);
    lines.width = 3;
    lines.on_top = true;
    if (lines.n > 0) picture.lines.push_back(lines);
  }
  if (!grip.holds()) return;
  const Vec from = grip.felt(size_t(grip.taken())).at, to = grip.to();
  const double ends[6] = {from.x, from.y, from.z, to.x, to.y, to.z};
  std::copy_n(ends, 6, lead_);
  picture.lines.push_back({lead_, 1, {0.1f, 0.1f, 0.1f}, 2, true});
  picture.spheres.push_back({{to.x, to.y, to.z}, 0.006 * stage_->size, {{0.1f, 0.1f, 0.1f}, 1}});
}

}  // namespace view
