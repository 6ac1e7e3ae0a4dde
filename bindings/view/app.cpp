#include "app.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "json_text.h"
#include "messages.h"
#include "run.h"
#include "run_folder.h"
#include "state_file.h"

namespace view {
namespace {

constexpr double kFrame = 1.0 / 60;  // s, of the clock of a script
constexpr double kBudget = 0.022;    // s of a frame that may go into steps, so that the window answers
constexpr double kTurn = 3.5;        // radians for a way across the picture's height

std::string folder_of(const Options &options, const std::string &scene) {
  if (!options.out.empty()) return options.out;
  return "out/" + std::filesystem::path(scene).stem().string() + "_view";
}

// As the off-screen pictures stand: the scene's own camera, or one that holds everything.
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

// --set of a replay may change what is shown, not what was simulated.
std::optional<cli::Recording> recording_of(const Options &options) {
  if (options.replay.empty()) return std::nullopt;
  cli::Recording out = cli::read_recording(options.replay);
  out.set.insert(out.set.end(), options.set.begin(), options.set.end());
  return out;
}

bool on_processor(const std::string &device) {
  return device.find("llvmpipe") != std::string::npos || device.find("softpipe") != std::string::npos ||
         device.find("swrast") != std::string::npos;
}

}  // namespace

App::App(const Options &options, const cli::Globals &globals)
    : options_(options),
      globals_(globals),
      replay_(recording_of(options)),
      scene_(globals, replay_ && options.scene.empty() ? replay_->scene : options.scene,
             replay_ ? replay_->set : options.set, replay_ ? replay_->jitter : 0),
      simulation_(scene_, begin(scene_, options)),
      pull_(simulation_),
      plots_(simulation_),
      sliders_(make_sliders(simulation_)),
      drawing_(scene_, scene_.settings().color) {
  if (!options.script.empty()) script_.emplace(options.script);
  options_.out = folder_of(options, scene_.path());
  window_ = Window::open(options.width, options.height,
                         "deform view " + std::filesystem::path(scene_.path()).filename().string(), !script_);
  window_->size(width_, height_);
  render::Scene picture;
  drawing_.fill(picture);
  extent_ = render::bounds(picture);
  orbit_.set(first_camera(scene_, picture, height_ > 0 ? aspect() : 1));
  plots_.sample();
  if (replay_) show_state(0);
  wanted_ = simulation_.time();
  last_ = window_->now();
}

void App::attempt(const std::function<void()> &what) {
  try {
    what();
  } catch (const cli::Failure &failure) {
    message_ = failure.what();
    if (script_) throw;  // nobody reads the window
  }
}

void App::run() {
  window_->begin_panels({}, kFrame);  // sizes of panels are known from the second time on
  panels();
  window_->end_panels();
  while (!window_->closed() && !quit_) frame();
}

void App::frame() {
  const bool idle = !script_ && !running_ && held_ < 0 && !pull_.holds();
  std::vector<Input> inputs = window_->poll(idle ? 0.05 : 0);
  std::vector<ScriptLine> due;
  const double now = window_->now();
  double seconds = std::min(now - last_, 0.1);
  if (script_) {
    seconds = kFrame;
    script_->frame(double(frames_) * kFrame, inputs, due);
  }
  frame_ms_ += 0.1 * (1e3 * (now - last_) - frame_ms_);
  last_ = now;
  ++frames_;
  window_->begin_panels(inputs, seconds);
  for (const Input &in : inputs) handle(in);
  for (const ScriptLine &line : due)
    if (line.kind == ScriptLine::slider) set_slider(line.name, line.value);
  attempt([&] {
    pull_to_mouse();
    advance(seconds);
  });
  plots_.sample();
  panels();
  if (!draw()) return;
  for (const ScriptLine &line : due)
    if (line.kind == ScriptLine::shot) shot(line.name);
  window_->show();
  if (script_ && script_->done()) quit_ = true;
}

void App::handle(const Input &in) {
  if (in.kind == Input::key) return key(in.name);
  mouse(in);
}

void App::key(const std::string &name) {
  message_.clear();
  if (name == "space") {
    if (replay_ && !running_ && shown_ + 1 == replay_->states.size()) show_state(0);
    if (!replay_ && !running_ && simulation_.at_end()) simulation_.go_on();
    running_ = !running_;
    wanted_ = simulation_.time();
  } else if (name == "s" || name == ".") {
    running_ = false;
    if (replay_) {
      show_state(std::min(shown_ + 1, replay_->states.size() - 1));
    } else {
      if (simulation_.at_end()) simulation_.go_on();
      attempt([&] { simulation_.step(); });
    }
    wanted_ = simulation_.time();
  } else if (name == "r") {
    restart();
  } else if (name == "home") {
    render::Scene picture;
    drawing_.fill(picture);
    orbit_.set(first_camera(scene_, picture, aspect()));
  } else if (name == "c") {
    static const std::vector<std::string> kColors{"body", "contact", "speed", "displacement", "stress"};
    const auto at = std::find(kColors.begin(), kColors.end(), drawing_.color());
    drawing_.set_color(at == kColors.end() || at + 1 == kColors.end() ? kColors.front() : at[1]);
  } else if (name == "a") {
    show_arrows_ = !show_arrows_;
  } else if (name == "p") {
    show_plots_ = !show_plots_;
  } else if (name == "t") {
    show_panels_ = !show_panels_;
  } else if (name == "f5" && !replay_) {
    save();
  } else if (name == "f9" && !replay_) {
    load();
  } else if (name == "v" && !replay_) {
    record();
  } else if (name == "h") {
    help_ = !help_;
  } else if (name == "q" || name == "escape") {
    quit_ = true;
  } else if (script_) {
    throw cli::Failure(cli::kBadInput,
                       script_->path() + ": there is no key \"" + name + "\"; the key h shows them all");
  }
}

void App::mouse(const Input &in) {
  if (in.kind == Input::wheel) {
    if (!window_->panels_want_mouse()) orbit_.zoom(std::pow(0.88, in.turns));
    return;
  }
  const double dx = in.x - mouse_[0], dy = in.y - mouse_[1];
  mouse_[0] = in.x;
  mouse_[1] = in.y;
  if (in.kind == Input::press && held_ < 0 && !window_->panels_want_mouse())
    attempt([&] { press(in.button); });
  if (in.kind == Input::release && in.button == kLeft && pull_.holds()) attempt([&] { pull_.release(); });
  if (in.kind == Input::release && in.button == held_) held_ = -1;
  if (in.kind != Input::move || held_ < 0) return;
  if (held_ == kMiddle) orbit_.shift(-dx / height_, dy / height_);
  else orbit_.turn(-kTurn * dx / height_, kTurn * dy / height_);
}

void App::press(int button) {
  if (button == kLeft && !replay_) {
    const Ray ray = orbit_.ray(across(), above(), aspect());
    if (pull_.grab(ray.origin, ray.direction)) return;
  }
  held_ = button;
}

// In the plane through the picked place that faces the camera.
void App::pull_to_mouse() {
  if (pull_.holds()) pull_.move(orbit_.at_depth(across(), above(), aspect(), pull_.to()));
}

void App::set_slider(const std::string &name, double value) {
  if (name == "speed") {
    speed_ = value;
    return;
  }
  if (name == "pull") {
    pull_.stiffness = value;
    return;
  }
  if (name == "time" && replay_) {
    size_t i = 0;
    while (i + 1 < replay_->states.size() && replay_->states[i + 1].t <= value + 1e-9) ++i;
    show_state(i);
    return;
  }
  std::string names = "speed, pull";
  for (Slider &s : sliders_) {
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
  const double before = simulation_.time(), began = window_->now();
  wanted_ += seconds * speed_;
  if (replay_) {
    const auto next = [&] { return shown_ + 1 < replay_->states.size(); };
    size_t i = shown_;
    while (i + 1 < replay_->states.size() && replay_->states[i + 1].t <= wanted_ + 1e-9) ++i;
    if (i != shown_) show_state(i);
    if (!next()) running_ = false;
    return;
  }
  while (simulation_.time() < wanted_ - 1e-9) {
    if (!simulation_.step()) {
      running_ = false;
      message_ = simulation_.trouble().empty() ? "The scene is at its end; space goes on."
                                               : "Stopped: " + simulation_.trouble();
      break;
    }
    if (!script_ && window_->now() - began > kBudget) {  // slower than asked for, rather than stuck
      wanted_ = simulation_.time();
      break;
    }
  }
  if (seconds > 0) real_ += 0.1 * ((simulation_.time() - before) / seconds - real_);
}

void App::show_state(size_t i) {
  const cli::RecordedState &state = replay_->states[i];
  cli::read_state(scene_, state.path);
  if (i < shown_) plots_.clear();
  shown_ = i;
}

void App::save() {
  attempt([&] {
    cli::make_folder(options_.out);
    char name[32];
    std::snprintf(name, sizeof name, "/%03u.state", saved_);
    simulation_.save(options_.out + name);
    ++saved_;
    message_ = "Saved: " + options_.out + name;
  });
}

void App::load() {
  if (saved_ == 0) {
    message_ = "Nothing was saved yet: f5 saves.";
    return;
  }
  attempt([&] {
    char name[32];
    std::snprintf(name, sizeof name, "/%03u.state", saved_ - 1);
    simulation_.load(options_.out + name);
    plots_.clear();
    wanted_ = simulation_.time();
    message_ = "Loaded: " + options_.out + name;
  });
}

void App::record() {
  attempt([&] {
    if (simulation_.recording()) {
      const uint32_t n = simulation_.stop_recording();
      message_ = std::to_string(n) + " states recorded: deform replay " + options_.out;
      return;
    }
    cli::make_folder(options_.out);
    cli::RunOptions run;
    run.out = options_.out;
    run.set = options_.set;
    simulation_.start_recording(run);
  });
}

void App::restart() {
  if (replay_) show_state(0);
  else simulation_.restart();
  for (Slider &s : sliders_) s.value = s.first;
  plots_.clear();
  plots_.sample();
  wanted_ = simulation_.time();
  running_ = false;
}

bool App::draw() {
  uint32_t width = 0, height = 0;
  window_->size(width, height);
  if (width == 0 || height == 0) {
    window_->end_panels();
    return false;
  }
  if (!renderer_ || width != width_ || height != height_) {
    width_ = width;
    height_ = height;
    std::string why;
    renderer_.reset();
    const auto make = [&](render::Detail detail) {
      renderer_ = render::WindowRenderer::create(window_->symbol_of(), detail, width, height, &why);
      if (!renderer_) throw cli::Failure(cli::kBadInput, "view: " + why);
    };
    make(options_.detail == "full" ? render::Detail::full : render::Detail::fast);
    device_ = renderer_->device();
    if (options_.detail.empty() && !on_processor(device_)) make(render::Detail::full);
  }
  render::Scene picture;
  drawing_.fill(picture);
  picture.extent = extent_;
  picture.camera = orbit_.camera();
  const double size = extent_.empty() ? 1 : render::norm(render::vec(extent_.hi) - render::vec(extent_.lo));
  if (show_arrows_ && !replay_) arrows_.fill(scene_, size, *picture.camera, picture);
  double held[6];
  if (pull_.holds()) {
    const render::Vec from = pull_.place(), to = pull_.to();
    const double ends[6] = {from.x, from.y, from.z, to.x, to.y, to.z};
    std::copy_n(ends, 6, held);
    picture.lines.push_back({held, 1, {0.1f, 0.1f, 0.1f}, 2, true});
    picture.spheres.push_back({{from.x, from.y, from.z}, 0.006 * size, {{0.1f, 0.1f, 0.1f}, 1}});
    picture.spheres.push_back({{to.x, to.y, to.z}, 0.006 * size, {{0.1f, 0.1f, 0.1f}, 1}});
  }
  std::string why;
  if (!renderer_->show(picture, &why)) throw cli::Failure(cli::kBadInput, "view: " + why);
  window_->end_panels();
  return true;
}

void App::shot(const std::string &name) {
  cli::make_folder(options_.out);
  const std::string path = name[0] == '/' ? name : options_.out + "/" + name;
  render::Image image;
  renderer_->read_window(image);
  std::string why;
  if (!render::write_png(path, image, &why)) throw cli::Failure(cli::kBadInput, why);
  const std::string hash = cli::hash_text(dfm_world_hash(scene_.world()));
  if (globals_.json) {
    cli::JsonObject bodies, row;
    for (const cli::BodyView &body : scene_.bodies())
      bodies.add(body.name, cli::json_vector(cli::body_measure(body).com));
    for (const cli::RigidView &rigid : scene_.rigids())
      bodies.add(rigid.name, cli::json_vector(cli::rigid_measure(rigid).com));
    row.add("shot", cli::quoted(path))
        .add("t", cli::number(simulation_.time()))
        .add("state_hash", cli::quoted(hash))
        .add("com", bodies.text());
    std::printf("%s\n", row.text().c_str());
  } else if (!globals_.quiet) {
    std::printf("%s: t = %g s, state %s\n", path.c_str(), simulation_.time(), hash.c_str());
  }
  std::fflush(stdout);
}

}  // namespace view
