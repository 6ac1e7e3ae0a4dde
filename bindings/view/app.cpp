#include "app.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "json_text.h"
#include "messages.h"
#include "out_folder.h"
#include "run.h"
#include "run_folder.h"
#include "shown.h"
#include "state_file.h"

namespace view {
namespace {

constexpr double kFrame = 1.0 / 60;  // s, of the clock of a script
constexpr double kBudget = 0.022;    // s of a frame that may go into steps, so that the window answers

std::string folder_of(const Options &options, const std::string &scene) {
  if (!options.out.empty()) return options.out;
  return cli::out_folder(scene, "view");
}

// As for off-screen pictures: the scene's own camera, or one that holds everything.
render::Camera first_camera(const cli::SceneFile &scene, const render::Scene &picture, double aspect) {
  render::Camera camera = render::auto_camera(picture, aspect);
  if (scene.settings().has_camera)
    for (int i = 0; i < 3; ++i) {
      camera.eye[i] = scene.settings().eye[i];
      camera.look_at[i] = scene.settings().look_at[i];
    }
  return camera;
}

// Begins where --from says; returns when the scene itself began.
double begin(const cli::SceneFile &scene, const Options &options) {
  cli::refuse_static(scene, "view");
  const double start = dfm_world_time(scene.world());
  if (!options.from.empty() && !options.replay.empty())
    throw cli::Failure(cli::kBadInput, "--from: a replay shows the states that were recorded; leave it out");
  if (!options.from.empty()) cli::read_state(scene, options.from);
  return start;
}

render::Bounds extent_of(cli::Drawing &drawing) {
  render::Scene picture;
  drawing.fill(picture);
  return render::bounds(picture);
}

// --set of a replay may change what is shown, not what was simulated.
std::optional<cli::Recording> recording_of(const Options &options) {
  if (options.replay.empty()) return std::nullopt;
  cli::Recording out = cli::read_recording(options.replay);
  out.set.insert(out.set.end(), options.set.begin(), options.set.end());
  return out;
}

// The first name of which there is no file yet: what was kept before stays.
std::string free_name(const std::function<std::string(uint32_t)> &name) {
  std::error_code absent;
  for (uint32_t n = 0;; ++n)
    if (std::string path = name(n); !std::filesystem::exists(cli::path_of(path), absent)) return path;
}

}  // namespace

Stage::Stage(const Options &options, const cli::Globals &globals, const cli::Recording *replay)
    : scene(globals, replay && options.scene.empty() ? replay->scene : options.scene,
            replay ? replay->set : options.set, replay ? replay->jitter : 0),
      simulation(scene, begin(scene, options)),
      drawing(scene, scene.settings().color),
      extent(extent_of(drawing)),
      bodies(drawing.place_of_bodies()),
      size(extent.empty() ? 1 : render::norm(render::vec(extent.hi) - render::vec(extent.lo))),
      pull(simulation),
      grip(simulation, size),
      plots(simulation, grip),
      sliders(live::make_sliders(simulation)) {}

App::App(const Options &options, const cli::Globals &globals)
    : options_(options),
      globals_(globals),
      replay_(recording_of(options)),
      stage_(std::make_unique<Stage>(options, globals, replay_ ? &*replay_ : nullptr)) {
  if (!options.script.empty()) script_.emplace(options.script);
  const std::string &path = stage_->scene.path();
  options_.out = folder_of(options, path);
  open(options, "deform view " + std::filesystem::path(path).filename().string(), !script_);
  if (!script_ || std::getenv("DEFORM_VIEW_SPNAV")) space_mouse_ = SpaceMouse::open(no_space_mouse_);
  first_look();
  stage_->plots.sample();
  if (replay_) {
    // as simulation.time(), which the clock follows
    for (cli::RecordedState &s : replay_->states) s.t -= dfm_world_time(stage_->scene.world());
    show_state(0);
  }
  wanted_ = stage_->simulation.time();
  last_ = window_->now();
}

void App::attempt(const std::function<void()> &what) {
  try {
    what();
  } catch (const cli::Failure &failure) {
    message_ = failure.what();
    if (script_) throw;  // no user reads the window
  }
}

void App::frame() {
  const bool idle = !script_ && !running_ && held_ < 0 && !space_mouse_ && !stage_->pull.holds();
  std::vector<Input> inputs = window_->poll(idle ? 0.05 : 0);
  std::vector<ScriptLine> current;
  const double now = window_->now();
  double seconds = std::min(now - last_, 0.1);
  if (script_) {
    seconds = kFrame;
    script_->frame(double(frames_) * kFrame, inputs, current);
  }
  frame_ms_ += 0.1 * (1e3 * (now - last_) - frame_ms_);
  last_ = now;
  ++frames_;
  window_->begin_panels(inputs, seconds);
  for (const Input &in : inputs) handle(in);
  for (const ScriptLine &line : current)
    if (line.kind == ScriptLine::slider) set_slider(line.name, line.value);
  attempt([&] {
    pull_to_mouse();
    lead_by_space_mouse(script_ ? double(frames_) * kFrame : now);
    advance(seconds);
  });
  stage_->plots.sample();
  panels();
  if (!draw()) return;
  for (const ScriptLine &line : current)
    if (line.kind == ScriptLine::shot) shot(line.name);
  window_->show();
  if (script_ && script_->done()) quit_ = true;
}

void App::first_look() {
  render::Scene picture;
  stage_->drawing.fill(picture);
  orbit_.set_up(render::vec(picture.up));
  orbit_.set(first_camera(stage_->scene, picture, canvas_.height() > 0 ? aspect() : 1));
}

void App::key(const std::string &name) {
  message_.clear();
  if (name != "b") confirmed_ = false;
  if (name == "space") {
    if (replay_ && !running_ && shown_ + 1 == replay_->states.size()) attempt([&] { show_state(0); });
    if (!replay_ && !running_ && stage_->simulation.at_end()) stage_->simulation.go_on();
    running_ = !running_;
    wanted_ = stage_->simulation.time();
  } else if (name == "s" || name == ".") {
    running_ = false;
    if (!replay_ && stage_->simulation.at_end()) stage_->simulation.go_on();
    attempt([&] {
      if (replay_) show_state(std::min(shown_ + 1, replay_->states.size() - 1));
      else stage_->simulation.step();
    });
    wanted_ = stage_->simulation.time();
  } else if (name == "r") {
    restart();
  } else if (name == "home") {
    first_look();
  } else if (name == "c") {
    static const std::vector<std::string> kColors{"body", "contact", "speed", "displacement", "stress"};
    const auto at = std::find(kColors.begin(), kColors.end(), stage_->drawing.color());
    stage_->drawing.set_color(at == kColors.end() || at + 1 == kColors.end() ? kColors.front() : at[1]);
  } else if (name == "f5" && !replay_) {
    save();
  } else if (name == "f9" && !replay_) {
    load();
  } else if (name == "v" && !replay_) {
    record();
  } else if (name == "h") {
    help_ = !help_;
  } else if (!shared_key(name) && !tool_key(name) && script_) {
    throw cli::Failure(cli::kBadInput,
                       script_->path() + ": there is no key \"" + name + "\"; the key h shows them all");
  }
}

void App::press(int button) {
  const Ray at = ray();
  attempt([&] {
    const int tool =
        button != kMiddle && !replay_ ? stage_->pull.tool_at(stage_->grip, at.origin, at.direction) : -1;
    if (tool >= 0) {
      if (tool != stage_->grip.taken()) stage_->grip.take(tool);
      leads_ = true;
    } else if (button == kLeft && !replay_ && stage_->pull.grab(at.origin, at.direction)) {
      return;
    }
    held_ = button;
  });
}

void App::release(int button) {
  if (button == kLeft && stage_->pull.holds()) attempt([&] { stage_->pull.release(); });
  if (button == held_) leads_ = false;
}

bool App::leads(double dx, double dy) {
  if (leads_) attempt([&] { lead(dx, dy); });
  return leads_;
}

void App::cut(const double blade[12]) {
  if (replay_) return;
  attempt([&] {
    cli::JsonObject line;
    stage_->simulation.act(line.add("do", "\"cut\"", "blade", cli::json_numbers({blade, 12})));
  });
}

// In the plane through the picked place that faces the camera.
void App::pull_to_mouse() {
  if (stage_->pull.holds())
    stage_->pull.move(orbit_.at_depth(across(), above(), aspect(), stage_->pull.to()));
}

void App::set_slider(const std::string &name, double value) {
  if (name == "speed") {
    speed_ = value;
    return;
  }
  if (name == "pull") {
    stage_->pull.stiffness = value;
    return;
  }
  if (name == "time" && replay_) {
    size_t i = 0;
    while (i + 1 < replay_->states.size() && replay_->states[i + 1].t <= value + 1e-9) ++i;
    show_state(i);
    wanted_ = stage_->simulation.time();
    return;
  }
  std::string names = replay_ ? "speed, pull, time" : "speed, pull";
  for (live::Slider &s : stage_->sliders) {
    if (s.name == name) {
      s.apply(value);
      s.value = value;
      return;
    }
    names += ", " + s.name;
  }
  throw cli::Failure(cli::kBadInput,
                     script_->path() + ": there is no slider \"" + name + "\"; there are " + names);
}

void App::advance(double seconds) {
  if (!running_) return;
  const double before = stage_->simulation.time(), began = window_->now();
  wanted_ += seconds * speed_;
  if (replay_) {
    const auto next = [&] { return shown_ + 1 < replay_->states.size(); };
    size_t i = shown_;
    while (i + 1 < replay_->states.size() && replay_->states[i + 1].t <= wanted_ + 1e-9) ++i;
    if (i != shown_) show_state(i);
    if (!next()) running_ = false;
    return;
  }
  while (stage_->simulation.time() < wanted_ - 1e-9) {
    if (!stage_->simulation.step()) {
      running_ = false;
      message_ = stage_->simulation.trouble().empty() ? "The scene has ended; press space to continue."
                                                      : "Stopped: " + stage_->simulation.trouble();
      break;
    }
    if (!script_ && window_->now() - began > kBudget) {  // slower than asked for, rather than stuck
      wanted_ = stage_->simulation.time();
      break;
    }
  }
  if (seconds > 0) real_ += 0.1 * ((stage_->simulation.time() - before) / seconds - real_);
}

void App::show_state(size_t i) {
  cli::read_state(stage_->scene, replay_->states[i].path);
  if (i < shown_) stage_->plots.clear();
  shown_ = i;
}

void App::save() {
  attempt([&] {
    cli::make_folder(options_.out);
    const std::string path = free_name([this](uint32_t n) {
      char name[32];
      std::snprintf(name, sizeof name, "/%03u.state", n);
      return options_.out + name;
    });
    stage_->simulation.save(path);
    saved_ = path;
    for (live::Slider &s : stage_->sliders) s.saved = s.value;
    message_ = "Saved: " + saved_;
  });
}

void App::load() {
  if (saved_.empty()) {
    message_ = "Nothing was saved yet: f5 saves.";
    return;
  }
  attempt([&] {
    stage_->simulation.load(saved_);
    for (live::Slider &s : stage_->sliders) s.value = s.saved;
    stage_->grip.forget();
    stage_->plots.clear();
    wanted_ = stage_->simulation.time();
    message_ = "Loaded: " + saved_;
  });
}

void App::record() {
  attempt([&] {
    if (stage_->simulation.recording()) {
      const uint32_t n = stage_->simulation.stop_recording();
      message_ = std::to_string(n) + " states recorded: deform replay " + cli::shown_word(recorded_);
      return;
    }
    const std::string folder = "/recording";
    const std::string found = free_name(
        [&](uint32_t n) { return options_.out + (n == 0 ? "" : "/" + std::to_string(n + 1)) + folder; });
    recorded_ = found.substr(0, found.size() - folder.size());
    cli::make_folder(recorded_);
    cli::RunOptions run;
    run.out = recorded_;
    run.set = options_.set;
    stage_->simulation.start_recording(run);
  });
}

void App::restart() {
  running_ = false;
  attempt([&] {
    if (replay_) show_state(0);
    else stage_->simulation.restart();
    stage_->grip.forget();
    for (live::Slider &s : stage_->sliders) s.value = s.first;
    stage_->plots.clear();
    stage_->plots.sample();
    wanted_ = stage_->simulation.time();
  });
}

bool App::draw() {
  if (!canvas_.fit()) {
    window_->end_panels();
    return false;
  }
  render::Scene picture;
  stage_->drawing.fill(picture);
  picture.extent = stage_->extent;
  orbit_.set_up(render::vec(picture.up));
  picture.camera = orbit_.camera();
  const double size = stage_->size;
  if (show_arrows_ && !replay_)
    stage_->arrows.fill(touches_of(stage_->scene), size, *picture.camera, picture);
  if (show_arrows_ && !replay_) add_tool_arrows(*picture.camera, picture);
  double held[6];
  if (stage_->pull.holds()) {
    const render::Vec from = stage_->pull.place(), to = stage_->pull.to();
    const double ends[6] = {from.x, from.y, from.z, to.x, to.y, to.z};
    std::copy_n(ends, 6, held);
    picture.lines.push_back({held, 1, {0.1f, 0.1f, 0.1f}, 2, true});
    picture.spheres.push_back({{from.x, from.y, from.z}, 0.006 * size, {{0.1f, 0.1f, 0.1f}, 1}});
    picture.spheres.push_back({{to.x, to.y, to.z}, 0.006 * size, {{0.1f, 0.1f, 0.1f}, 1}});
  }
  add_stroke(picture);
  canvas_.show(picture);
  window_->end_panels();
  return true;
}

void App::shot(const std::string &name) {
  const std::string path = canvas_.write(options_.out, name);
  const std::string hash = cli::hash_text(dfm_world_hash(stage_->scene.world()));
  if (globals_.json) {
    cli::JsonObject bodies, tools, row;
    for (const cli::BodyView &body : stage_->scene.bodies())
      bodies.add(body.name, cli::json_vector(cli::body_measure(body).com));
    for (const cli::RigidView &rigid : stage_->scene.rigids())
      bodies.add(rigid.name, cli::json_vector(cli::rigid_measure(rigid).com));
    for (size_t i = 0; i < stage_->grip.count(); ++i) {
      const live::Felt felt = stage_->grip.felt(i);
      cli::JsonObject tool;
      tools.add(stage_->grip.name(i), tool.add("at", live::text_of(felt.at))
                                          .add("force", live::text_of(felt.force))
                                          .add("torque", live::text_of(felt.torque))
                                          .text());
    }
    row.add("shot", cli::quoted(path), "t", stage_->simulation.time(), "state_hash", cli::quoted(hash), "com",
            bodies.text());
    if (stage_->grip.count() > 0) row.add("tools", tools.text());
    std::printf("%s\n", row.text().c_str());
  } else if (!globals_.quiet) {
    std::printf("%s: t = %g s, state %s\n", path.c_str(), stage_->simulation.time(), hash.c_str());
  }
  std::fflush(stdout);
}

}  // namespace view
